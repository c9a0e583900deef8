"""Raises the degrees of a homogeneous net until all its weights are positive.

A homogeneous control point is (w x, w y, w z, w). A weight of 0 makes it a direction, and has no
point that it could be divided to. But in a higher degree each control point is a mean of
neighbours, and the control weights approach the values of the weight function. So if this function
is positive on the whole surface, all weights are positive from some degree on, and stay so in all
higher degrees.

Steps raise one direction by one degree. A step computes means of neighbours with shares that are
not negative, so a coordinate of each result is off by at most 4 roundings of the largest coordinate
among the old control points: r steps move a point of the surface by at most 4 r u max |w P| / w(u,
v), with u = 2^-53.

Farin, Curves and Surfaces for CAGD, 5th ed., sections 5.3 and 13.4; Prautzsch and Kobbelt,
Convergence of subdivision and degree elevation, Adv. Comput. Math. 2 (1994).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import prod
from typing import Protocol

import numpy as np

from service.bases import knots as knot
from service.bases import polynomials, triangle
from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray
from service.bases.blossoms import find_refinement, raise_knots
from service.bases.closing import close_rows
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint

BLOCK_POINTS = 1 << 15
"""A step makes at most this number of control points at once, so that temporary arrays are
small."""


class Direction(Protocol):
    """A direction of nets whose degree can be raised."""

    @property
    def degree(self) -> int:
        """The present degree."""

    @property
    def length(self) -> int:
        """The number of control points along the axis, in the present degree."""

    def step(self, values: FloatArray) -> tuple["Direction", FloatArray]:
        """The direction and the control values in one degree more."""


def count_net_points(directions: Sequence[Direction]) -> int:
    """The number of control points of one net."""
    return prod(direction.length for direction in directions)


@dataclass(frozen=True)
class BezierDirection:
    """A direction in which nets are Bézier nets, along the axis `axis` of their arrays."""

    axis: int
    degree: int

    @property
    def length(self) -> int:
        """The number of control points along the axis."""
        return self.degree + 1

    def step(self, values: FloatArray) -> tuple["BezierDirection", FloatArray]:
        """The direction and the control values (…, d) in one degree more."""
        raised = BezierDirection(self.axis, self.degree + 1)

        def change(rows: FloatArray) -> FloatArray:
            return polynomials.elevate((rows, None), raised.degree)[0]

        return raised, _change_along(values, self.axis, raised.length, change)


@dataclass(frozen=True)
class TriangleDirection:
    """The degree of triangular nets, whose control points are the axis `axis`."""

    axis: int
    degree: int

    @property
    def length(self) -> int:
        """The number of control points of a triangle."""
        return triangle.count_points(self.degree)

    def step(self, values: FloatArray) -> tuple["TriangleDirection", FloatArray]:
        """The direction and the control values (…, d) in one degree more."""
        raised = TriangleDirection(self.axis, self.degree + 1)

        def change(rows: FloatArray) -> FloatArray:
            return triangle.elevate((rows, None), raised.degree)[0]

        return raised, _change_along(values, self.axis, raised.length, change)


@dataclass(frozen=True)
class SplineDirection:
    """A direction in which a net is a B-spline; it is clamped from the first step on.

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

    @property
    def length(self) -> int:
        """The number of control points along the axis, with those that are repeated."""
        return len(self.knots) - self.degree - 1

    def step(self, values: FloatArray) -> tuple["SplineDirection", FloatArray]:
        """The direction and the control values (…, d) in one degree more."""
        p, domain = self.degree, knot.domain(self.knots, self.degree)
        target = raise_knots(self.knots, p, p + 1, *domain)
        index, shares = find_refinement(self.knots, p, target, p + 1)
        if self.is_periodic:
            values = knot.wrap_points(values, p, self.axis)

        def change(rows: FloatArray) -> FloatArray:
            return close_rows(combine(rows, None, index, shares), (rows, None), index, shares)[0]

        raised = SplineDirection(self.axis, p + 1, target)
        return raised, _change_along(values, self.axis, raised.length, change)


@dataclass(frozen=True)
class Raising:
    """How a net is raised: the numbers of the directions, step after step, and what results.

    Attributes
    ----------
    start, directions : sequence of Direction
        The directions before and after all steps.
    steps : tuple of int
    weights : ndarray of float64, shape (…, 1)
        The weights after all steps.
    """

    start: Sequence[Direction]
    directions: Sequence[Direction]
    steps: tuple[int, ...]
    weights: FloatArray

    @property
    def point_count(self) -> int:
        """The number of control points of one net after all steps."""
        return count_net_points(self.directions)

    def apply(self, values: FloatArray) -> FloatArray:
        """Control values (…, d) in the new degrees."""
        directions = list(self.start)
        for number in self.steps:
            checkpoint()
            directions[number], values = directions[number].step(values)
        return values


def find_raising(
    weights: FloatArray,
    directions: Sequence[Direction],
    floor: float,
    highest: int,
    fits: Callable[[Sequence[Direction]], bool],
) -> Raising:
    """The steps after which all weights are at least `floor`, as far as the limits allow.

    Each step raises the direction after which the smaller part of the weights is below `floor`, or
    both directions if they are equally good. A net that needs the u direction alone gets no higher
    degree along v, and a transposed net gets transposed degrees.

    Parameters
    ----------
    weights : ndarray of float64, shape (…, 1)
        Of one net, or of many.
    floor : float
        Above 0.
    highest : int
        The highest degree.
    fits : callable
        Whether nets with these directions are small enough.

    Returns
    -------
    Raising
        Its weights are not all at least `floor` if a limit was met.
    """
    state, steps = list(directions), list[int]()
    while (weights < floor).any():
        checkpoint()
        trials = {}
        for number, direction in enumerate(state):
            if direction.degree < highest:
                raised, values = direction.step(weights)
                trials[number] = raised, values, np.count_nonzero(values < floor) / values.size
        least = min((share for *_, share in trials.values()), default=0.0)
        chosen = [number for number, (*_, share) in trials.items() if share <= least]
        after = [trials[n][0] if n in chosen else each for n, each in enumerate(state)]
        if not chosen or not fits(after):
            break
        weights = trials[chosen[0]][1]
        for number in chosen[1:]:
            weights = state[number].step(weights)[1]
        state = after
        steps += chosen
    return Raising(directions, state, tuple(steps), weights)


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
