"""Splits Bézier patches and triangles, restricts patches, and makes triangles of their halves."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import chain

from service.bases import polynomials, triangle
from service.bases.polynomials import Net, map_net, stack_nets
from service.errors import InvalidRequest, Issue, format_number
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.convert.elevate import elevate_nets, elevate_triangle_nets
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    add_batch_axis,
    apply_along,
    check_count,
    check_degree,
    move_axis,
    require_patch,
    require_triangle,
    share_vertices,
)
from service.surface.convert.operations import Interval, Restrict, Split, ToTriangle
from service.surface.patches import PatchSurface

END_ROUNDING = 2.0**-49
"""A parameter outside of [0, 1] by at most this, some units in the last place, is its end."""


def split_patch(
    surface: BezierSurface | PatchSurface, operation: Split, allowed: SizeLimits
) -> PatchSurface:
    """Split a patch into two or four, which form a surface of patches.

    Piece k along u and l along v has the number k · (number of pieces along v) + l. In a surface of
    patches, points and channels have the same degree, so all are elevated to the highest degree
    among them.
    """
    batch = Batch.of_net(require_patch(surface))
    refuse_barycentric(operation)
    cuts = operation.u, operation.v
    for name, t in zip("uv", cuts, strict=True):
        if t is not None:
            check_inside(name, t, (0.0, 1.0))
    degree = highest_degree(net.shape for net in batch.nets)
    pieces = 2 ** sum(t is not None for t in cuts)
    check_degree(max(degree), allowed)
    check_count(pieces * (degree[0] + 1) * (degree[1] + 1), allowed, batch.channel_numbers)
    batch = batch.apply(partial(_cut_net, cuts=cuts, degree=degree))
    return _share_pieces(surface, pieces, batch, None)


def restrict_bezier(
    surface: BezierSurface, operation: Restrict, _allowed: SizeLimits
) -> BezierSurface:
    """Restrict a patch to a piece of its domain; the piece is a patch of the same degree."""
    u, v = (
        None if piece is None else (_round_to_end(piece[0]), _round_to_end(piece[1]))
        for piece in (operation.u, operation.v)
    )
    operation = replace(operation, u=u, v=v)
    for name, piece in (("u", u), ("v", v)):
        if piece is not None:
            check_within(name, piece, (0.0, 1.0))
    batch = Batch.of_net(surface).apply(partial(_restrict_net, operation=operation))
    (points, weights), channels = batch
    return replace(surface, control_net=points, weights=weights, channels=channels)


def restrict_patches(
    surface: PatchSurface, operation: Restrict, allowed: SizeLimits
) -> PatchSurface:
    """Restrict a surface of one patch to a piece of its domain."""
    patch = restrict_bezier(require_patch(surface), operation, allowed)
    batch = Batch.of_net(patch).apply(add_batch_axis)
    return share_vertices(batch, None, surface.parts, surface.up, surface.name)


def split_triangle(
    surface: TriangleSurface | PatchSurface, operation: Split, allowed: SizeLimits
) -> PatchSurface:
    """Split a triangle at a point into three, which form a surface of patches.

    Points and channels are elevated to the highest degree among them.
    """
    batch = Batch.of_net(require_triangle(surface))
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
    degree = max(triangle.degree_of(len(net)) for net in batch.nets)
    check_count(3 * triangle.count_points(degree), allowed, batch.channel_numbers)
    r, s, t = (x / sum(operation.at) for x in operation.at)
    batch = batch.apply(partial(_cut_triangle, point=(r, s, t), degree=degree))
    return _share_pieces(surface, 3, None, batch)


def split_patches(surface: PatchSurface, operation: Split, allowed: SizeLimits) -> PatchSurface:
    """Split a surface of one patch or of one triangle."""
    is_triangle = len(surface.triangles) == 1 and not len(surface.patches)
    split = split_triangle if is_triangle else split_patch
    return split(surface, operation, allowed)


def triangle_of_patch(
    surface: BezierSurface | PatchSurface, operation: ToTriangle, allowed: SizeLimits
) -> TriangleSurface:
    """The lower or upper half of a patch of degree (p, q) as a triangle of degree p + q."""
    patch = require_patch(surface)
    batch = Batch.of_net(patch)
    for net in batch.nets:
        check_degree(sum(net.shape[:2]) - 2, allowed)
    check_count(triangle.count_points(sum(patch.degree)), allowed)
    half = partial(_take_half, is_upper=operation.half == "upper")
    (points, weights), channels = batch.apply(half)
    return TriangleSurface(points, weights, surface.up, surface.name, channels)


def _share_pieces(
    surface: BezierSurface | TriangleSurface | PatchSurface,
    count: int,
    grids: Batch | None,
    triangles: Batch | None,
) -> PatchSurface:
    """The pieces of a patch as one surface.

    A surface of one patch has at most one part: the patch, under a name. Then all pieces form this
    part.
    """
    named_parts = surface.parts if isinstance(surface, PatchSurface) else ()
    parts = tuple((name, tuple(range(count))) for name, _ in named_parts)
    return share_vertices(grids, triangles, parts, surface.up, surface.name)


def highest_degree(shapes: Iterable[tuple[int, ...]]) -> tuple[int, int]:
    """The highest degree p and the highest degree q among nets of shapes (p+1, q+1, …)."""
    rows, columns = zip(*(shape[:2] for shape in shapes), strict=True)
    return max(rows) - 1, max(columns) - 1


def check_inside(
    name: str,
    parameter: float,
    domain: Interval,
    message: str = "A surface is split inside its domain.",
) -> None:
    """Refuse a parameter that is not strictly inside the domain: one piece would be empty."""
    first, last = domain
    if not first < parameter < last:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                message,
                f"/{name}",
                format_number(parameter),
                f"above {format_number(first)} and below {format_number(last)}",
            )
        )


def check_within(name: str, piece: Interval, domain: Interval) -> None:
    """Refuse an interval that is not inside the domain."""
    for end, parameter in enumerate(piece):
        if not domain[0] <= parameter <= domain[1]:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "A piece lies in the surface's domain.",
                    f"/{name}/{end}",
                    format_number(parameter),
                    f"{format_number(domain[0])} to {format_number(domain[1])}",
                )
            )


def _round_to_end(parameter: float) -> float:
    """The parameter; 0 or 1 if it is outside of [0, 1] by a few roundings."""
    nearest = min(max(parameter, 0.0), 1.0)
    return nearest if abs(parameter - nearest) <= END_ROUNDING else parameter


def _cut_net(net: Net, cuts: tuple[float | None, float | None], degree: tuple[int, int]) -> Net:
    """The nets of the pieces after one or two cuts, elevated, stacked along a new first axis."""
    nets = [net]
    for axis, t in enumerate(cuts):
        if t is not None:
            nets = list(chain.from_iterable(_split_along(net, axis, t) for net in nets))
    return elevate_nets(stack_nets(nets), degree, first_axis=1)


def _cut_triangle(net: Net, point: tuple[float, float, float], degree: int) -> Net:
    """The nets of the three triangles around a point, elevated, stacked along a new first axis."""
    return elevate_triangle_nets(stack_nets(triangle.split(net, point)), degree)


def _take_half(net: Net, *, is_upper: bool) -> Net:
    """Half of a tensor-product net as the net of a triangle.

    The upper half is the lower half of the net after u and v are both reversed.
    """
    if is_upper:
        net = map_net(net, lambda values: values[::-1, ::-1])
    return triangle.lower_half(net)


def _split_along(net: Net, axis: int, t: float) -> tuple[Net, Net]:
    """Split a net at the parameter t of one axis: the nets below and above t."""
    low_net, high_net = polynomials.split(move_axis(net, 0, axis), t)
    return move_axis(low_net, axis, 0), move_axis(high_net, axis, 0)


def _restrict_net(net: Net, operation: Restrict) -> Net:
    """Restrict a net to the rectangle of an operation, a part of [0, 1]²."""
    for axis, piece in enumerate((operation.u, operation.v)):
        if piece is not None:
            net = apply_along(
                net, axis, partial(polynomials.restrict, first=piece[0], last=piece[1])
            )
    return net


def refuse_barycentric(operation: Split) -> None:
    """Refuse to split a surface that is not a triangle at barycentric coordinates."""
    if operation.at is not None:
        raise InvalidRequest(
            Issue(
                "unknown_field",
                "Only triangles have barycentric coordinates.",
                "/at",
                "barycentric coordinates",
                "`u`, `v` or both",
            )
        )
