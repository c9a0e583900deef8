"""Makes control points that are equal up to rounding equal bit for bit.

In files of other systems, the first and the last row of a closed surface, or the sides of two
neighbours, may differ by rounding. Connectivity compares points bit for bit
(`service.engine.mesh.connectivity`), so such points are made equal before meshing:

- near points on the borders of patches form groups (`near_points`);
- sides whose points are in the same groups, in one direction or the other, are one edge, and get
  the points of that side whose net comes first in dictionary order;
- near weights of equal points become 1 if one of them is 1, as those of polynomial patches are,
  else the least of them; before, a common factor of each surface is divided out (`common_factors`);
- sides that are one curve in several degrees get the raised net of the lowest degree
  (`raised_edges`);
- corners, and sides that are one group, get the first point of their group in
  dictionary order;
- patches of which two opposite sides become one edge become curves (`thin_patches`).

So positions depend on the nets that meet and not on their order. Borders that are already equal do
not change.

Bound of the movement of the surface S = Σ b_i P_i, b_i = w_i B_i / Σ w_j B_j. New control points
move S by at most the largest distance d of an old from a new control point. New weights: if the
changes of all ln w_i lie in an interval of length h, each b_i changes by a factor between e^−h and
e^h. With M the middle of the box about the patch and D its diagonal, S − M = Σ b_i (P_i − M)
changes by at most (e^h − 1) D / 2.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import expm1

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.joining.common_factors import find_scales
from service.engine.joining.near_points import group_near_points, run_starts
from service.engine.joining.raised_edges import BorderWeights, raise_equal
from service.engine.joining.thin_patches import collapse_thin_patches
from service.engine.mesh.connectivity import EQUAL_WEIGHT
from service.engine.mesh.edge_patterns import (
    EdgePattern,
    border_points,
    border_weights,
    find_pattern,
    replace_border,
)
from service.engine.mesh.edges import orient_edges
from service.engine.mesh.equal_points import find_weight_tolerance, find_weld_distance
from service.surface.lowered import PatchModel

EQUAL_SCALED = 2.0**-47
"""Logarithms of weights that were divided by factors count as equal up to this difference."""

ROUNDED_UP = 1 + 2.0**-40
"""Factor that makes a computed bound an upper bound in spite of rounding."""


def snap(model: PatchModel, tolerance: float) -> PatchModel:
    """The model with near border points made equal; the same model if nothing moves.

    Parameters
    ----------
    tolerance : float
        Points are near if their distance is at most this share of the diagonal, or a little more
        (`service.engine.mesh.equal_points.find_weld_distance`).
    """
    checkpoint()
    runs = [border_points(batch) for batch in model.batches]
    border = np.concatenate(runs)
    distance = find_weld_distance(model, tolerance)
    group = group_near_points(border, distance)
    checkpoint()
    pattern = find_pattern(model.batches, group)
    points = _equal_nets(pattern, border, group)
    weights, changed = None, 0.0
    if any(batch.weights is not None for batch in model.batches):
        initial = np.concatenate([border_weights(batch) for batch in model.batches])
        near, logs = find_weight_tolerance(model, tolerance), np.log(initial)
        scale = find_scales(pattern, points, logs, _owners(model, runs), near)
        weights = BorderWeights(_equal_weights(initial, logs, scale, group, near), scale, near)
    if not pattern.is_certain:
        raise_equal(pattern, points, weights, distance)
    if weights is not None:
        change = np.log(weights.values / initial)
        changed = float(change.max(initial=0.0) - change.min(initial=0.0))
    distance_moved = float(np.sqrt(np.square(points - border).sum(axis=1).max()))
    distance_moved += expm1(changed) * model.largest_patch / 2
    batches, first = list(model.batches), 0
    for number, run in enumerate(runs if distance_moved else ()):
        run_rows = slice(first, first + len(run))
        batches[number] = replace_border(
            batches[number], points[run_rows], None if weights is None else weights.values[run_rows]
        )
        first += len(run)
    if pattern.connectivity.has_thin:
        near = 0.0 if weights is None else weights.near
        batches, flattened = collapse_thin_patches(batches, pattern.connectivity, distance, near)
        distance_moved += flattened
    if not distance_moved:
        return model
    return replace(model, batches=tuple(batches), moved=model.moved + distance_moved * ROUNDED_UP)


def _equal_nets(pattern: EdgePattern, border: FloatArray, group: Ints) -> FloatArray:
    """Border points (B, 3) that are equal along equal edges, and at equal corners and poles.

    `group` (B,) is the number of each point's group of near points.
    """
    points, first = border.copy(), _find_first_points(border, group)
    for rows, edge in pattern.sides:
        _equal_inner_points(points, border, rows, edge)
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
    least = rows[run_starts(group[rows])] if len(rows) else rows
    first[group[least]] = least
    return first


def _equal_inner_points(points: FloatArray, border: FloatArray, rows: Ints, edge: Ints) -> None:
    """Write the inner points of each edge's first net, in dictionary order, to all of its sides.

    `rows` (S, n+1) are the border points of sides, and `edge` (S,) their edges. Only edges whose
    sides differ are sorted.
    """
    nets = border[rows]
    leader = np.empty(int(edge.max(initial=-1)) + 1, dtype=np.intp)
    leader[edge] = np.arange(len(edge))
    unequal = np.zeros(len(leader), dtype=bool)
    unequal[edge[(nets != nets[leader[edge]]).any(axis=(1, 2))]] = True
    chosen = unequal[edge].nonzero()[0]
    if not len(chosen):
        return
    rows, edge = rows[chosen], edge[chosen]
    oriented, _, _ = orient_edges(nets[chosen], None)
    order = np.lexsort((*oriented.reshape(len(oriented), -1).T[::-1], edge))
    order = order[run_starts(edge[order])]
    leader[edge[order]] = order
    points[rows[:, 1:-1]] = border[rows[leader[edge], 1:-1]]


def _owners(model: PatchModel, runs: Sequence[FloatArray]) -> Ints:
    """The surface of each border point (B,); surfaces are numbered in the order of their patches.

    Without domains each patch is a surface.
    """
    patches = np.arange(model.patch_count)
    if model.domains:
        first = np.sort([domain.first for domain in model.domains])
        patches = np.searchsorted(first, patches, side="right") - 1
    sizes = [len(run) // batch.count for run, batch in zip(runs, model.batches, strict=True)]
    return np.repeat(patches, np.repeat(sizes, [batch.count for batch in model.batches]))


def _equal_weights(
    weights: FloatArray, logs: FloatArray, scale: FloatArray | None, group: Ints, tolerance: float
) -> FloatArray:
    """Weights (B,), where near weights at points of one group are made equal.

    A run of weights of which each is near the next one becomes 1 if one of them is 1, as those of
    polynomial patches are, else the least of them; runs wider than the tolerance stay. Differences
    of a few roundings stay too, because `seams` ignores them. With a `scale` (B,), weights divided
    by e^scale are compared. If several are least, the least before the division is taken, so that
    the order of the patches has no effect.
    """
    size = logs if scale is None else logs - scale
    order = np.lexsort((logs, size, group))
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (np.diff(group[order]) > 0) | (np.diff(size[order]) > tolerance)
    starts = np.flatnonzero(begins)
    counts = np.diff(starts, append=len(order))
    width = size[order[starts + counts - 1]] - size[order[starts]]
    least = EQUAL_WEIGHT if scale is None else EQUAL_SCALED
    chosen = np.repeat((width > least) & (width <= tolerance), counts)
    leads, is_one = starts.copy(), np.flatnonzero(size[order] == 0)
    leads[np.cumsum(begins)[is_one] - 1] = is_one
    rows, lead = order[chosen], np.repeat(order[leads], counts)[chosen]
    equal = weights.copy()
    equal[rows] = weights[lead]
    if scale is not None:
        equal[rows] *= np.exp(scale[rows] - scale[lead])
    return equal
