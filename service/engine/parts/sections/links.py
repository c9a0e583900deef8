"""Links along the borders of faces: which ends of sections and joints of edges belong together.

Along a loop, the side of the image changes at ends, and the side that all faces take for the edges
changes at joints (`edge_sides`). Where both sides differ, a link runs along the border, from one
change to the next. Mostly it leads from an end to the joint of its edge, and has no length. At a
joint the links of all faces of the edge meet.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.edge_sides import EdgeSides
from service.engine.parts.sections.ends import Ends
from service.engine.vectors import Items


@dataclass(frozen=True, eq=False, slots=True)
class Links(Items):
    """k links, each from one change along a loop to a later one of the same loop.

    Attributes
    ----------
    nodes : ndarray of int, shape (2, k)
        Ends have their numbers; joint j has the number of ends + j.
    coedges : ndarray of int, shape (2, k)
        The coedges on which the two changes are.
    t : ndarray of float64, shape (2, k)
        Their parameters.
    sense : ndarray of float64, shape (k,)
        1 if the positive side of the section is on the left of the link, else −1. Between the two
        changes, the image is on the one side and the edge on the other.
    """

    nodes: Ints
    coedges: Ints
    t: FloatArray
    sense: FloatArray

    def __len__(self) -> int:
        return len(self.sense)


def find_links(borders: Borders, sides: EdgeSides, ends: Ends, begins_below: Bools) -> Links:
    """The links along all loops; `begins_below` is the second result of `find_ends`."""
    joints = sides.joints
    order = borders.coedge_edges.argsort(kind="stable")
    edge = borders.coedge_edges[order]
    low = np.searchsorted(edge, joints.edge)
    high = np.searchsorted(edge, joints.edge, side="right")
    joint, place = expand_runs(high - low, low)
    coedge = np.concatenate([ends.coedge, order[place]])
    column = np.concatenate([ends.column, joints.column[joint]])
    t = np.concatenate([ends.t, joints.t[joint]])
    node = np.concatenate([np.arange(len(ends)), len(ends) + joint])
    along = np.where(borders.coedge_reversed[coedge], -t, t)
    key = column * (int(borders.coedge_loops.max()) + 1) + borders.coedge_loops[coedge]
    order = np.lexsort((node, along, coedge, key))
    begin = find_begins(key[order])
    size = np.diff(np.append(begin, len(order)))
    start = order[begin]
    loop = borders.coedge_loops[coedge[start]]
    first_coedge = np.searchsorted(borders.coedge_loops, loop)
    at_end = borders.coedge_reversed[first_coedge].astype(np.intp)
    vertex = borders.edge_vertices[borders.coedge_edges[first_coedge], at_end]
    of_loop = column[start]
    # Whether the image is below after each change.
    is_end = node[order] < len(ends)
    total = np.cumsum(is_end)
    run = np.repeat(np.arange(len(begin)), size)
    odd = (total - total[begin][run] + is_end[begin][run]) % 2 == 1
    is_below = begins_below[loop, of_loop][run] ^ odd
    differs = begins_below[loop, of_loop] != sides.is_below[vertex, of_loop]
    # Changes 2 k and 2 k + 1 of a loop are linked, or 2 k + 1 and 2 k + 2.
    run, pair = expand_runs(size // 2)
    one = 2 * pair + differs[run]
    two = (one + 1) % size[run]
    first, last = begin[run] + one, begin[run] + two
    chosen = np.stack([order[first], order[last]])
    return Links(node[chosen], coedge[chosen], t[chosen], np.where(is_below[first], -1.0, 1.0))
