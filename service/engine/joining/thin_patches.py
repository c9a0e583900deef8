"""Patches that are no wider than the distance within which points are one: they become curves.

A knot span about as short as that distance lowers to thin patches. Once near points are equal
(`service.engine.joining.snap`), the control points of their two long sides are equal in pairs: both
sides are one edge, and the neighbours across the patch meet there. So all lines of the net get the
control points of one side, and its weights. Meshes leave such a patch out
(`service.engine.mesh.curve_patches`).

Let d be the largest distance by which a control point moves. The weights of line j are λ_j w_i e^η
with the weights w_i of the side, some factor λ_j and |η| ≤ h. If η were 0 the lines, with their
points moved, would be one rational curve, whatever their factors, and the patch would be that
curve. So no point of the patch is further from the curve than d + (e^2h − 1) D / 2, with D the
diagonal of the box about the patch (the proof is that of `service.engine.joining.snap`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.engine.mesh.connectivity import Connectivity
from service.engine.mesh.curve_patches import find_thin
from service.surface.batches import Patches, TensorPatches

WIDTH = 2.0
"""Largest distance of control points from the side, in units of the reach, and of logarithms of
weights, in units of theirs. Points of one edge are at most one reach apart; those between two sides
of a knot span are between the sides, up to rounding."""


def flatten(
    batches: Sequence[Patches], connectivity: Connectivity, reach: float, weight_reach: float
) -> tuple[list[Patches], float]:
    """The batches with thin patches as curves, and a bound of how far any point moved.

    Parameters
    ----------
    connectivity : Connectivity
        Its sides that are one edge have equal control points, bit for bit.
    reach, weight_reach : float
        Points, and logarithms of weights, at most this far apart are one.
    """
    flat, furthest = list(batches), 0.0
    for which, axis, rows in find_thin(batches, connectivity):
        batch = flat[which]
        assert isinstance(batch, TensorPatches)
        nets = batch.points[rows]
        line = np.take(nets, [0], axis=1 + axis)
        apart = np.sqrt(np.square(nets - line).sum(axis=3)).max(axis=(1, 2))
        is_thin = apart <= WIDTH * reach
        points, weights = batch.points.copy(), batch.weights
        bound = apart
        if batch.weights is not None:
            own = batch.weights[rows]
            side = np.take(own, [0], axis=1 + axis)
            ratio = np.log(own / side)
            ratio -= np.take(ratio, [0], axis=2 - axis)
            change = np.abs(ratio).max(axis=(1, 2))
            is_thin &= change <= WIDTH * weight_reach
            box = np.linalg.norm(np.ptp(nets, axis=(1, 2)), axis=1)
            bound = apart + np.expm1(2 * change) * box / 2
            weights = batch.weights.copy()
            weights[rows[is_thin]] = side[is_thin]
        points[rows[is_thin]] = line[is_thin]
        flat[which] = replace(batch, points=points, weights=weights)
        furthest = max(furthest, float(bound[is_thin].max(initial=0.0)))
    return flat, furthest
