"""Leaves whose polygons have too many corners, which are cut before they are triangulated.

A leaf may touch many small leaves, or a finely divided border, and then has a corner for each of
them. Its triangles would be narrow, and the surface over them would lie beside them.
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.adaptive.cutting.cells import Cells, Leaves
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.polygons.cell_boundaries import CellBoundaries

MOST_CORNERS = 64
"""A leaf with more corners is crowded."""

MANY, BENT = 7, 4
"""A leaf with at least `MANY` corners is crowded if the middle of one of its sides is further from
the chord of that side than `BENT` times the allowed deviation, as at the rim of a disc."""


def find_crowded(task: Task, leaves: Leaves, size: Ints) -> Ints:
    """Rows of the crowded leaves; `size` has the numbers of corners of the first leaves.

    Only leaves with a number of corners are examined.
    """
    many = (size >= MANY).nonzero()[0]
    if not len(many):
        return many
    # Corners, each with the middle of the side after it.
    u0, u1, v0, v1 = leaves.cells.box[:, many]
    u, v = (u0 + u1) // 2, (v0 + v1) // 2
    us, vs = np.array([u0, u, u1, u1, u1, u, u0, u0]), np.array([v0, v0, v0, v, v1, v1, v1, v])
    face = np.concatenate([leaves.cells.face[many]] * 8)
    points = task.evaluate_points(face, us.ravel(), vs.ravel()).reshape(8, -1, 3)
    away, along = points[1::2] - points[::2], points[[2, 4, 6, 0]] - points[::2]
    square = np.maximum((along * along).sum(axis=2), np.finfo(float).tiny)
    away -= ((away * along).sum(axis=2) / square)[..., np.newaxis] * along
    distance = np.sqrt((away * away).sum(axis=2)).max(axis=0)
    crowded: Ints = many[(distance > BENT * leaves.form[6, many]) | (size[many] > MOST_CORNERS)]
    return crowded


def find_crowded_directions(boundaries: CellBoundaries, cells: Cells, crowded: Ints) -> Bools:
    """Whether crowded leaves are to be cut across v, because more of their corners are along v."""
    along_v = np.empty(len(crowded), dtype=bool)
    for row, leaf in enumerate(crowded.tolist()):
        corner = boundaries.corner[boundaries.start[leaf] : boundaries.start[leaf + 1]]
        u, v, box = boundaries.u[corner], boundaries.v[corner], cells.box[:, leaf]
        on_u, on_v = np.isin(u, box[:2]).sum(), np.isin(v, box[2:]).sum()
        along_v[row] = on_u > on_v
    return along_v
