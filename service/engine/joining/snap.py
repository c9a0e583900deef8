"""Makes control points that are equal up to rounding equal bit for bit.

In files of other systems, the first and the last row of a closed surface, or the sides of two
neighbours, may differ by rounding. Connectivity compares points bit for bit
(`service.engine.connectivity.incidence`), so such points are made equal before meshing:

- near points on the borders of patches form groups (`near_points`);
- two sides are one edge if the points of both, in equal or opposite order, are in the same groups;
  all sides of an edge get the points of the side whose net comes first in dictionary order;
- if the weights of equal points are nearly equal, all of them become 1 if one of them is 1 (as in
  polynomial patches), else the least of them; before the comparison, weights are divided by a
  common factor of each surface (`common_factors`);
- sides that are one curve in several degrees get the raised net of the lowest degree
  (`raised_edges`);
- corners, and sides whose points are all in one group, get the first point of their group in
  dictionary order;
- a patch about as narrow as the distance of near points becomes a curve if two of its opposite
  sides become one edge (`collapse_thin_patches`).

So positions depend on the nets that meet and not on their order. Borders that are already equal do
not change.

If no control point moves by more than d, and the changes of all logarithms of weights lie in an
interval of length h, no point of a patch moves by more than d + (e^h − 1) D / 2, where D is the
diagonal of the box about the control points.

Proof in docs/proofs.md: "Moved control points".
"""

from collections.abc import Sequence
from dataclasses import replace
from math import expm1

import numpy as np

from service.bases.arrays import AnyInts, FloatArray, Ints
from service.bases.row_batches import count_runs
from service.cancellation import checkpoint
from service.engine.connectivity.curve_patches import collapse_thin_patches
from service.engine.connectivity.edge_patterns import (
    EdgePattern,
    border_points,
    border_weights,
    find_pattern,
    replace_border,
)
from service.engine.connectivity.edges import orient_edges
from service.engine.connectivity.equal_points import find_weight_tolerance, find_weld_distance
from service.engine.connectivity.incidence import EQUAL_WEIGHT
from service.engine.joining.common_factors import find_scales
from service.engine.joining.near_points import group_near_points, run_starts
from service.engine.joining.raised_edges import BorderWeights, replace_by_raised_nets
from service.engine.vectors import length
from service.surface.lowered import PatchModel

EQUAL_SCALED_LOGS = 2.0**-47
"""The largest difference of the logarithms of two weights that count as equal after both were
divided by common factors."""

SAFE = 1 + 2.0**-40
"""The factor that makes a computed bound an upper bound in spite of rounding."""


def snap(model: PatchModel, tolerance: float) -> PatchModel:
    """The model with near border points made equal; the same model if nothing moves.

    Parameters
    ----------
    tolerance : float
        `MeshOptions.weld_tolerance`; points are near if their distance is at most the result of
        `find_weld_distance`.
    """
    checkpoint()
    runs = [border_points(batch) for batch in model.batches]
    border = np.concatenate(runs)
    distance = find_weld_distance(model, tolerance)
    group = group_near_points(border, distance)
    checkpoint()
    pattern = find_pattern(model.batches, group)
    points = _make_points_equal(pattern, border, group)
    weights, weight_change = None, 0.0
    if any(batch.weights is not None for batch in model.batches):
        old_weights = np.concatenate([border_weights(batch) for batch in model.batches])
        weight_tolerance, logs = find_weight_tolerance(model, tolerance), np.log(old_weights)
        scale = find_scales(pattern, points, logs, _find_surfaces(model, runs), weight_tolerance)
        weights = BorderWeights(
            _make_weights_equal(old_weights, logs, scale, group, weight_tolerance),
            scale,
            weight_tolerance,
        )
    if not pattern.is_certain:  # edges of several degrees may be one curve
        replace_by_raised_nets(pattern, points, weights, distance)
    if weights is not None:
        change = np.log(weights.values / old_weights)
        weight_change = float(change.max(initial=0.0) - change.min(initial=0.0))
    distance_moved = float(length(points - border, -1).max())
    distance_moved += expm1(weight_change) * model.largest_patch / 2
    batches, first = list(model.batches), 0
    for number, run in enumerate(runs if distance_moved else ()):
        border_rows = slice(first, first + len(run))
        batches[number] = replace_border(
            batches[number],
            points[border_rows],
            None if weights is None else weights.values[border_rows],
        )
        first += len(run)
    if pattern.connectivity.has_thin:
        weight_tolerance = 0.0 if weights is None else weights.log_tolerance
        batches, flattened = collapse_thin_patches(
            batches, pattern.connectivity, distance, weight_tolerance
        )
        distance_moved += flattened
    if not distance_moved:
        return model
    return replace(model, batches=tuple(batches), moved=model.moved + distance_moved * SAFE)


def _make_points_equal(pattern: EdgePattern, border: FloatArray, group: Ints) -> FloatArray:
    """New border points (B, 3): sides of one edge, one corner or one pole get equal points.

    `group` (B,) is the number of each point's group of near points.
    """
    points, first = border.copy(), _find_first_points(border, group)
    for rows, edge in pattern.sides:
        _make_inner_points_equal(points, border, rows, edge)
        groups = group[rows]
        is_point = (groups == groups[:, :1]).all(axis=1)
        points[rows[is_point]] = border[first[groups[is_point]]]
        points[rows[:, [0, -1]]] = border[first[groups[:, [0, -1]]]]
    return points


def _find_first_points(border: FloatArray, group: Ints) -> Ints:
    """For the number of each group (B,) the row of its first point in dictionary order.

    Only the points of groups that have unequal points are sorted.
    """
    first = np.arange(len(border))
    is_mixed = np.zeros(len(border), dtype=bool)
    is_mixed[group[(border != border[group]).any(axis=1)]] = True
    rows = is_mixed[group].nonzero()[0]
    x, y, z = border[rows].T
    rows = rows[np.lexsort((z, y, x, group[rows]))]
    first_rows = rows[run_starts(group[rows])] if len(rows) else rows
    first[group[first_rows]] = first_rows
    return first


def _make_inner_points_equal(
    points: FloatArray, border: FloatArray, rows: AnyInts, edge: AnyInts
) -> None:
    """Write the inner points of each edge's first net, in dictionary order, to all of its sides.

    `rows` (S, n+1) are the border points of sides, and `edge` (S,) their edges. Only edges whose
    sides differ are sorted.
    """
    nets = border[rows]
    # First any side of each edge, to find edges with unequal sides; then the first in order.
    leader = np.empty(int(edge.max(initial=0)) + 1, dtype=np.intp)
    leader[edge] = np.arange(len(edge))
    is_unequal = np.zeros(len(leader), dtype=bool)
    is_unequal[edge[(nets != nets[leader[edge]]).any(axis=(1, 2))]] = True
    is_changed = is_unequal[edge].nonzero()[0]
    if not len(is_changed):
        return
    rows, edge = rows[is_changed], edge[is_changed]
    # The order of nets must not depend on the direction of their edge.
    oriented, _, _ = orient_edges(nets[is_changed], None)
    order = np.lexsort((*oriented.reshape(len(oriented), -1).T[::-1], edge))
    order = order[run_starts(edge[order])]
    leader[edge[order]] = order
    points[rows[:, 1:-1]] = border[rows[leader[edge], 1:-1]]


def _find_surfaces(model: PatchModel, runs: Sequence[FloatArray]) -> Ints:
    """The surface of each border point (B,); surfaces are numbered in the order of their patches.

    In a model without domains, each patch is a surface.
    """
    patches = np.arange(model.patch_count)
    if model.domains:
        first = np.sort([domain.first for domain in model.domains])
        patches = np.searchsorted(first, patches, side="right") - 1
    sizes = [len(run) // batch.count for run, batch in zip(runs, model.batches, strict=True)]
    return np.repeat(patches, np.repeat(sizes, [batch.count for batch in model.batches]))


def _make_weights_equal(
    weights: FloatArray, logs: FloatArray, scale: FloatArray | None, group: Ints, tolerance: float
) -> FloatArray:
    """New weights (B,): nearly equal weights at the points of one group become equal.

    The weights of each group are sorted. In a run, each weight is near the next weight. A run no
    wider than the tolerance becomes 1 if one of its weights is 1 (as in polynomial patches), else
    the least of its weights. Differences of a few roundings stay, because `seams` ignores them.

    With a `scale` (B,), weights divided by e^scale are compared. If two of these are equally small,
    the one with the smaller weight before the division counts as the least, so that the order of
    the patches has no effect.
    """
    logs_to_compare = logs if scale is None else logs - scale
    order = np.lexsort((logs, logs_to_compare, group))
    is_run_start = np.ones(len(order), dtype=bool)
    is_run_start[1:] = (np.diff(group[order]) > 0) | (np.diff(logs_to_compare[order]) > tolerance)
    starts = np.flatnonzero(is_run_start)
    counts = count_runs(starts, len(order))
    width = logs_to_compare[order[starts + counts - 1]] - logs_to_compare[order[starts]]
    min_width = EQUAL_WEIGHT if scale is None else EQUAL_SCALED_LOGS
    is_changed = np.repeat((width > min_width) & (width <= tolerance), counts)
    leaders, is_one = starts.copy(), np.flatnonzero(logs_to_compare[order] == 0)
    leaders[np.cumsum(is_run_start)[is_one] - 1] = is_one
    rows, leader = order[is_changed], np.repeat(order[leaders], counts)[is_changed]
    new_weights = weights.copy()
    new_weights[rows] = weights[leader]
    if scale is not None:
        new_weights[rows] *= np.exp(scale[rows] - scale[leader])
    return new_weights
