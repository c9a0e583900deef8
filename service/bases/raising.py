"""Raises the degrees of a homogeneous net until all its weights are positive.

A homogeneous control point is (w x, w y, w z, w). A weight of 0 makes it a direction, and has no
point that it could be divided to. But in a higher degree each control point is a mean of
neighbours, and the control weights approach the values of the weight function. So if this function
is positive on the whole surface, all weights are positive from some degree on, and stay so in all
higher degrees.

Raising computes means with shares that are not negative, so rounding moves the surface by little.
Proof in docs/proofs.md: "Raising the degree".

Farin, Curves and Surfaces for CAGD, 5th ed., sections 5.3 and 13.4; Prautzsch and Kobbelt,
Convergence of subdivision and degree elevation, Adv. Comput. Math. 2 (1994).
"""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations
from math import prod
from typing import Protocol, TypeAlias

import numpy as np

from service.bases import knots as knot
from service.bases import polynomials, triangle
from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray
from service.bases.bernstein import elevation_matrix
from service.bases.blossoms import find_refinement, raise_knots
from service.bases.closing import close_rows
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint

BLOCK_POINTS = 1 << 15
"""At most this number of control points is made at once, so that temporary arrays are small."""

MAX_TRIANGLE = 12
"""Matrices that elevate triangles of a higher degree would take more time than the steps."""

Degrees: TypeAlias = tuple[int, ...]
"""One degree for each direction."""


class Direction(Protocol):
    """A direction of nets whose degree can be raised: an axis of arrays (…, d)."""

    @property
    def degree(self) -> int:
        """The degree."""

    def count(self, degree: int) -> int:
        """The number of control points along the axis, in this degree."""

    def estimate(self, values: FloatArray, degree: int) -> FloatArray:
        """`elevate` with other rounding, in less time."""

    def elevate(self, values: FloatArray, degree: int) -> FloatArray:
        """The control values in a higher degree."""


@dataclass(frozen=True)
class BezierDirection:
    """A direction in which nets are Bézier nets."""

    axis: int
    degree: int

    def count(self, degree: int) -> int:
        """The number of control points along the axis, in this degree."""
        return degree + 1

    def estimate(self, values: FloatArray, degree: int) -> FloatArray:
        """`elevate` with other rounding, in less time."""
        return _multiply(elevation_matrix(self.degree, degree), values, self.axis)

    def elevate(self, values: FloatArray, degree: int) -> FloatArray:
        """The control values (…, d) in a higher degree; those of reversed nets are reversed."""
        return _change_along(
            values, self.axis, degree + 1, lambda rows: polynomials.elevate((rows, None), degree)[0]
        )


@dataclass(frozen=True)
class TriangleDirection:
    """The degree of triangular nets, whose control points are one axis."""

    axis: int
    degree: int

    def count(self, degree: int) -> int:
        """The number of control points of a triangle."""
        return triangle.count_points(degree)

    def estimate(self, values: FloatArray, degree: int) -> FloatArray:
        """`elevate` with other rounding, in less time."""
        if self.degree > MAX_TRIANGLE:
            return self.elevate(values, degree)
        return _multiply(triangle.elevation_shares(self.degree, degree), values, self.axis)

    def elevate(self, values: FloatArray, degree: int) -> FloatArray:
        """The control values (…, d) in a higher degree."""
        return _change_along(
            values,
            self.axis,
            self.count(degree),
            lambda rows: triangle.elevate((rows, None), degree)[0],
        )


@dataclass(frozen=True)
class SplineDirection:
    """A direction in which a net is a B-spline; it is clamped where its degree is higher.

    Attributes
    ----------
    axis, degree : int
    knots : ndarray of float64
        Knots as numbers. Those of a periodic direction fit control points of which the first
        `degree` are repeated.
    is_periodic : bool
        Whether the net does not repeat these control points.
    """

    axis: int
    degree: int
    knots: FloatArray
    is_periodic: bool = False

    def count(self, degree: int) -> int:
        """The number of control points along the axis, in this degree."""
        return len(self.raise_knots(degree)) - degree - 1

    def raise_knots(self, degree: int) -> FloatArray:
        """The knots in a higher degree, or the same."""
        if degree == self.degree:
            return self.knots
        domain = knot.domain(self.knots, self.degree)
        return raise_knots(self.knots, self.degree, degree, *domain)

    def estimate(self, values: FloatArray, degree: int) -> FloatArray:
        """As `elevate`."""
        return self.elevate(values, degree)

    def elevate(self, values: FloatArray, degree: int) -> FloatArray:
        """The control values (…, d) in a higher degree."""
        target = self.raise_knots(degree)
        index, shares = find_refinement(self.knots, self.degree, target, degree)
        if self.is_periodic:
            values = knot.wrap_points(values, self.degree, self.axis)

        def change(rows: FloatArray) -> FloatArray:
            return close_rows(combine(rows, None, index, shares), (rows, None), index, shares)[0]

        return _change_along(values, self.axis, len(target) - degree - 1, change)


@dataclass(frozen=True)
class Raising:
    """How nets are raised: the directions, and a degree for each, which may be the same."""

    directions: Sequence[Direction]
    degrees: Degrees

    @property
    def point_count(self) -> int:
        """The number of control points of one net in the new degrees."""
        return count_net_points(self.directions, self.degrees)

    def apply(self, values: FloatArray) -> FloatArray:
        """Control values (…, d) in the new degrees."""
        for direction, degree in zip(self.directions, self.degrees, strict=True):
            if degree > direction.degree:
                values = direction.elevate(values, degree)
        return values


def count_net_points(directions: Sequence[Direction], degrees: Degrees) -> int:
    """The number of control points of one net with these degrees."""
    return prod(each.count(n) for each, n in zip(directions, degrees, strict=True))


def find_degrees(
    weights: FloatArray,
    directions: Sequence[Direction],
    floor: float,
    highest: int,
    fits: Callable[[Degrees], bool],
) -> tuple[Degrees, bool]:
    """The degrees in which all weights are at least `floor`, as far as the limits allow.

    One degree, or all, are raised by the same number, and then each is lowered as far as the
    weights allow. The net with the fewest control points is taken; if there are several, that with
    the highest degree of each direction. So a transposed net gets transposed degrees.

    Parameters
    ----------
    weights : ndarray of float64, shape (…, 1)
        Of one net, or of many.
    floor : float
        Above 0.
    highest : int
        The highest degree.
    fits : callable
        Whether nets of these degrees are small enough.

    Returns
    -------
    degrees : tuple of int
    is_enough : bool
        Whether all weights are at least `floor` in these degrees; if not, they are the highest.
    """
    start = tuple(each.degree for each in directions)

    def is_enough(degrees: Degrees) -> bool:
        checkpoint()
        values = weights
        for each, degree in zip(directions, degrees, strict=True):
            if degree > each.degree:
                values = each.estimate(values, degree)
        return bool((values >= floor).all())

    def lower(degrees: Degrees, order: Sequence[int]) -> Degrees:
        for k in order:

            def replaced(n: int, k: int = k, degrees: Degrees = degrees) -> Degrees:
                return (*degrees[:k], n, *degrees[k + 1 :])

            first = _find_first(start[k], degrees[k], lambda n: is_enough(replaced(n)))
            degrees = replaced(first)
        return degrees

    numbers = range(len(start))
    found, last = dict[Degrees, int](), start
    for raised in dict.fromkeys([*((k,) for k in numbers), tuple(numbers)]):

        def raise_by(by: int, raised: Degrees = raised) -> Degrees:
            return tuple(
                max(n, min(n + by, highest)) if k in raised else n for k, n in enumerate(start)
            )

        room = highest - min(start[k] for k in raised)
        most = _find_first(1, room + 1, lambda by: not fits(raise_by(by))) - 1
        by = _find_first(1, most + 1, lambda by: is_enough(raise_by(by)))
        if by <= most:
            for order in permutations(raised):
                degrees = lower(raise_by(by), order)
                found[degrees] = count_net_points(directions, degrees)
        elif len(raised) == len(start):
            last = raise_by(most)
    least = [degrees for degrees, count in found.items() if count == min(found.values())]
    if len(least) > 1:  # the higher of both degrees in each direction
        highest_of_all = tuple(map(max, zip(*least, strict=True)))
        least = [highest_of_all] if fits(highest_of_all) else sorted(least)
    return (least[0], True) if least else (last, False)


def _find_first(low: int, high: int, is_true: Callable[[int], bool]) -> int:
    """The least number from `low` on for which a monotone statement is true, or `high`.

    The first number and the last are tried first, and then numbers at growing distances, because
    mostly one of the first is the answer, or none.
    """
    if low >= high or is_true(low):
        return low
    if high - low == 1 or not is_true(high - 1):
        return high
    step, first = 1, low + 1
    while first < high - 1 and not is_true(first):
        low, step = first, 2 * step
        first = min(first + step, high - 1)
    return low + 1 + bisect_left(range(low + 1, first), True, key=is_true)


def _multiply(matrix: FloatArray, values: FloatArray, axis: int) -> FloatArray:
    """The values with the matrix applied along one axis."""
    shape = values.shape
    stacked = values.reshape(prod(shape[:axis]), shape[axis], -1)
    return (matrix @ stacked).reshape(*shape[:axis], len(matrix), *shape[axis + 1 :])


def _change_along(
    values: FloatArray, axis: int, length: int, change: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Apply `change`, which works along axis 0, along another axis, in blocks.

    `length` is that of the axis after the change; the last axis of `values` has the coordinates.
    """
    rows = np.moveaxis(values, axis, 0)
    columns = rows.reshape(len(rows), -1, rows.shape[-1])
    changed = np.empty((length, *columns.shape[1:]))
    for block in row_slices(columns.shape[1], length, BLOCK_POINTS):
        changed[:, block] = change(columns[:, block])
    return np.moveaxis(changed.reshape(length, *rows.shape[1:]), 0, axis)
