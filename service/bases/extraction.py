"""From B-spline control points to the Bézier points of every span.

Each Bézier point is a combination of control points (`service.bases.blossoms`). The combinations
depend on differences of knots alone, are symmetric in the direction of the curve, and are computed
once at each point where two spans meet. Hence a B-spline and its reverse have the same Bézier
points bit for bit, and neighbouring patches the same edges.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.affine_combination import WeightedPoints, combine_run
from service.bases.arrays import FloatArray, Ints
from service.bases.blossoms import build_operators
from service.bases.cache import MESH_PLANS
from service.bases.knots import spans
from service.bases.row_batches import row_slices

CHUNK_BYTES = 4 << 20
"""Bytes of the operators, or gathered points, of the spans in one chunk."""

SAME_SHARE = 2.0**-40
"""Largest difference of the shares of equal control points at the two ends of a closed curve. Knots
like k/7 are rounded, but the ends must be one point."""


@dataclass(frozen=True, eq=False, slots=True)
class _Sums:
    """Bézier points that are sums of k control points each.

    `first` (g,) are the numbers of the first control points, `shares` (g, r, k) their shares,
    `targets` (g, r) the numbers of the Bézier points.
    """

    first: Ints
    shares: FloatArray
    targets: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Extraction:
    """The Bézier points of every span, as combinations of control points.

    Attributes
    ----------
    count : int
        Number of distinct Bézier points; they are numbered along the curve.
    point_numbers : ndarray of int, shape (spans, p+1)
        Numbers of the Bézier points of each span: the last point of a span is the first of the
        next, unless the curve is discontinuous there.
    sums : tuple of _Sums
        Bézier points that combine several control points.
    copies : ndarray of int, shape (2, c)
        Bézier points that are control points: their numbers, and those of the control points.
    repeated : (int, int, int), or None
        (m, i, j): the ends of the curve are one point if control points i … i + m − 1 equal control
        points j … j + m − 1.
    """

    count: int
    point_numbers: Ints
    sums: tuple[_Sums, ...]
    copies: Ints
    repeated: tuple[int, int, int] | None

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        sums = sum(s.first.nbytes + s.shares.nbytes + s.targets.nbytes for s in self.sums)
        return self.point_numbers.nbytes + self.copies.nbytes + sums

    def combine(self, points: FloatArray, weights: FloatArray | None = None) -> WeightedPoints:
        """The distinct Bézier points and weights, shapes (count, …, d) and (count, …).

        Points are combined relative to their middle, so that the mean of equal points is exactly
        that point, poles stay poles, and no digits are lost far from the origin. A Bézier point
        that is a control point has its bits.

        Parameters
        ----------
        points : ndarray of float64, shape (n, …, d)
            Control points along axis 0.
        weights : ndarray of float64, shape (n, …), optional
            Positive; by default all are equal.
        """
        combined = np.empty((self.count, *points.shape[1:]))
        weight = None if weights is None else np.empty((self.count, *weights.shape[1:]))
        for sums in self.sums:
            width = sums.shares.shape[1] * max(sums.shares.shape[2], points[0].size)
            for rows in row_slices(len(sums.first), 8 * width, CHUNK_BYTES):
                targets = sums.targets[rows]
                combined[targets], weight_sums = combine_run(
                    points, weights, sums.first[rows], sums.shares[rows]
                )
                if weight is not None:
                    weight[targets] = weight_sums
        targets, controls = self.copies
        combined[targets] = points[controls]
        if weight is not None and weights is not None:
            weight[targets] = weights[controls]
        return combined, weight

    def is_closed(self, points: FloatArray, weights: FloatArray | None) -> bool:
        """Whether the last of these control points equal the first, so that the curve closes."""
        if self.repeated is None:
            return False
        count, head, tail = self.repeated
        return all(
            np.array_equal(values[head : head + count], values[tail : tail + count])
            for values in (points, weights)
            if values is not None
        )


def plan_extraction(
    knots: FloatArray, degree: int, points: FloatArray, weights: FloatArray | None = None
) -> Extraction:
    """The cached extraction for these knots.

    The control points, of shape (n, …, d), only decide whether the curve closes.
    """
    key = knots.tobytes()

    def build_cached(closed: bool) -> Extraction:
        plan = MESH_PLANS.get(
            ("extraction", degree, closed, key), lambda: _build_extraction(knots, degree, closed)
        )
        assert isinstance(plan, Extraction)
        return plan

    plan = build_cached(closed=False)
    return build_cached(closed=True) if plan.is_closed(points, weights) else plan


def extract_bezier_points(
    points: FloatArray, knots: FloatArray, degree: int, weights: FloatArray | None = None
) -> WeightedPoints:
    """Bézier points and weights of every span of a B-spline, or of many along further axes.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
        Control points along axis 0.
    knots : ndarray of float64, shape (n+p+1,)
    weights : ndarray of float64, shape (n, …), optional

    Returns
    -------
    points : ndarray of float64, shape (spans, p+1, …, d)
    weights : ndarray of float64, shape (spans, p+1, …), or None
    """
    plan = plan_extraction(knots, degree, points, weights)
    combined, weight = plan.combine(points, weights)
    return combined[plan.point_numbers], None if weight is None else weight[plan.point_numbers]


def _build_extraction(knots: FloatArray, degree: int, closed: bool) -> Extraction:
    """The extraction for some knots; `closed` says whether the curve ends in its first point."""
    at = spans(knots, degree)
    shares = np.empty((len(at), degree + 1, degree + 1))
    for chunk in row_slices(len(at), 8 * (degree + 1) ** 2, CHUNK_BYTES):
        within = at[chunk]
        shares[chunk] = build_operators(knots[within[0] - degree : within[-1] + degree + 2], degree)
    begins, ends = shares[:, 0].copy(), shares[:, -1].copy()
    counts = _multiplicities(knots, degree, at)
    repeated = None
    if counts[0] == counts[-1] < degree:
        head, tail = begins[0, : degree + 1 - counts[0]], ends[-1, counts[-1] :]
        repeated = len(head), int(at[0]) - degree, int(at[-1]) - degree + int(counts[-1])
        if closed:
            _close(head, tail)
    # At multiplicity p + 1 the curve is discontinuous: it has two points at this knot, both control
    # points.
    parted = np.flatnonzero(counts > degree)
    first = degree * np.arange(len(at)) + np.cumsum(counts[:-1] > degree)
    places = first[:, np.newaxis] + np.arange(degree + 1)
    copies = [(places[parted - 1, -1], at[parted - 1]), (places[parted, 0], at[parted] - degree)]
    sums = [] if degree < 2 else [_Sums(at - degree, shares[:, 1:-1], places[:, 1:-1])]
    sums += _combine_joints(at, counts, (begins, ends), places)
    remaining: list[_Sums] = []
    for part in sums:
        # A Bézier point that is a control point is copied, not combined.
        is_point = part.shares.max(axis=-1) >= 1.0
        controls = part.first[:, np.newaxis] + part.shares.argmax(axis=-1)
        copies.append((part.targets[is_point], controls[is_point]))
        rows = ~is_point.all(axis=1)
        if rows.any():
            remaining.append(_Sums(part.first[rows], part.shares[rows], part.targets[rows]))
    pairs = np.concatenate([np.stack(pair) for pair in copies], axis=1)
    return Extraction(int(places[-1, -1]) + 1, places, tuple(remaining), pairs, repeated)


def _combine_joints(
    at: Ints, many: Ints, shares: tuple[FloatArray, FloatArray], places: Ints
) -> Iterator[_Sums]:
    """Points between spans, by the multiplicity m of their knot: each combines p − m + 1 points.

    A point is the mean of the results of the spans on both sides: `shares` of the first and of the
    last point of every span, (spans, p+1).
    """
    begins, ends = shares
    last, degree = len(at), begins.shape[1] - 1
    for m in np.unique(many[many <= degree]).tolist():
        joint = np.flatnonzero(many == m)
        before, after = np.maximum(joint - 1, 0), np.minimum(joint, last - 1)
        opens, shuts = joint < last, joint > 0
        first = np.where(opens, at[after] - degree, at[before] - degree + m)
        left, right = ends[before, m:], begins[after, : degree + 1 - m]
        left[~shuts], right[~opens] = right[~shuts], left[~opens]
        targets = np.where(opens, places[after, 0], places[before, -1])
        yield _Sums(first, ((left + right) / 2)[:, np.newaxis], targets[:, np.newaxis])


def _multiplicities(knots: FloatArray, degree: int, at: Ints) -> Ints:
    """The multiplicity of each break; at the ends of the domain at most p."""
    counts = np.empty(len(at) + 1, dtype=np.intp)
    counts[1:-1] = np.diff(at)
    before, after = knots[: at[0] + 1], knots[at[-1] + 1 :]
    counts[0] = min(degree, int((before == before[-1]).sum()))
    counts[-1] = min(degree, int((after == after[0]).sum()))
    return counts


def _close(head: FloatArray, tail: FloatArray) -> None:
    """Makes the shares of the first and the last point equal if they differ by rounding alone.

    A curve whose first p points are repeated at its end then closes, also over knots such as k/7
    whose differences repeat only up to rounding.
    """
    if np.abs(head - tail).max() <= SAME_SHARE:
        head[:] = tail[:] = (head + tail) / 2
