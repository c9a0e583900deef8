"""Computes a B-spline over a piece of its domain, in a higher degree and over more knots.

B-splines are elevated, restricted, refined and split by such changes, each along one axis:
multiplicities of knots increase, and the new control points are weighted means of the old ones.
"""

from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from service.bases import knots as knot
from service.bases import polynomials
from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray
from service.bases.blossoms import find_refinement, raise_knots
from service.bases.closing import close_rows
from service.bases.polynomials import Net, map_net
from service.errors import InvalidRequest, Issue, TooLarge
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_DEGREE
from service.surface.convert.nets import SizeLimits, apply_along, check_count, map_channels
from service.surface.convert.operations import Interval
from service.surface.knots import check_bezier_points, find_least_span

Value = TypeVar("Value")

MAX_WORK = 1 << 26
"""The most work along one direction, which takes about ten seconds: the number of new control
points × the old degree × the new degree."""


def snap_to_knot(surface: BsplineSurface, axis: int, parameter: float) -> float:
    """The knot nearest to a parameter if they differ by rounding alone, else the parameter."""
    breaks = knot.breaks(surface.knot_vectors[axis], surface.degree[axis])
    nearest = float(breaks[np.abs(breaks - parameter).argmin()])
    is_knot = abs(parameter - nearest) < find_least_span(*find_domain(surface, axis))
    return nearest if is_knot else parameter


def find_domain(surface: BsplineSurface, axis: int) -> Interval:
    """First and last parameter along u or v."""
    return knot.domain(surface.knot_vectors[axis], surface.degree[axis])


def refine_over(
    surface: BsplineSurface,
    axis: int,
    degree: int,
    piece: Interval,
    allowed: SizeLimits,
    *,
    where: str,
    new_knots: tuple[float, ...] = (),
) -> BsplineSurface:
    """Restrict a spline to a piece of its domain along one axis, and elevate it there.

    The new knot vector of this axis is clamped, and has `new_knots` too. `where` is the JSON
    pointer to the field of the operation that asks for this.
    """
    knots, old_degree = surface.knot_vectors[axis], surface.degree[axis]
    target = np.sort(np.append(raise_knots(knots, old_degree, degree, *piece), new_knots))
    shortest = float(np.diff(knot.breaks(target, degree)).min())
    check_length(shortest, find_least_span(*find_domain(surface, axis)), where)
    new_count = len(target) - degree - 1
    old_counts = surface.control_net.shape[:2]
    # A channel with as many control points is a spline over the same knots; any other is a Bézier
    # net, which gets no new control points.
    channel_numbers = sum(
        n.shape[-1] for _, _, _, n in surface.channels.each() if n.shape[:2] == old_counts
    )
    check_count(new_count * old_counts[1 - axis], allowed, channel_numbers)
    degrees = _change_one(surface.degree, axis, degree)
    check_bezier_points(_change_one(surface.knot_vectors, axis, target), degrees, where)
    _check_work(new_count * degree * old_degree, where)
    # New control point j is the mean of the rows index[:, j], with the weights shares[:, j].
    index, shares = find_refinement(knots, old_degree, target, degree)
    is_periodic = isinstance(surface.knots[axis], str) and surface.knots[axis] == "periodic"

    def refine(net: Net) -> Net:
        if is_periodic:
            # `knot_vectors` is for a net whose first p rows are repeated at its end.
            net = map_net(net, lambda values: knot.wrap_points(values, old_degree))
        return close_rows(combine(*net, index, shares), net, index, shares)

    points, weights = apply_along((surface.control_net, surface.weights), axis, refine)
    new_counts = _change_one((old_counts[0], old_counts[1]), axis, new_count)
    low, high = find_domain(surface, axis)
    # The piece in the parameters of a Bézier channel, which run from 0 to 1.
    ends = tuple((t - low) / (high - low) for t in piece)

    def change_channel(net: FloatArray) -> FloatArray:
        if net.shape[:2] == old_counts:
            return apply_along((net, None), axis, refine)[0]
        restrict = partial(polynomials.restrict, first=ends[0], last=ends[1])
        return avoid_shape(apply_along((net, None), axis, restrict)[0], new_counts)

    return replace(
        surface,
        control_net=points,
        degree=degrees,
        knots=_change_one(surface.knots, axis, target),
        weights=weights,
        channels=map_channels(surface.channels, change_channel),
    )


def _change_one(pair: tuple[Value, Value], axis: int, value: Value) -> tuple[Value, Value]:
    """The values for u and v, with another value for one of them."""
    return (value, pair[1]) if axis == 0 else (pair[0], value)


def avoid_shape(net: FloatArray, counts: tuple[int, int]) -> FloatArray:
    """The Bézier net of a channel, elevated by one degree if its shape begins with `counts`.

    `counts` are the rows and columns of the control net: a channel with as many would count as a
    spline (`BsplineSurface.channels`).
    """
    if net.shape[:2] != counts:
        return net
    # The degree along an axis is net.shape[axis] − 1. Elevate along u, unless this degree is
    # already the highest.
    axis = 0 if len(net) <= MAX_DEGREE else 1
    return apply_along((net, None), axis, partial(polynomials.elevate, degree=net.shape[axis]))[0]


def _check_work(work: int, where: str) -> None:
    """Refuse a conversion that would take longer than about ten seconds."""
    if work > MAX_WORK:
        raise TooLarge(
            Issue(
                "too_many_knots",
                "The conversion would take too long for this number of knots and these degrees.",
                where,
                f"{work} = control points × degree before × degree after",
                f"at most {MAX_WORK}",
            )
        )


def check_length(shortest: float, min_length: float, where: str) -> None:
    """Refuse a piece shorter than `min_length`: rounding could make its parameters equal."""
    if shortest < min_length:
        raise InvalidRequest(
            Issue(
                "knots_too_close",
                "The cut is too near to a knot: the piece between them would be too short.",
                where,
                f"{shortest:.3g} from the next knot",
                f"the knot itself, or at least {min_length:.3g} from it",
            )
        )
