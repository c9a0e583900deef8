"""Whether patches enclose a volume, which edges are the reason if they do not, and open loops.

Each side of a patch is passed once when its border is run through with the patch on the left. An
edge is balanced if it is passed as often in one direction as in the other: then, whatever vector
field is chosen, what the patches add to its boundary cancels. Patches all of whose edges are
balanced enclose a volume, as Gauss's theorem has it: a point counts as often as they wind round
it. Sides that are one point, or lead back the way they came, have no say.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.mesh.seams import Seams
from service.surface.sides import BEGINS, ENDS

LEFT = np.array([-1, 1, 1, -1])
"""Whether each side, upwards, has its patch on the left: +1."""


@dataclass(frozen=True, eq=False, slots=True)
class DirectedEdges:
    """The sides of P patches as passages along edges.

    Attributes
    ----------
    edge : ndarray of int, shape (P, 4)
        Number of the edge of each side.
    passage : ndarray of int, shape (P, 4)
        +1 along the direction of the edge, −1 against it, 0 of sides that do not count.
    is_open : ndarray of bool, shape (P, 4)
        Whether no other side is the same edge.
    """

    edge: Ints
    passage: Ints
    is_open: Bools

    def unbalanced(self, patches: Bools) -> Bools:
        """Which sides, (P, 4), of some patches (P,) lie on edges that these do not balance."""
        passage = np.where(patches[:, np.newaxis], self.passage, 0)
        sums = np.zeros(int(self.edge.max()) + 1, np.intp)
        np.add.at(sums, self.edge.ravel(), passage.ravel())
        return np.asarray((sums[self.edge] != 0) & (passage != 0))

    def balanced_parts(self, part: Ints, count: int) -> Bools:
        """Which of `count` parts, that patches (P,) belong to, are balanced by themselves."""
        edges = int(self.edge.max()) + 1
        keys = part[:, np.newaxis] * edges + self.edge
        distinct, number = np.unique(keys, return_inverse=True)
        sums = np.zeros(len(distinct), np.intp)
        np.add.at(sums, number.ravel(), self.passage.ravel())
        closed = np.ones(count, dtype=bool)
        closed[distinct[sums != 0] // edges] = False
        closed[np.setdiff1d(np.arange(count), part)] = False
        return closed


def direct_edges(seams: Seams) -> DirectedEdges:
    """The passages of all sides."""
    passage = np.where(seams.backward, -1, 1) * LEFT
    passage[seams.collapsed] = 0
    for group in seams.curves:
        returns = (group.points == group.points[:, ::-1]).all(axis=(1, 2))
        if group.weights is not None:
            returns &= (group.weights == group.weights[:, ::-1]).all(axis=1)
        if returns.any():
            passage[np.isin(seams.edge, group.ids[returns])] = 0
    users = np.zeros(len(seams.users), np.intp)
    np.add.at(users, seams.edge[passage != 0], 1)
    return DirectedEdges(seams.edge, passage, (users[seams.edge] == 1) & (passage != 0))


@dataclass(frozen=True, slots=True)
class Loop:
    """Sides (patch · 4 + side) in a row; closed if the last ends where the first begins."""

    sides: tuple[int, ...]
    is_closed: bool


def open_loops(seams: Seams, edges: DirectedEdges) -> list[Loop]:
    """The open sides as chains, each with its patches on the left.

    They are in the order of their first sides. Where several open sides begin at a corner, the
    chain goes on with the first of those that are left.
    """
    sides = np.flatnonzero(edges.is_open.ravel())
    begins, ends = (seams.corner[:, which].ravel()[sides] for which in (BEGINS, ENDS))
    against = np.tile(LEFT < 0, len(seams.edge))[sides]
    begins, ends = np.where(against, ends, begins), np.where(against, begins, ends)
    after: dict[int, list[int]] = {}
    for k in range(len(sides) - 1, -1, -1):
        after.setdefault(int(begins[k]), []).append(k)
    entered = set(ends.tolist())
    left = np.ones(len(sides), dtype=bool)
    found = []
    # Chains that nothing leads to are begun first, else they would be cut in two.
    starts = [k for k, at in enumerate(begins.tolist()) if at not in entered]
    for start in (*starts, *range(len(sides))):
        if not left[start]:
            continue
        chain, k = [], start
        while True:
            left[k] = False
            chain.append(int(sides[k]))
            if ends[k] == begins[start]:
                break
            following = after.get(int(ends[k]), [])
            while following and not left[following[-1]]:
                following.pop()
            if not following:
                break
            k = following[-1]
        found.append(Loop(tuple(chain), bool(ends[k] == begins[start])))
    return sorted(found, key=lambda loop: loop.sides[0])
