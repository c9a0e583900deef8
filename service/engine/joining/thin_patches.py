"""Replaces thin patches by curves: patches about as narrow as the distance of equal points.

A knot span about as short as this distance lowers to thin patches. Narrow triangles are thin, too.
After near points were made equal (`service.engine.joining.snap`), the control points of the two
long sides are equal in pairs: both sides are one edge, where the two neighbours of the patch meet.
So on each line of control points from side to side, all control points and weights become those of
one side. Meshes omit these patches (`service.engine.connectivity.curve_patches`).

If each control point moves by at most d, and the changes of all logarithms of weights lie in an
interval of length h, no point of the patch is further from the curve than d + (e^h − 1) D / 2,
where D is the diagonal of the box about the control points. `service.engine.joining.snap` has the
proof.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.engine.connectivity.connectivity import Connectivity
from service.engine.connectivity.curve_patches import find_thin, flatten_nets
from service.surface.batches import Patches

WIDTH = 2.0
"""The largest distance of control points from the side, in units of `distance`, and the largest
difference of logarithms of weights, in units of `weight_tolerance`. Points of one edge are at most
1 unit apart, and points between two sides of a knot span lie between the sides, up to rounding."""


def collapse_thin_patches(
    batches: Sequence[Patches], connectivity: Connectivity, distance: float, weight_tolerance: float
) -> tuple[list[Patches], float]:
    """The batches with thin patches as curves, and a bound of the distance that any point moved.

    Parameters
    ----------
    connectivity : Connectivity
        Sides that are one edge of it must have equal control points, bit for bit.
    distance, weight_tolerance : float
        Points, and logarithms of weights, at most this far apart count as equal.
    """
    new_batches, max_distance = list(batches), 0.0
    # `rows` are patches whose long sides are one edge. For each control point of a net, `line` has
    # the control point on a long side that is on the same line from side to side.
    for batch_number, rows, line in find_thin(batches, connectivity):
        batch = new_batches[batch_number]
        nets, net_weights = flatten_nets(batch, rows)
        points, weights = batch.points.copy(), batch.weights
        bound = np.sqrt(np.square(nets - nets[:, line]).sum(axis=2)).max(axis=1)
        is_thin = bound <= WIDTH * distance
        if net_weights is not None and weights is not None:
            change = np.ptp(np.log(net_weights / net_weights[:, line]), axis=1)
            is_thin &= change <= WIDTH * weight_tolerance
            bound += np.expm1(change) * np.linalg.norm(np.ptp(nets, axis=1), axis=1) / 2
            weights = weights.copy()
            weights.reshape(batch.count, -1)[rows[is_thin]] = net_weights[is_thin][:, line]
        points.reshape(batch.count, -1, 3)[rows[is_thin]] = nets[is_thin][:, line]
        new_batches[batch_number] = replace(batch, points=points, weights=weights)
        max_distance = max(max_distance, float(bound[is_thin].max(initial=0.0)))
    return new_batches, max_distance
