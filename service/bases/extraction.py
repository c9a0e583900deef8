"""From B-spline control points to the Bézier points of every span.

On one span a B-spline of degree p is a polynomial, hence a Bézier curve. Its points are values of
the blossom f, the symmetric function of p arguments that is affine in each and has f(t, …, t) =
C(t): control point i is f(U_{i+1}, …, U_{i+p}), and Bézier point j of the span [a, b] is
f(a, …, a, b, …, b) with b taken j times. Replacing arguments one by one leads from these to those
by convex combinations only.

What is computed here depends on knots through their differences alone, is the same from either
end, and is done once where two spans meet. So a B-spline and the same one reversed have the same
Bézier points bit for bit, and neighbouring patches the same edges.

Borden, Scott, Evans and Hughes, Isogeometric finite element data structures based on Bézier
extraction of NURBS, IJNME 87 (2011); Ramshaw, Blossoms are polar forms, CAGD 6 (1989).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.cache import PLANS
from service.bases.chunks import chunks
from service.bases.knots import spans

Lowered: TypeAlias = tuple[FloatArray, FloatArray | None]
"""Points, and their weights if they have any."""

CHUNK_BYTES = 4 << 20
"""Operators, or gathered points, of the spans that are treated at a time."""

SAME_SHARE = 2.0**-40
"""How far the shares of equal control points at the two ends of a closed curve may differ, where
knots like k/7 are rounded, for the ends still to be one."""


def operators(knots: FloatArray, degree: int) -> FloatArray:
    """For every span the p + 1 Bézier points as combinations of p + 1 control points.

    Parameters
    ----------
    knots : ndarray of float64
        Any knot vector: clamped or not, multiplicities up to p + 1.

    Returns
    -------
    ndarray of float64, shape (spans, p+1, p+1)
        Row j times the control points s − p … s is Bézier point j of span s. No entry is negative
        and the rows add up to one. Of reversed knots these are the reversed operators, bit for
        bit. Cached, read-only.
    """

    def build() -> FloatArray:
        places = spans(knots, degree)[:, np.newaxis] + np.arange(1 - degree, degree + 1)
        around = knots[places]
        forwards = _blossomed(around[:, :degree], around[:, degree:])
        around = -around[:, ::-1]
        backwards = _blossomed(around[:, :degree], around[:, degree:])
        forwards += backwards[:, ::-1, ::-1]
        forwards /= 2.0
        return forwards

    return PLANS.array(("extraction", degree, knots.tobytes()), build)


def _blossomed(left: FloatArray, right: FloatArray) -> FloatArray:
    """The operators, by replacing first the knots on the left of [a, b] by a, then others by b.

    Parameters
    ----------
    left, right : ndarray of float64, shape (spans, p)
        U_{s−p+1} … U_s = a and b = U_{s+1} … U_{s+p}.
    """
    count, degree = left.shape
    a, b = left[:, -1:], right[:, :1]
    rows = np.broadcast_to(np.eye(degree + 1), (count, degree + 1, degree + 1))
    # Row i is f(a (p − i times), right_1 … right_i).
    half = np.empty((count, degree + 1, degree + 1))
    half[:, degree] = rows[:, degree]
    for r in range(1, degree + 1):
        far, near = right[:, : degree - r + 1], left[:, r - 1 :]
        rows = _mixed(rows, far - a, a - near, far - near)
        half[:, degree - r] = rows[:, -1]
    whole = np.empty_like(half)
    whole[:, 0] = half[:, 0]
    rows = half
    for r in range(1, degree + 1):
        far = right[:, : degree - r + 1]
        rows = _mixed(rows, far - b, b - a, far - a)
        whole[:, r] = rows[:, 0]
    return whole


def _mixed(
    rows: FloatArray, first: FloatArray, second: FloatArray, whole: FloatArray
) -> FloatArray:
    """Each row with the next: (first row_i + second row_{i+1}) / whole."""
    mixed: FloatArray = rows[:, :-1] * (first / whole)[..., np.newaxis]
    mixed += rows[:, 1:] * (second / whole)[..., np.newaxis]
    return mixed


def bezier_points(
    points: FloatArray,
    knots: FloatArray,
    degree: int,
    weights: FloatArray | None = None,
    *,
    out: Lowered | None = None,
) -> Lowered:
    """Bézier points and weights of every span of a B-spline, or of many side by side.

    Points are combined about the middle of those that count, M + Σ c_i w_i (P_i − M) / Σ c_i w_i,
    so that equal points stay that point exactly, poles stay poles, and nothing is lost far from
    the origin. A point that is one control point alone is that control point.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
        Control points along axis 0.
    knots : ndarray of float64, shape (n+p+1,)
    weights : ndarray of float64, shape (n, …), optional
        Positive; without them the points are combined as they are.
    out : pair of ndarrays, optional
        Where to write the results.

    Returns
    -------
    points : ndarray of float64, shape (spans, p+1, …, d)
        The last point of a span and the first of the next are one, unless the curve parts there.
    weights : ndarray of float64, shape (spans, p+1, …), or None
    """
    at = spans(knots, degree)
    if out is None:
        shape = (len(at), degree + 1)
        heavy = None if weights is None else np.empty(shape + weights.shape[1:])
        out = np.empty(shape + points.shape[1:]), heavy
    # The shares of the first and of the last point of every span.
    begins, ends = np.empty((2, len(at), degree + 1))
    row_bytes = 8 * (degree + 1) * max(degree + 1, points[0].size)
    for chunk in chunks(len(at), row_bytes, CHUNK_BYTES):
        here = at[chunk]
        shares = operators(knots[here[0] - degree : here[-1] + degree + 2], degree)
        begins[chunk], ends[chunk] = shares[:, 0], shares[:, -1]
        if degree > 1:
            inner = _combined(points, weights, here - degree, shares[:, 1:-1])
            for target, values in _both(out, inner):
                target[chunk, 1:-1] = values
    for joints in _joints(points, weights, knots, degree, (begins, ends)):
        made = _combined(points, weights, joints.first, joints.shares)
        for target, values in _both(out, made):
            target[joints.after[joints.opens], 0] = values[joints.opens, 0]
            target[joints.before[joints.shuts], -1] = values[joints.shuts, 0]
    return out


def _both(targets: Lowered, values: Lowered) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Where to write what: points, and weights if there are any."""
    for target, value in zip(targets, values, strict=True):
        if target is not None and value is not None:
            yield target, value


@dataclass(frozen=True, eq=False, slots=True)
class _Joints:
    """Bézier points between spans that are made of equally many control points, k.

    `first` (g,) is the first of those, `shares` (g, 1, k) what each gives. A joint `opens` span
    `after` and `shuts` span `before`, both or either.
    """

    first: Ints
    shares: FloatArray
    before: Ints
    after: Ints
    opens: Bools
    shuts: Bools


def _joints(
    points: FloatArray,
    weights: FloatArray | None,
    knots: FloatArray,
    degree: int,
    shares: tuple[FloatArray, FloatArray],
) -> Iterator[_Joints]:
    """The joints, by the multiplicity m of their knot: k = p − m + 1 control points count there.

    At multiplicity p + 1 the curve parts: there are two points, each one control point.
    """
    begins, ends = shares
    at = spans(knots, degree)
    last = len(at)
    many = _multiplicities(knots, degree, at)
    if many[0] == many[-1] < degree:
        heads, tails = at[0] - degree, at[-1] - degree + many[-1]
        head, tail = begins[0, : degree + 1 - many[0]], ends[-1, many[-1] :]
        if all(
            np.array_equal(values[heads : heads + len(head)], values[tails : tails + len(tail)])
            for values in (points, weights)
            if values is not None
        ):
            _close(head, tail)
    row_bytes = 8 * max(degree + 1, points[0].size)
    for m in np.unique(many).tolist():
        same = np.flatnonzero(many == m)
        for chunk in chunks(len(same), row_bytes, CHUNK_BYTES):
            joint = same[chunk]
            before, after = np.maximum(joint - 1, 0), np.minimum(joint, last - 1)
            opens, shuts = joint < last, joint > 0
            if m > degree:
                one, both = np.ones((len(joint), 1, 1)), np.ones(len(joint), dtype=bool)
                yield _Joints(at[before], one, before, after, ~both, both)
                yield _Joints(at[after] - degree, one, before, after, both, ~both)
                continue
            first = np.where(opens, at[after] - degree, at[before] - degree + m)
            left, right = ends[before, m:], begins[after, : degree + 1 - m]
            left[~shuts], right[~opens] = right[~shuts], left[~opens]
            yield _Joints(first, ((left + right) / 2)[:, np.newaxis], before, after, opens, shuts)


def _multiplicities(knots: FloatArray, degree: int, at: Ints) -> Ints:
    """How often each break occurs; at the ends of the domain p is as good as more."""
    many = np.empty(len(at) + 1, dtype=np.intp)
    many[1:-1] = np.diff(at)
    before, after = knots[: at[0] + 1], knots[at[-1] + 1 :]
    many[0] = min(degree, int((before == before[-1]).sum()))
    many[-1] = min(degree, int((after == after[0]).sum()))
    return many


def _close(head: FloatArray, tail: FloatArray) -> None:
    """Makes the shares of the first and the last point one if they differ by rounding alone.

    So a curve closes that is given with its first p points once more at its end, over knots whose
    differences should repeat and, like those of k/7, nearly do.
    """
    if np.abs(head - tail).max() <= SAME_SHARE:
        head[:] = tail[:] = (head + tail) / 2


def _combined(
    points: FloatArray, weights: FloatArray | None, first: Ints, shares: FloatArray
) -> Lowered:
    """Combinations of k control points from `first` on, shares (g, r, k): (g, r, …).

    Added in pairs from the outside in: reversed, the sum is the same bit for bit.
    """
    count = shares.shape[-1]
    middle = (points[first + (count - 1) // 2] + points[first + count // 2]) / 2
    place = np.zeros(shares.shape[:2] + points.shape[1:])
    weight = None if weights is None else np.zeros(shares.shape[:2] + weights.shape[1:])
    for low in range((count + 1) // 2):
        pair = (low, count - 1 - low) if low < count - 1 - low else (low,)
        given = [_spread(shares[..., k], points.ndim - 1) for k in pair]
        if weights is not None and weight is not None:
            given = [
                _spread(shares[..., k], weights.ndim - 1) * weights[first + k][:, np.newaxis]
                for k in pair
            ]
            weight += sum(given[1:], given[0])
            given = [share[..., np.newaxis] for share in given]
        if len(pair) == 2:
            a, b = (
                share * (points[first + k] - middle)[:, np.newaxis]
                for share, k in zip(given, pair, strict=True)
            )
            a += b
            place += a
    if weight is not None:
        place /= weight[..., np.newaxis]
    place += middle[:, np.newaxis]
    alone = shares.max(axis=-1) >= 1.0
    if alone.any():
        control = (first[:, np.newaxis] + shares.argmax(axis=-1))[alone]
        place[alone] = points[control]
        if weights is not None and weight is not None:
            weight[alone] = weights[control]
    return place, weight


def _spread(shares: FloatArray, axes: int) -> FloatArray:
    """Shares with so many axes more, to multiply what has them."""
    return shares.reshape(shares.shape + (1,) * axes)
