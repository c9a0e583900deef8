"""Bézier extraction: computes the Bézier points of every span of a B-spline.

Each Bézier point is a combination of control points (`service.bases.blossoms`). The shares in a
combination depend only on differences of knots, and do not depend on the direction of the curve; a
point where two spans meet is computed once. Hence a B-spline and its reversed B-spline have the
same Bézier points, bit for bit, and neighbouring patches have the same points on their common edge.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np

from service.bases.affine_combination import WeightedPoints, combine_run
from service.bases.arrays import FloatArray, Ints
from service.bases.blossoms import build_operators
from service.bases.cache import MESH_PLANS
from service.bases.knots import spans
from service.bases.row_batches import row_slices

CHUNK_BYTES = 4 << 20
"""Spans are computed in chunks, in which each temporary array has at most this number of bytes, or
one span."""

SAME_SHARE = 2.0**-40
"""Shares at the two ends of a closed curve that differ by at most this number are made equal: knots
like k/7 are rounded, but both ends must be the same point."""


@dataclass(frozen=True, eq=False, slots=True)
class _Sums:
    """Bézier points that combine k consecutive control points each; r points for each of g runs.

    Attributes
    ----------
    first : ndarray of int, shape (g,)
        The number of the first control point of each run.
    shares : ndarray of float64, shape (g, r, k)
        The shares of the k control points in each Bézier point.
    targets : ndarray of int, shape (g, r)
        The numbers of the Bézier points.
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
        Bézier points that equal a control point: their numbers, and the numbers of the control
        points.
    repetition : (int, int, int), or None
        (m, i, j): both ends of the curve are the same point if control points i … i + m − 1 equal
        control points j … j + m − 1. None if this test cannot show that the curve is closed.
    """

    count: int
    point_numbers: Ints
    sums: tuple[_Sums, ...]
    copies: Ints
    repetition: tuple[int, int, int] | None

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        sums = sum(s.first.nbytes + s.shares.nbytes + s.targets.nbytes for s in self.sums)
        return self.point_numbers.nbytes + self.copies.nbytes + sums

    def combine(self, points: FloatArray, weights: FloatArray | None = None) -> WeightedPoints:
        """The distinct Bézier points and weights, shapes (count, …, d) and (count, …).

        A mean of control points is computed relative to the middle one of them (`combine_run`). So
        the mean of equal points is exactly this point, poles stay poles, and no digits are lost far
        from the origin. A Bézier point that equals a control point is copied, bit for bit.

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
            # Numbers of one run in the largest array: r shares of k points each, or r points.
            _, r, k = sums.shares.shape
            width = r * max(k, points[0].size)
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
        """Whether the last control points repeat the first, so that the curve is closed."""
        if self.repetition is None:
            return False
        m, i, j = self.repetition
        return all(
            np.array_equal(values[i : i + m], values[j : j + m])
            for values in (points, weights)
            if values is not None
        )


def plan_extraction(
    knots: FloatArray, degree: int, points: FloatArray, weights: FloatArray | None = None
) -> Extraction:
    """The extraction for these knots, from the cache if possible.

    Of the control points (n, …, d) and their weights, only one property matters: whether the curve
    is closed.
    """
    key = knots.tobytes()

    def build_cached(is_closed: bool) -> Extraction:
        name = ("extraction", degree, is_closed, key)
        plan = MESH_PLANS.get(name, lambda: _build_extraction(knots, degree, is_closed))
        return cast(Extraction, plan)

    plan = build_cached(is_closed=False)
    return build_cached(is_closed=True) if plan.is_closed(points, weights) else plan


def extract_bezier_points(
    points: FloatArray, knots: FloatArray, degree: int, weights: FloatArray | None = None
) -> WeightedPoints:
    """Bézier points and weights of every span of one B-spline, or of many with the same knots.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
        Control points along axis 0; each index of the axes between is a B-spline of its own.
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


def _build_extraction(knots: FloatArray, degree: int, is_closed: bool) -> Extraction:
    """Build the extraction; `is_closed` says whether the last point of the curve is its first."""
    span_numbers = spans(knots, degree)
    shares = np.empty((len(span_numbers), degree + 1, degree + 1))
    for chunk in row_slices(len(span_numbers), 8 * (degree + 1) ** 2, CHUNK_BYTES):
        chunk_spans = span_numbers[chunk]
        # The control points of these spans have the knots U_{s−p} … U_{s+p+1}.
        shares[chunk] = build_operators(
            knots[chunk_spans[0] - degree : chunk_spans[-1] + degree + 2], degree
        )
    first_shares, last_shares = shares[:, 0].copy(), shares[:, -1].copy()
    multiplicities = _multiplicities(knots, degree, span_numbers)
    repetition = None
    if multiplicities[0] == multiplicities[-1] < degree:
        # The shares of the p + 1 − m control points in the first and in the last point of the
        # curve: views, through which `_equalize_ends` changes the arrays.
        head = first_shares[0, : degree + 1 - multiplicities[0]]
        tail = last_shares[-1, multiplicities[-1] :]
        repetition = (
            len(head),
            int(span_numbers[0]) - degree,
            int(span_numbers[-1]) - degree + int(multiplicities[-1]),
        )
        if is_closed:
            _equalize_ends(head, tail)
    # At a knot of multiplicity p + 1 the curve is discontinuous: it has two Bézier points there,
    # and both equal control points.
    jumps = np.flatnonzero(multiplicities > degree)
    # The number of the first Bézier point of each span; then the numbers of all its points.
    first_targets = degree * np.arange(len(span_numbers)) + np.cumsum(multiplicities[:-1] > degree)
    targets = first_targets[:, np.newaxis] + np.arange(degree + 1)
    copies = [
        (targets[jumps - 1, -1], span_numbers[jumps - 1]),
        (targets[jumps, 0], span_numbers[jumps] - degree),
    ]
    # The points between the first and the last of each span; then the points where spans meet.
    sums = [] if degree < 2 else [_Sums(span_numbers - degree, shares[:, 1:-1], targets[:, 1:-1])]
    sums += _combine_at_breaks(span_numbers, multiplicities, (first_shares, last_shares), targets)
    combinations: list[_Sums] = []
    for group in sums:
        # A Bézier point that equals a control point is copied. In a run that also has other points
        # it is combined too; `Extraction.combine` then overwrites it by the copy.
        is_copy = group.shares.max(axis=-1) >= 1.0
        controls = group.first[:, np.newaxis] + group.shares.argmax(axis=-1)
        copies.append((group.targets[is_copy], controls[is_copy]))
        is_needed = ~is_copy.all(axis=1)
        if is_needed.any():
            combinations.append(
                _Sums(group.first[is_needed], group.shares[is_needed], group.targets[is_needed])
            )
    pairs = np.concatenate([np.stack(pair) for pair in copies], axis=1)
    return Extraction(int(targets[-1, -1]) + 1, targets, tuple(combinations), pairs, repetition)


def _combine_at_breaks(
    span_numbers: Ints, multiplicities: Ints, shares: tuple[FloatArray, FloatArray], targets: Ints
) -> Iterator[_Sums]:
    """The Bézier points at the breaks, one `_Sums` for each multiplicity m ≤ p of the breaks.

    A *break* is a distinct knot of the domain: an end of the curve, or a knot where two spans meet.
    A point at a break of multiplicity m combines p − m + 1 control points. Its shares are
    the mean of its shares in the span before the break and in the span after the break.

    Parameters
    ----------
    span_numbers : ndarray of int, shape (spans,)
    multiplicities : ndarray of int, shape (spans+1,)
        Multiplicities of the breaks.
    shares : (ndarray, ndarray) of float64, shapes (spans, p+1)
        Shares of the first and of the last Bézier point of every span.
    targets : ndarray of int, shape (spans, p+1)
        Numbers of the Bézier points of every span.
    """
    first_shares, last_shares = shares
    span_count, degree = len(span_numbers), first_shares.shape[1] - 1
    for m in np.unique(multiplicities[multiplicities <= degree]).tolist():
        breaks = np.flatnonzero(multiplicities == m)
        span_before, span_after = np.maximum(breaks - 1, 0), np.minimum(breaks, span_count - 1)
        # The first break has a span only after it, the last break only before it.
        has_after, has_before = breaks < span_count, breaks > 0
        first = np.where(
            has_after, span_numbers[span_after] - degree, span_numbers[span_before] - degree + m
        )
        # The last point of the span before a break does not depend on the first m control points of
        # this span, nor the first point of the span after it on the last m.
        shares_before, shares_after = (
            last_shares[span_before, m:],
            first_shares[span_after, : degree + 1 - m],
        )
        # At an end of the curve only one span is there: its shares serve for both sides.
        shares_before[~has_before], shares_after[~has_after] = (
            shares_after[~has_before],
            shares_before[~has_after],
        )
        numbers = np.where(has_after, targets[span_after, 0], targets[span_before, -1])
        yield _Sums(
            first, ((shares_before + shares_after) / 2)[:, np.newaxis], numbers[:, np.newaxis]
        )


def _multiplicities(knots: FloatArray, degree: int, span_numbers: Ints) -> Ints:
    """The multiplicity of each break; at the ends of the domain p at most."""
    multiplicities = np.empty(len(span_numbers) + 1, dtype=np.intp)
    multiplicities[1:-1] = np.diff(span_numbers)
    knots_before, knots_after = knots[: span_numbers[0] + 1], knots[span_numbers[-1] + 1 :]
    multiplicities[0] = min(degree, int((knots_before == knots_before[-1]).sum()))
    multiplicities[-1] = min(degree, int((knots_after == knots_after[0]).sum()))
    return multiplicities


def _equalize_ends(head: FloatArray, tail: FloatArray) -> None:
    """Make the shares of the first and the last point equal if they differ by rounding alone.

    Both arrays are overwritten. Then a curve whose first p points are repeated at its end is
    closed, also if its knots are rounded numbers such as k/7.
    """
    if np.abs(head - tail).max() <= SAME_SHARE:
        head[:] = tail[:] = (head + tail) / 2
