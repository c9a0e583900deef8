"""Corners that lie on open edges, and not at their ends.

A corner c is on the curve B at the parameter t that Gauss–Newton steps
t ← t − (B(t) − c) · B' / B' · B' find from the nearest of some samples.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.joining.near_points import run_starts
from service.engine.joining.open_edges import OpenBorder, OpenEdges, iterate_degrees
from service.engine.mesh.edges import EdgeCurves

STEPS = 12
"""Number of Gauss–Newton steps; each step doubles the number of correct digits."""

MAX_PAIRS = 1 << 22
"""The most pairs of an edge and a corner in its box; a model with more pairs stays unchanged."""

FEW_PAIRS = 1 << 14
"""Up to this number, all pairs of an edge and a corner are compared in one array operation."""

DIRECTIONS = np.array(
    [
        *((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)),
        *((1.0, 1, 0), (1.0, -1, 0), (1.0, 0, 1), (1.0, 0, -1), (0, 1.0, 1), (0, 1.0, -1)),
        *((1.0, 1, 1), (1.0, 1, -1), (1.0, -1, 1), (1.0, -1, -1)),
    ]
)
"""The axes, and the diagonals between two of them and between all: bounds along these directions
are tight."""

CHUNK = 1 << 18
"""Numbers in one chunk, roughly."""

APART = 64.0
"""A corner that is nearer to an end of an edge, in units of the reach, does not cut it."""

MAX_SLACK = 1e-6
"""Largest difference of parameters that count as equal."""


def find_corners_on_edges(borders: Sequence[OpenBorder], reach: float) -> Ints:
    """Pairs (n, 2) of borders: a corner of the second is on an edge of the first.

    No pairs if more than `MAX_PAIRS` edges and corners would have to be compared.
    """
    edge_ends = np.cumsum([0, *(len(border.begin) for border in borders)])
    corner_ends = np.cumsum([0, *(len(border.corners) for border in borders)])
    forms: dict[tuple[int, bool], list[EdgeCurves]] = {}
    begin, end = [], []
    for border, first, before in zip(borders, edge_ends, corner_ends, strict=False):
        begin.append(border.begin + before)
        end.append(border.end + before)
        for curve in border.curves:
            form = curve.points.shape[1], curve.weights is None
            forms.setdefault(form, []).append(replace(curve, ids=curve.ids + first))
    number = np.arange(edge_ends[-1])
    edges = OpenEdges(
        tuple(_join_curves(curves) for curves in forms.values()),
        *(number, number, np.concatenate(begin), np.concatenate(end)),
        np.concatenate([border.corners for border in borders]),
    )
    edge, corner = find_corner_candidates(edges, reach)
    owners = [np.searchsorted(edge_ends, edge, side="right") - 1]
    owners.append(np.searchsorted(corner_ends, corner, side="right") - 1)
    pairs: Ints = np.stack(owners, axis=1)
    are_distinct = owners[0] != owners[1]
    edge, corner, pairs = edge[are_distinct], corner[are_distinct], pairs[are_distinct]
    if not 0 < len(edge) <= MAX_PAIRS:
        return pairs[:0]
    _, _, is_on = place_corners(edges, edge, edges.corners[corner], reach)
    pairs = pairs[is_on]
    return pairs


def _join_curves(curves: Sequence[EdgeCurves]) -> EdgeCurves:
    """Curves of one degree, all rational or all polynomial, joined to one value."""
    weights = [curve.weights for curve in curves if curve.weights is not None]
    return EdgeCurves(
        np.concatenate([curve.ids for curve in curves]),
        np.concatenate([curve.points for curve in curves]),
        np.concatenate(weights) if weights else None,
    )


def find_corner_candidates(edges: OpenEdges, reach: float) -> tuple[Ints, Ints]:
    """Pairs of an open edge and of a corner of others that is between the bounds of its net."""
    count = len(edges.side)
    low, high = np.empty((count, len(DIRECTIONS))), np.empty((count, len(DIRECTIONS)))
    for group, rows, number in iterate_degrees(edges):
        along = group.points[rows] @ DIRECTIONS.T
        low[number], high[number] = along.min(axis=1), along.max(axis=1)
    margin = 2 * reach + 2.0**-48 * float(np.abs(low).max() + np.abs(high).max())
    low -= margin
    high += margin
    corners = np.unique(np.concatenate([edges.begin, edges.end]))
    along = edges.corners[corners] @ DIRECTIONS.T
    if count * len(corners) <= FEW_PAIRS:
        inside = ((along >= low[:, None]) & (along <= high[:, None])).all(axis=2)
        inside &= (corners != edges.begin[:, None]) & (corners != edges.end[:, None])
        edge, place = inside.nonzero()
        return edge, corners[place]
    axis = int(np.ptp(along[:, :3], axis=0).argmax())
    order = np.argsort(along[:, axis], kind="stable")
    corners, along = corners[order], along[order]
    first = np.searchsorted(along[:, axis], low[:, axis])
    last = np.searchsorted(along[:, axis], high[:, axis], side="right")
    if (last - first).sum() > 16 * MAX_PAIRS:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    pairs = []
    for run in _split_by_count(last - first, CHUNK):
        counts = (last - first)[run]
        edge = np.repeat(np.arange(run.start, run.stop), counts)
        place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        place += np.repeat(first[run], counts)
        inside = (corners[place] != edges.begin[edge]) & (corners[place] != edges.end[edge])
        for k in range(len(DIRECTIONS)):
            edge, place = edge[inside], place[inside]
            inside = (along[place, k] >= low[edge, k]) & (along[place, k] <= high[edge, k])
        pairs.append((edge[inside], corners[place[inside]]))
        checkpoint()
    return np.concatenate([e for e, _ in pairs]), np.concatenate([c for _, c in pairs])


def _split_by_count(counts: Ints, most: int) -> Iterator[slice]:
    """Slices of consecutive items whose counts add up to approximately `most`."""
    group = np.cumsum(counts) // most
    starts = run_starts(group)
    for start, stop in zip(starts.tolist(), [*starts[1:].tolist(), len(counts)], strict=True):
        yield slice(start, stop)


def place_corners(
    edges: OpenEdges, edge: Ints, points: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray, Bools]:
    """Parameters nearest to points (K, 3), their slack, and whether each point is on its edge."""
    at, slack = np.zeros(len(edge)), np.zeros(len(edge))
    is_on = np.zeros(len(edge), dtype=bool)
    for group, rows, number in iterate_degrees(edges):
        row_of_edge = np.full(len(edges.side), -1)
        row_of_edge[number] = rows
        rows_of_degree = np.flatnonzero(row_of_edge[edge] >= 0)
        degree = group.points.shape[1] - 1
        samples = np.linspace(0, 1, 8 * degree + 1)
        for part in row_slices(len(rows_of_degree), 3 * len(samples), CHUNK):
            pairs = rows_of_degree[part]
            curve, target = row_of_edge[edge[pairs]], points[pairs]
            nets = group.points[curve] - target[:, None]
            weights = None if group.weights is None else group.weights[curve]
            squares = np.square(points_at(nets, weights, samples)).sum(axis=2)
            if weights is None:
                # The largest distance of the curve from the nearest sample: half of a step along
                # the net.
                speed = degree * np.sqrt(np.square(np.diff(nets, axis=1)).sum(axis=2).max(axis=1))
                close = np.sqrt(squares.min(axis=1)) <= speed * (samples[1] / 2) + reach
                pairs, nets, squares = pairs[close], nets[close], squares[close]
                if not len(pairs):
                    continue
            t = samples[squares.argmin(axis=1)]
            for _ in range(STEPS):
                value, slope = _evaluate_with_slope(nets, weights, t)
                square = np.square(slope).sum(axis=1)
                step = (value * slope).sum(axis=1) / np.where(square > 0, square, 1.0)
                t = (t - step).clip(0, 1)
            value, slope = _evaluate_with_slope(nets, weights, t)
            is_near = np.square(value).sum(axis=1) <= reach**2
            ends = np.minimum(np.square(nets[:, 0]).sum(axis=1), np.square(nets[:, -1]).sum(axis=1))
            at[pairs], is_on[pairs] = t, is_near & (ends > (APART * reach) ** 2) & (t > 0) & (t < 1)
            speed = np.sqrt(np.square(slope).sum(axis=1))
            slack[pairs] = np.minimum(4 * reach / np.maximum(speed, reach), MAX_SLACK)
    return at, slack, is_on


def points_at(nets: FloatArray, weights: FloatArray | None, places: FloatArray) -> FloatArray:
    """Points (m, K, 3) of curves (m, n+1, 3) at parameters (K,), or (m, K) for each curve."""
    degree = nets.shape[1] - 1
    basis = bernstein(degree, places.ravel()).reshape(*places.shape, degree + 1)
    if weights is None:
        value: FloatArray = basis @ nets
        return value
    shares = basis * weights[:, None]
    value = shares @ nets
    value /= shares.sum(axis=2, keepdims=True)
    return value


def _evaluate_with_slope(
    nets: FloatArray, weights: FloatArray | None, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points and derivatives (m, 3) of curves (m, n+1, 3): curve k at parameter `t[k]`."""
    degree = nets.shape[1] - 1
    basis, below = bernstein(degree, t)[:, None], bernstein(degree - 1, t)[:, None]
    if weights is None:
        return (basis @ nets)[:, 0], degree * (below @ np.diff(nets, axis=1))[:, 0]
    weighted = nets * weights[..., None]
    total, change = (basis @ weights[..., None])[:, 0], degree * np.diff(weights, axis=1)
    value = (basis @ weighted)[:, 0] / total
    slope = degree * (below @ np.diff(weighted, axis=1))[:, 0]
    return value, (slope - (below @ change[..., None])[:, 0] * value) / total
