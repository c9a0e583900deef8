"""Helpers of the conversions: nets along an axis, surfaces of one patch, limits of size."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.polynomials import Net
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.surface.bezier import BezierSurface
from service.surface.channels import MAX_NUMBERS, Channels
from service.surface.checks import MAX_DEGREE
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface

NetChange: TypeAlias = Callable[[Net], Net]


@dataclass(frozen=True, slots=True)
class SizeLimits:
    """The most control points, and the highest degree, after every operation of a conversion."""

    control_points: int = 1_000_000
    degree: int = MAX_DEGREE


def apply_along(net: Net, axis: int, change: NetChange) -> Net:
    """Apply a function of nets, which works along the first axis, along another axis of a net."""
    return move_axis(change(move_axis(net, 0, axis)), axis, 0)


def move_axis(net: Net, target: int, axis: int) -> Net:
    """The net with its axis `axis` moved to the position `target`."""
    points, weights = net
    return (
        np.moveaxis(points, axis, target),
        None if weights is None else np.moveaxis(weights, axis, target),
    )


def add_batch_axis(net: Net) -> Net:
    """The net as a batch of one net."""
    points, weights = net
    return points[np.newaxis], None if weights is None else weights[np.newaxis]


def map_channels(channels: Channels, change: Callable[[FloatArray], FloatArray]) -> Channels:
    """The channels after `change` was applied to the net of each."""
    return Channels(
        None if channels.colors is None else change(channels.colors),
        None if channels.uvs is None else change(channels.uvs),
        tuple((name, change(net)) for name, net in channels.attributes),
    )


def require_patch(surface: BezierSurface | PatchSurface) -> BezierSurface:
    """A surface of one patch as a Bézier surface.

    Raises
    ------
    InvalidRequest
        `several_patches`.
    """
    if isinstance(surface, BezierSurface):
        return surface
    if len(surface.patches) != 1 or len(surface.triangles):
        grid_count, triangle_count = len(surface.patches), len(surface.triangles)
        raise InvalidRequest(
            Issue(
                "several_patches",
                "The patches of this surface have no parameters in common.",
                "",
                f"{count_nouns(grid_count, 'four-sided patches')} and "
                f"{count_nouns(triangle_count, 'triangles')}",
                "a surface of one four-sided patch, or a B-spline",
            )
        )
    grid = surface.patches[0]
    weights = None if surface.weights is None else surface.weights[grid]
    channels = map_channels(surface.channels, lambda values: values[grid])
    return BezierSurface(surface.vertices[grid], weights, surface.up, surface.name, channels)


def require_triangle(surface: TriangleSurface | PatchSurface) -> TriangleSurface:
    """A surface of one triangle, and of nothing else, as a triangle surface.

    The caller checks that a surface of patches is of this form (`split_patches`).
    """
    if isinstance(surface, TriangleSurface):
        return surface
    grid = surface.triangles[0]
    weights = None if surface.weights is None else surface.weights[grid]
    channels = map_channels(surface.channels, lambda values: values[grid])
    return TriangleSurface(surface.vertices[grid], weights, surface.up, surface.name, channels)


def count_channel_numbers(channels: Channels) -> int:
    """How many numbers all channels together have at one point of the surface."""
    return sum(net.shape[-1] for _, _, _, net in channels.each())


def check_count(count: int, allowed: SizeLimits, channel_numbers: int = 0) -> None:
    """Refuse too many control points.

    `channel_numbers` is the number of numbers that all channels have at each control point.
    """
    # The 4 are x, y, z and the weight.
    max_count = min(allowed.control_points, MAX_NUMBERS // (4 + channel_numbers))
    if count > max_count:
        raise TooLarge(
            Issue(
                "too_many_control_points",
                "The surface would have more control points, or more values at them, than this "
                "service takes.",
                "",
                count_nouns(count, "control points"),
                f"at most {max_count}",
            )
        )


def check_degree(degree: int, allowed: SizeLimits, where: str = "") -> None:
    """Refuse a degree above the limit."""
    if degree > allowed.degree:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "The degree of the surface would be too high to be useful.",
                where,
                f"degree {degree}",
                f"degrees up to {allowed.degree}",
            )
        )
