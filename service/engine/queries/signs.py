"""On which side of a closed surface points are.

A surface is closed if its patches pass along each edge as often in one direction as in the other:
then it winds round every point a whole number of times (`winding`), up to gaps as small as
rounding. Sides that are one point do not count.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.joining.join import join
from service.engine.mesh.seams import Seams
from service.engine.options import MeshOptions
from service.engine.queries.cells import CellTree
from service.engine.queries.nets import QueryNets
from service.engine.queries.winding import CHORDS, winding_numbers
from service.surface.lowered import PatchModel

LEFT = np.array([-1, 1, 1, -1])
"""+1 where, seen from the normal's tip, the patch is on the left of a side (`surface.sides`)."""

SAME_EDGE = 2.0**-40
"""How far sides that are one edge may be apart by their weights, in units of the diagonal."""


def signs(model: PatchModel, nets: QueryNets, x: FloatArray, low: FloatArray) -> FloatArray:
    """−1 inside, +1 outside; NaN where this is not known, as everywhere about an open surface.

    A point is inside where the winding number is not 0, whichever way the normals point.

    Parameters
    ----------
    nets : QueryNets
        Of the model.
    x : ndarray of float64, shape (m, 3)
        In the coordinates of these nets.
    low : ndarray of float64, shape (m,)
        Lower bounds of the distances from the surface, in the same.
    """
    joined, seams = join(model, MeshOptions().weld_tolerance)
    if not is_closed(seams):
        return np.full(len(x), np.nan)
    gap = (joined.moved + SAME_EDGE * model.diagonal) / nets.scale
    numbers = winding_numbers(CellTree(nets, CHORDS), x, low, gap)
    return np.where(np.isnan(numbers), np.nan, np.where(numbers != 0, -1.0, 1.0))


def is_closed(seams: Seams) -> bool:
    """Whether every edge is passed as often in one direction as in the other."""
    passages = np.where(seams.backward, -LEFT, LEFT)
    passages[seams.collapsed] = 0
    return not np.bincount(seams.edge.ravel(), passages.ravel()).any()
