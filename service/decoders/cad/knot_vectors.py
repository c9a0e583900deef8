"""Knot vectors as CAD files give them: with multiplicities, or implied by a name."""

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from operator import eq
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray
from service.bases.knots import clamped_knots, merge_knots, uniform_knots
from service.decoders.cad.faults import InvalidGeometry
from service.surface.knots import MIN_LENGTH, find_least_span

KnotKind: TypeAlias = Literal["uniform", "quasi_uniform", "bezier"]

MAX_DEGREE = 30
"""The highest degree that files may have."""

MAX_PARAMETER = 1e12
"""The largest absolute value of a knot."""


def to_floats(values: ArrayLike) -> FloatArray:
    """An array of what a file has where it should have numbers.

    Raises
    ------
    InvalidGeometry
        Rows have different lengths, or a value is no number.
    """
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidGeometry("a list of numbers is incomplete") from None


def check_degree(degree: int, count: int) -> None:
    """Refuse a degree out of 1 … 30, and fewer than degree + 1 control points.

    Raises
    ------
    InvalidGeometry
    """
    if not 1 <= degree <= MAX_DEGREE:
        raise InvalidGeometry(f"the degree of a spline is not between 1 and {MAX_DEGREE}")
    if count <= degree:
        raise InvalidGeometry("a spline has fewer control points than degree + 1")


def expand_knots(
    values: Sequence[float], multiplicities: Sequence[int], degree: int, count: int
) -> FloatArray:
    """The full knot vector (count + p + 1,) of distinct knots and their multiplicities.

    Nothing is allocated before the sum of the multiplicities is known to fit.

    Raises
    ------
    InvalidGeometry
    """
    if len(values) != len(multiplicities):
        raise InvalidGeometry("a knot has no multiplicity")
    if min(multiplicities, default=0) < 1 or sum(multiplicities) != count + degree + 1:
        raise InvalidGeometry("the multiplicities do not fit the number of control points")
    return np.repeat(to_floats(values), multiplicities)


def imply_knots(kind: KnotKind, degree: int, count: int) -> FloatArray:
    """The knot vector that ISO 10303-42 implies (`default_b_spline_knots`).

    Uniform knots are −p, −p + 1, …; quasi-uniform ones are clamped; the inner knots of piecewise
    Bézier curves have the multiplicity p.

    Raises
    ------
    InvalidGeometry
        The number of points of a piecewise Bézier curve is not 1 + a multiple of p.
    """
    check_degree(degree, count)
    if kind == "uniform":
        return uniform_knots(count, degree)
    if kind == "quasi_uniform":
        return clamped_knots(count, degree)
    pieces, rest = divmod(count - 1, degree)
    if rest:
        raise InvalidGeometry("the number of points does not fit a piecewise Bézier curve")
    ends = np.repeat(np.arange(pieces + 1.0), degree)
    return np.concatenate([ends[:1], ends, ends[-1:]])


def check_knots(knots: FloatArray, degree: int, count: int) -> FloatArray:
    """The knots of a spline, of which those are made equal that differ by rounding alone.

    A knot inside the domain may occur p + 1 times: there the spline may be discontinuous.

    Raises
    ------
    InvalidGeometry
        The knots are too many or too few, not finite, decrease, have a multiplicity above p + 1, or
        a domain without length.
    """
    check_degree(degree, count)
    if knots.shape != (count + degree + 1,):
        raise InvalidGeometry("the number of knots does not fit the number of control points")
    # Most knot vectors are so short that Python's loops take less time than NumPy's calls.
    values = knots.tolist()
    shortest = _find_shortest_step(values)
    low, high = values[degree], values[-degree - 1]
    if not low < high:
        raise InvalidGeometry("the domain of a spline has no length")
    least = find_least_span(low, high)
    if shortest < least:
        knots = merge_knots(knots, degree, least)
        values = knots.tolist()
        if _find_shortest_step(values) < MIN_LENGTH:
            raise InvalidGeometry("a span of a spline is too short")
        if not values[degree] < values[-degree - 1]:
            raise InvalidGeometry("the domain of a spline has no length")
    if any(map(eq, values, values[degree + 1 :])):
        raise InvalidGeometry("a knot occurs more than degree + 1 times")
    return knots


def _find_shortest_step(values: Sequence[float]) -> float:
    """The least difference above 0 between neighbouring knots, after a check of their order."""
    if not (abs(values[0]) <= MAX_PARAMETER and abs(values[-1]) <= MAX_PARAMETER):
        raise InvalidGeometry("a knot is not finite or too large")
    shortest = inf
    for first, last in pairwise(values):
        step = last - first
        if 0.0 < step < shortest:
            shortest = step
        elif not step >= 0.0:  # true for NaN, too
            raise InvalidGeometry("knots decrease or are not finite")
    return shortest
