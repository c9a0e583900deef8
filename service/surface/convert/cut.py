"""A surface in pieces, and a piece of a surface."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from service.bases import polynomials, triangle, triangle_polynomials
from service.bases.polynomials import Net
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.convert.elevate import raised, raised_triangles
from service.surface.convert.nets import (
    Allowed,
    along,
    changed,
    check_count,
    check_degree,
    check_size,
    moved,
    one_patch,
    one_triangle,
    width,
)
from service.surface.convert.operations import Interval, Restrict, Split, ToTriangle
from service.surface.convert.sharing import Batch, shared
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface


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
    check_size(degree, pieces, allowed, width(patch.channels))
    whole = Batch((patch.control_net, patch.weights), patch.channels)
    batch = whole.changed(partial(_pieces, cuts=cuts, degree=degree))
    titles = surface.parts if isinstance(surface, PatchSurface) else ()
    parts = tuple((title, tuple(range(pieces))) for title, _ in titles)
    return shared(batch, None, parts, surface.up, surface.name)


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
    batch = Batch((patch.control_net, patch.weights), patch.channels).changed(_single)
    return shared(batch, None, surface.parts, surface.up, surface.name)


def split_triangle(
    surface: TriangleSurface | PatchSurface, operation: Split, allowed: Allowed
) -> PatchSurface:
    """Three triangles over shared vertices; of channels of other degrees all take the highest."""
    patch = one_triangle(surface)
    if operation.at is None:
        raise InvalidRequest(
            Issue(
                "missing_field",
                "A triangle is split at barycentric coordinates.",
                "/at",
                "`u` or `v`",
                "[r, s, t]",
            )
        )
    nets = (patch.control_net, *(net for _, _, _, net in patch.channels.each()))
    degree = max(triangle.degree_of(len(net)) for net in nets)
    check_count(3 * triangle.size(degree), allowed, width(patch.channels))
    r, s, t = (x / sum(operation.at) for x in operation.at)
    whole = Batch((patch.control_net, patch.weights), patch.channels)
    batch = whole.changed(partial(_thirds, at=(r, s, t), degree=degree))
    titles = surface.parts if isinstance(surface, PatchSurface) else ()
    parts = tuple((title, (0, 1, 2)) for title, _ in titles)
    return shared(None, batch, parts, surface.up, surface.name)


def split_patches(surface: PatchSurface, operation: Split, allowed: Allowed) -> PatchSurface:
    """A surface of one patch, whichever kind that is."""
    is_triangle = len(surface.triangles) == 1 and not len(surface.patches)
    cut = split_triangle if is_triangle else split_patch
    return cut(surface, operation, allowed)


def triangle_of_patch(
    surface: BezierSurface | PatchSurface, operation: ToTriangle, allowed: Allowed
) -> TriangleSurface:
    """Half of a patch of degree (p, q) as a triangle of degree p + q."""
    patch = one_patch(surface)
    for net in (patch.control_net, *(net for _, _, _, net in patch.channels.each())):
        check_degree(sum(net.shape[:2]) - 2, allowed)
    check_count(triangle.size(sum(patch.degree)), allowed)
    half = partial(_half, upper=operation.half == "upper")
    batch = Batch((patch.control_net, patch.weights), patch.channels).changed(half)
    points, weights = batch.net
    return TriangleSurface(points, weights, surface.up, surface.name, batch.channels)


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
    return raised(_batched(nets), degree, 1)


def _single(net: Net) -> Net:
    """A net as a batch of one."""
    points, weights = net
    return points[np.newaxis], None if weights is None else weights[np.newaxis]


def _thirds(net: Net, at: tuple[float, float, float], degree: int) -> Net:
    """The triangles that a point makes, along a new first axis, raised to a degree."""
    return raised_triangles(_batched(triangle_polynomials.split(net, at)), degree)


def _half(net: Net, *, upper: bool) -> Net:
    """Half of a net; the upper one is the lower one of the net turned by half a turn."""
    points, weights = net
    if upper:
        points, weights = points[::-1, ::-1], None if weights is None else weights[::-1, ::-1]
    return triangle_polynomials.lower_half((points, weights))


def _batched(nets: Sequence[Net]) -> Net:
    """Nets along a new first axis."""
    weights = [weights for _, weights in nets if weights is not None]
    return np.stack([points for points, _ in nets]), np.stack(weights) if weights else None


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
