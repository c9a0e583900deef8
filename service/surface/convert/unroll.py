"""Periodic B-splines over two periods, so that a piece over the seam is a piece of one domain."""

from dataclasses import replace
from math import floor

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, format_number
from service.surface.bspline import BsplineSurface
from service.surface.convert.nets import map_channels
from service.surface.convert.operations import Interval
from service.surface.convert.refine_spline import find_domain


def is_over_seam(surface: BsplineSurface, axis: int, piece: Interval) -> bool:
    """Whether the spline is periodic along u or v, and a piece leaves its domain [0, b] there."""
    low, high = find_domain(surface, axis)
    knots = surface.knots[axis]
    is_periodic = isinstance(knots, str) and knots == "periodic"
    return is_periodic and not low <= piece[0] <= piece[1] <= high


def unroll(surface: BsplineSurface, axis: int, piece: Interval) -> BsplineSurface:
    """The periodic spline over two periods that contain a piece; its parameters stay the same.

    Raises
    ------
    InvalidRequest
        `out_of_range`: the piece does not begin in [−b, b], or is longer than a period b. Pointers
        are relative to the operation.
    """
    _, period = find_domain(surface, axis)
    first, last = piece
    name = "uv"[axis]
    if not -period <= first <= period:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "A piece of a periodic surface begins at most one period below the domain.",
                f"/{name}/0",
                format_number(first),
                f"{format_number(-period)} to {format_number(period)}",
            )
        )
    if last - first > period:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "A piece of a periodic surface is at most one period long.",
                f"/{name}/1",
                format_number(last),
                f"at most {format_number(first + period)}",
            )
        )
    count, degree = surface.control_net.shape[axis], surface.degree[axis]
    begin = floor(first / period) * count
    index = np.arange(begin, begin + 2 * count + degree)
    counts = surface.control_net.shape[:2]

    def repeat(net: FloatArray) -> FloatArray:
        return np.take(net, index, axis=axis, mode="wrap")

    def repeat_channel(net: FloatArray) -> FloatArray:
        if net.shape[:2] != counts:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "Colours, texture coordinates or attributes of another degree than the surface "
                    "end at its seam.",
                    f"/{name}",
                    "a piece over the seam",
                    "a piece of the domain",
                )
            )
        return repeat(net)

    knots = list(surface.knots)
    knots[axis] = knot.uniform_knots(len(index), degree) + float(begin)
    return replace(
        surface,
        control_net=repeat(surface.control_net),
        knots=(knots[0], knots[1]),
        weights=None if surface.weights is None else repeat(surface.weights),
        channels=map_channels(surface.channels, repeat_channel),
    )
