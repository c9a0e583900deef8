"""Decides which points are inside a closed surface.

A surface is closed if its patches pass along each edge equally often in both directions
(`service.engine.connectivity.orientation`). Then its winding number about every point is an integer
(`winding`), except for gaps of the size of rounding.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.cells.chord_models import CHORDS
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.connectivity.orientation import orient_sides
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import allow_any, join_further
from service.engine.nets.query_nets import QueryNets
from service.engine.options import MeshOptions
from service.engine.signs.winding import compute_winding_numbers
from service.surface.lowered import PatchModel

WELD_TOLERANCE = MeshOptions().weld_tolerance
"""Patches are joined with the default tolerance of meshes."""

SAME_EDGE = 2.0**-40
"""Two sides may count as one edge although their weights differ by rounding. Their distance is at
most this share of the diagonal."""

LIMITS = WorkLimits(pairs=20_000_000, of_item=1 << 14)
"""After this number of pairs in a request, which takes 20 to 35 s, no further points are begun;
their winding numbers are uncertain. So is that of a point with too many pairs on one level."""


def compute_signs(
    model: PatchModel,
    seams: Seams | None,
    nets: QueryNets,
    x: FloatArray,
    low: FloatArray,
    *,
    limits: WorkLimits = LIMITS,
) -> FloatArray:
    """Compute the signs (m,) of points: −1 inside, +1 outside, NaN if this is uncertain.

    A point is inside if the winding number is not 0, so the direction of the normals does not
    matter. If the surface is open, all signs are NaN.

    Parameters
    ----------
    seams : Seams or None
        Seams of the model, from `connect_if_apart`. None if points on borders may be nearly, but
        not exactly equal; they are then made equal first.
    nets : QueryNets
        Nets of the model.
    x : ndarray of float64, shape (m, 3)
        The points, in the coordinates of the nets.
    low : ndarray of float64, shape (m,)
        Lower bounds of their distances from the surface, in the coordinates of the nets.
    limits : WorkLimits
    """
    # Borders that are equal up to rounding, or up to knots and degree, are edges, as in a mesh.
    # `allow_any`: the joined model may have any size.
    joined, seams = join_further(model, seams, WELD_TOLERANCE, allow_any)
    if not orient_sides(seams).is_closed:
        return np.full(len(x), np.nan)
    gap = (joined.moved + SAME_EDGE * model.diagonal) / nets.scale
    numbers = compute_winding_numbers(CellTree(nets, limits, CHORDS), x, low, gap)
    return np.where(np.isnan(numbers), np.nan, np.where(numbers != 0, -1.0, 1.0))
