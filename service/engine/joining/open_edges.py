"""The open edges of models, each on one patch only; and corners that lie on them, not at ends.

For a corner c and the curve B of an edge, Gauss–Newton steps t ← t − (B(t) − c) · B' / B' · B' lead
from the nearest of some samples to the nearest parameter t. The corner is on the edge if B(t) is at
most `radius`, in model units, from c.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import expand_runs, row_slices, split_runs
from service.cancellation import checkpoint
from service.engine.connectivity.edges import EdgeCurves
from service.engine.connectivity.seams import Seams
from service.engine.vectors import length

STEPS = 12
"""Gauss–Newton steps for each corner; near the solution, each step doubles the correct digits."""

MAX_PAIRS = 1 << 22
"""The most pairs of an edge and a corner within its bounds; a model with more pairs is not cut."""

FEW_PAIRS = 1 << 14
"""Up to this number of pairs of an edge and a corner, one array operation compares all pairs."""

DIRECTIONS = np.array(
    [
        *((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)),
        *((1.0, 1, 0), (1.0, -1, 0), (1.0, 0, 1), (1.0, 0, -1), (0, 1.0, 1), (0, 1.0, -1)),
        *((1.0, 1, 1), (1.0, 1, -1), (1.0, -1, 1), (1.0, -1, -1)),
    ]
)
"""The directions along which edges are bounded: the axes, the diagonals between two axes, and the
diagonals between all three. Bounds along the axes alone would be looser."""

CHUNK = 1 << 18
"""The approximate count of numbers in one chunk."""

MIN_END_DISTANCE = 64.0
"""A corner that cuts an edge is further from the ends of the edge than this multiple of `radius`,
so that no piece of the edge is nearly a point."""

MAX_SLACK = 1e-6
"""The largest difference of two parameters that may count as equal."""


@dataclass(frozen=True, eq=False, slots=True)
class OpenEdges:
    """The K open edges of one or more models that are lines, not points.

    Attributes
    ----------
    curves : tuple of EdgeCurves
        Their ids are the numbers 0 … K − 1 of the open edges.
    begin, end : ndarrays of int, shape (K,)
        The numbers of the ends of each edge among the `corners`.
    corners : ndarray of float64, shape (C, 3)
        The ends of all edges.
    """

    curves: tuple[EdgeCurves, ...]
    begin: Ints
    end: Ints
    corners: FloatArray

    @property
    def count(self) -> int:
        """The number K of edges."""
        return len(self.begin)

    def find_rows(self, group: EdgeCurves) -> Ints:
        """For each edge its row in `group`, one of the `curves`; −1 for edges of other groups."""
        rows = np.full(self.count, -1)
        rows[group.ids] = np.arange(len(group.ids))
        return rows

    def move(self, place: Callable[[FloatArray], FloatArray]) -> "OpenEdges":
        """The edges with all points moved by `place`, a function of points (…, 3)."""
        # Adding 0.0 turns -0.0 into 0.0, so that equal points have equal bits.
        curves = (replace(c, points=place(c.points) + 0.0) for c in self.curves)
        return replace(self, curves=tuple(curves), corners=place(self.corners) + 0.0)


def find_open_edges(seams: Seams) -> tuple[OpenEdges, Ints]:
    """The open edges of a model, and the only side (patch · 4 + side) of each, (K,)."""
    connectivity = seams.connectivity
    sides = np.flatnonzero(connectivity.open_lines[connectivity.edge.ravel()])
    edge = connectivity.edge.ravel()[sides]
    number = np.empty(seams.edge_count, np.intp)
    number[edge] = np.arange(len(edge))
    chosen_curves = (group.take(connectivity.open_lines) for group in seams.curves)
    curves = tuple(replace(c, ids=number[c.ids]) for c in chosen_curves if len(c.ids))
    ends = np.concatenate([corners[edge] for corners in connectivity.ends])
    used, ends = np.unique(ends, return_inverse=True)
    begin, end = ends.reshape(2, -1)
    return OpenEdges(curves, begin, end, seams.corner_points[used]), sides


def find_corner_candidates(edges: OpenEdges, radius: float) -> tuple[Ints, Ints]:
    """Pairs of an open edge and a corner, by their numbers: edges (K,) and corners (K,).

    The corner of a pair is within the bounds of the net of the edge, and is not an end of the edge.
    If far more than `MAX_PAIRS` pairs must be compared, the arrays are empty.
    """
    count = edges.count
    low, high = np.empty((count, len(DIRECTIONS))), np.empty((count, len(DIRECTIONS)))
    for group in edges.curves:
        extents = group.points @ DIRECTIONS.T
        low[group.ids], high[group.ids] = extents.min(axis=1), extents.max(axis=1)
    # The longest of the directions has the length √3 < 2.
    margin = 2 * radius + 2.0**-48 * float(np.abs(low).max() + np.abs(high).max())
    low -= margin
    high += margin
    corners = np.unique(np.concatenate([edges.begin, edges.end]))
    extents = edges.corners[corners] @ DIRECTIONS.T
    if count * len(corners) <= FEW_PAIRS:
        is_inside = ((extents >= low[:, None]) & (extents <= high[:, None])).all(axis=2)
        is_inside &= (corners != edges.begin[:, None]) & (corners != edges.end[:, None])
        edge, position = is_inside.nonzero()
        return edge, corners[position]
    # With many pairs, corners are sorted along the axis on which they extend furthest. An edge is
    # compared only with the run of corners within its bounds along this axis.
    axis = int(np.ptp(extents[:, :3], axis=0).argmax())
    order = np.argsort(extents[:, axis], kind="stable")
    corners, extents = corners[order], extents[order]
    begin = np.searchsorted(extents[:, axis], low[:, axis])
    counts = np.searchsorted(extents[:, axis], high[:, axis], side="right") - begin
    if counts.sum() > 16 * MAX_PAIRS:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    pairs = []
    # Runs of edges that are compared with about `CHUNK` corners.
    for run in split_runs(np.diff(np.cumsum(counts) // CHUNK) > 0):
        edge, position = expand_runs(counts[run], begin[run])
        edge += run.start
        is_inside = (corners[position] != edges.begin[edge]) & (
            corners[position] != edges.end[edge]
        )
        for k in range(len(DIRECTIONS)):
            edge, position = edge[is_inside], position[is_inside]
            is_inside = (extents[position, k] >= low[edge, k]) & (
                extents[position, k] <= high[edge, k]
            )
        pairs.append((edge[is_inside], corners[position[is_inside]]))
        checkpoint()
    return np.concatenate([e for e, _ in pairs]), np.concatenate([c for _, c in pairs])


def place_corners(
    edges: OpenEdges, edge: Ints, points: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray, Bools]:
    """For each point (K, 3), the nearest parameter on its edge `edge[k]`.

    Returns
    -------
    at : ndarray of float64, shape (K,)
        Parameters of the edges; meaningful only where `is_on`.
    slack : ndarray of float64, shape (K,)
        The largest difference of parameters that count as equal.
    is_on : ndarray of bool, shape (K,)
        Whether the point is on the edge, and not at its ends.
    """
    at, slack = np.zeros(len(edge)), np.zeros(len(edge))
    is_on = np.zeros(len(edge), dtype=bool)
    for group in edges.curves:
        row_of_edge = edges.find_rows(group)
        rows_of_degree = np.flatnonzero(row_of_edge[edge] >= 0)
        degree = group.points.shape[1] - 1
        samples = np.linspace(0, 1, 8 * degree + 1)
        for part in row_slices(len(rows_of_degree), 3 * len(samples), CHUNK):
            pairs = rows_of_degree[part]
            curve, target = row_of_edge[edge[pairs]], points[pairs]
            # Each curve relative to the point that is placed on it: the point is then 0.
            nets = group.points[curve] - target[:, None]
            weights = None if group.weights is None else group.weights[curve]
            squares = np.square(evaluate_curves(nets, weights, samples)).sum(axis=2)
            if weights is None:
                # No point of the curve is further from its nearest sample than half of a step of
                # the parameter times the largest speed.
                speed = degree * length(np.diff(nets, axis=1), -1).max(axis=1)
                is_close = np.sqrt(squares.min(axis=1)) <= speed * (samples[1] / 2) + radius
                pairs, nets, squares = pairs[is_close], nets[is_close], squares[is_close]
                if not len(pairs):
                    continue
            t = samples[squares.argmin(axis=1)]
            for _ in range(STEPS):
                value, slope = evaluate_with_slope(nets, weights, t)
                squared_speed = np.square(slope).sum(axis=1)
                step = (value * slope).sum(axis=1) / np.where(squared_speed > 0, squared_speed, 1.0)
                t = (t - step).clip(0, 1)
            value, slope = evaluate_with_slope(nets, weights, t)
            is_near = np.square(value).sum(axis=1) <= radius**2
            squared_end_distance = np.minimum(
                np.square(nets[:, 0]).sum(axis=1), np.square(nets[:, -1]).sum(axis=1)
            )
            is_far_from_ends = squared_end_distance > (MIN_END_DISTANCE * radius) ** 2
            at[pairs], is_on[pairs] = t, is_near & is_far_from_ends & (t > 0) & (t < 1)
            speed = length(slope, -1)
            # A step of 4 `radius` along the curve; the least speed avoids division by 0.
            slack[pairs] = np.minimum(4 * radius / np.maximum(speed, radius), MAX_SLACK)
    return at, slack, is_on


def evaluate_curves(
    nets: FloatArray, weights: FloatArray | None, parameters: FloatArray
) -> FloatArray:
    """Points (m, K, 3) of curves (m, n+1, 3) at parameters (K,), or (m, K) for each curve."""
    degree = nets.shape[1] - 1
    basis = bernstein(degree, parameters.ravel()).reshape(*parameters.shape, degree + 1)
    if weights is None:
        return basis @ nets
    weighted_basis = basis * weights[:, None]
    value = weighted_basis @ nets
    value /= weighted_basis.sum(axis=2, keepdims=True)
    return value


def evaluate_with_slope(
    nets: FloatArray, weights: FloatArray | None, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points and derivatives (m, 3) of curves (m, n+1, 3): curve k at parameter `t[k]`."""
    degree = nets.shape[1] - 1
    basis, lower_basis = bernstein(degree, t)[:, None], bernstein(degree - 1, t)[:, None]
    if weights is None:
        return (basis @ nets)[:, 0], degree * (lower_basis @ np.diff(nets, axis=1))[:, 0]
    weighted = nets * weights[..., None]
    weight = (basis @ weights[..., None])[:, 0]
    weight_differences = degree * np.diff(weights, axis=1)
    weight_slope = (lower_basis @ weight_differences[..., None])[:, 0]
    value = (basis @ weighted)[:, 0] / weight
    slope = degree * (lower_basis @ np.diff(weighted, axis=1))[:, 0]
    return value, (slope - weight_slope * value) / weight
