"""A surface in pieces, and a piece of a surface."""

from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from service.bases import polynomials
from service.bases.polynomials import Net
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.convert.elevate import raised
from service.surface.convert.nets import Allowed, along, changed, check_size, moved, one_patch
from service.surface.convert.operations import Interval, Restrict, Split
from service.surface.convert.sharing import shared
from service.surface.patches import PatchSurface


def split_patch(
    surface: BezierSurface | PatchSurface, operation: Split, allowed: Allowed
) -> PatchSurface:
    """Two patches, or four: piece (k, l) has number k · (pieces along v) + l.

    Patches carry channels in their own degree: of degrees that differ all take the highest.
    """
    patch = one_patch(surface)
    if operation.at is not None:
        raise InvalidRequest(not_barycentric())
    cuts = operation.u, operation.v
    for name, t in zip("uv", cuts, strict=True):
        if t is not None:
            check_inside(name, t, (0.0, 1.0))
    nets = (patch.control_net, *(net for _, _, _, net in patch.channels.each()))
    rows, columns = (max(net.shape[axis] for net in nets) for axis in (0, 1))
    pieces = 2 ** sum(t is not None for t in cuts)
    degree = rows - 1, columns - 1
    check_size(degree, pieces, allowed, patch.channels)
    net = _pieces((patch.control_net, patch.weights), cuts, degree)
    channels = changed(patch.channels, lambda values: _pieces((values, None), cuts, degree)[0])
    titles = surface.parts if isinstance(surface, PatchSurface) else ()
    parts = tuple((title, tuple(range(pieces))) for title, _ in titles)
    return shared(net, channels, parts, surface.up, surface.name)


def restrict_bezier(
    surface: BezierSurface, operation: Restrict, _allowed: Allowed
) -> BezierSurface:
    """The piece as a patch of the same degree over [0, 1]²."""
    for name, piece in (("u", operation.u), ("v", operation.v)):
        if piece is not None:
            check_within(name, piece, (0.0, 1.0))
    points, weights = _piece((surface.control_net, surface.weights), operation)
    channels = changed(surface.channels, lambda values: _piece((values, None), operation)[0])
    return replace(surface, control_net=points, weights=weights, channels=channels)


def restrict_patches(surface: PatchSurface, operation: Restrict, allowed: Allowed) -> PatchSurface:
    """The same of a surface of one patch."""
    patch = restrict_bezier(one_patch(surface), operation, allowed)
    weights = None if patch.weights is None else patch.weights[np.newaxis]
    net = patch.control_net[np.newaxis], weights
    channels = changed(patch.channels, lambda values: values[np.newaxis])
    return shared(net, channels, surface.parts, surface.up, surface.name)


def check_inside(name: str, parameter: float, domain: Interval) -> None:
    """Refuses a parameter that is not strictly inside the domain: one side would be empty."""
    first, last = domain
    if not first < parameter < last:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "A surface is split inside its domain.",
                f"/{name}",
                f"{parameter:.6g}",
                f"above {first:.6g} and below {last:.6g}",
            )
        )


def check_within(name: str, piece: Interval, domain: Interval) -> None:
    """Refuses an interval that leaves the domain."""
    for end, parameter in enumerate(piece):
        if not domain[0] <= parameter <= domain[1]:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "A piece lies in the surface's domain.",
                    f"/{name}/{end}",
                    f"{parameter:.6g}",
                    f"{domain[0]:.6g} to {domain[1]:.6g}",
                )
            )


def _pieces(net: Net, cuts: tuple[float | None, float | None], degree: tuple[int, int]) -> Net:
    """The pieces that one or two cuts make, along a new first axis, raised to a degree."""
    nets = [net]
    for axis, t in enumerate(cuts):
        if t is not None:
            nets = list(chain.from_iterable(_halves(net, axis, t) for net in nets))
    weights = [weights for _, weights in nets if weights is not None]
    batch = np.stack([points for points, _ in nets]), np.stack(weights) if weights else None
    return raised(batch, degree, 1)


def _halves(net: Net, axis: int, t: float) -> tuple[Net, Net]:
    """Both sides of a cut across one axis."""
    first, last = polynomials.split(moved(net, 0, axis), t)
    return moved(first, axis, 0), moved(last, axis, 0)


def _piece(net: Net, operation: Restrict) -> Net:
    """The net over the piece, a rectangle of [0, 1]²."""
    for axis, piece in enumerate((operation.u, operation.v)):
        if piece is not None:
            net = along(net, axis, partial(polynomials.restrict, first=piece[0], last=piece[1]))
    return net


def not_barycentric() -> Issue:
    """The issue of a point of a triangle where there is none."""
    return Issue(
        "unknown_field",
        "Only triangles have barycentric coordinates.",
        "/at",
        "barycentric coordinates",
        "`u`, `v` or both",
    )
