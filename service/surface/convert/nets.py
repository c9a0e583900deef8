"""What the operations do to nets and to surfaces that are one patch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.polynomials import Net
from service.errors import InvalidRequest, Issue, TooLarge
from service.surface.bezier import BezierSurface
from service.surface.channels import MAX_NUMBERS, Channels
from service.surface.checks import MAX_DEGREE
from service.surface.convert.operations import degree_place
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface

Change: TypeAlias = Callable[[Net], Net]


@dataclass(frozen=True, slots=True)
class Allowed:
    """How large a surface may be, at every step of a conversion."""

    control_points: int = 1_000_000
    degree: int = MAX_DEGREE


def along(net: Net, axis: int, change: Change) -> Net:
    """A net changed in the direction of one axis, by a function that works on the first."""
    return moved(change(moved(net, 0, axis)), axis, 0)


def moved(net: Net, to: int, axis: int) -> Net:
    """The net with one of its axes at another place."""
    points, weights = net
    return (
        np.moveaxis(points, axis, to),
        None if weights is None else np.moveaxis(weights, axis, to),
    )


def changed(channels: Channels, change: Callable[[FloatArray], FloatArray]) -> Channels:
    """The channels with each net changed by the same function."""
    return Channels(
        None if channels.colors is None else change(channels.colors),
        None if channels.uvs is None else change(channels.uvs),
        tuple((name, change(net)) for name, net in channels.attributes),
    )


def one_patch(surface: BezierSurface | PatchSurface) -> BezierSurface:
    """The patch that a surface is.

    Raises
    ------
    InvalidRequest
        `several_patches`.
    """
    if isinstance(surface, BezierSurface):
        return surface
    if len(surface.patches) != 1 or len(surface.triangles):
        count = len(surface.patches) + len(surface.triangles)
        raise InvalidRequest(
            Issue(
                "several_patches",
                "The patches of this surface have no parameters in common.",
                "",
                f"{count} patches, {len(surface.triangles)} of them triangles",
                "a surface of one four-sided patch, or a B-spline",
            )
        )
    grid = surface.patches[0]
    weights = None if surface.weights is None else surface.weights[grid]
    channels = changed(surface.channels, lambda values: values[grid])
    return BezierSurface(surface.vertices[grid], weights, surface.up, surface.name, channels)


def one_triangle(surface: TriangleSurface | PatchSurface) -> TriangleSurface:
    """The triangle that a surface is, if it is no more than one."""
    if isinstance(surface, TriangleSurface):
        return surface
    grid = surface.triangles[0]
    weights = None if surface.weights is None else surface.weights[grid]
    channels = changed(surface.channels, lambda values: values[grid])
    return TriangleSurface(surface.vertices[grid], weights, surface.up, surface.name, channels)


def width(channels: Channels) -> int:
    """Numbers of all channels at one place."""
    return sum(net.shape[-1] for _, _, _, net in channels.each())


def check_size(degree: tuple[int, int], patches: int, allowed: Allowed, beside: int = 0) -> None:
    """Refuses grids that would have a higher degree, or more numbers, than a surface may have."""
    for axis, n in enumerate(degree):
        check_degree(n, allowed, degree_place(degree, axis))
    check_count(patches * (degree[0] + 1) * (degree[1] + 1), allowed, beside)


def check_count(count: int, allowed: Allowed, beside: int = 0) -> None:
    """Refuses more control points, or numbers beside their four, than a surface may have."""
    most = min(allowed.control_points, MAX_NUMBERS // (4 + beside))
    if count > most:
        raise TooLarge(
            Issue(
                "too_many_control_points",
                "The surface would have more control points, or more values at them, than this "
                "service takes.",
                "",
                f"{count} control points",
                f"at most {most}",
            )
        )


def check_degree(degree: int, allowed: Allowed, where: str = "") -> None:
    """Refuses a degree that no surface may have."""
    if degree > allowed.degree:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "The surface would be of a degree that is of no use.",
                where,
                f"degree {degree}",
                f"degrees up to {allowed.degree}",
            )
        )
