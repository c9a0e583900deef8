"""Conversions of a B-spline: elevate, restrict, split, transpose, reverse, to Bézier patches."""

from dataclasses import replace

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.errors import InvalidRequest
from service.surface.bspline import BsplineSurface
from service.surface.convert.cut import barycentric_issue, check_inside, check_within
from service.surface.convert.elevate import check_degrees, elevate_nets
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    check_count,
    check_degree,
    count_channel_numbers,
    map_channels,
    share_vertices,
)
from service.surface.convert.operations import (
    Elevate,
    Interval,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    Transpose,
    degree_pointer,
)
from service.surface.convert.refine_spline import (
    Change,
    check_length,
    find_domain,
    refine_over,
    snap_to_knot,
)
from service.surface.group import GroupSurface, Member
from service.surface.knots import find_least_span
from service.surface.patches import PatchSurface


def elevate_spline(
    surface: BsplineSurface, operation: Elevate, allowed: SizeLimits
) -> BsplineSurface:
    """Elevate a B-spline; the multiplicity of each knot increases by the same number."""
    check_degrees(surface.degree, operation.degree)
    for axis, degree in enumerate(operation.degree):
        if degree > surface.degree[axis]:
            where = degree_pointer(operation.degree, axis)
            check_degree(degree, allowed, where)
            domain = find_domain(surface, axis)
            surface = refine_over(surface, Change(axis, degree, domain, where), allowed)
    return surface


def restrict_spline(
    surface: BsplineSurface, operation: Restrict, allowed: SizeLimits
) -> BsplineSurface:
    """Restrict a B-spline to a piece of its domain, which keeps its parameters and knots.

    A direction that is cut becomes clamped. A parameter that differs from a knot by rounding alone
    counts as this knot.
    """
    pieces: list[tuple[str, Interval | None]] = []
    for axis, interval in enumerate((operation.u, operation.v)):
        ends = None
        if interval is not None:
            ends = (
                snap_to_knot(surface, axis, interval[0]),
                snap_to_knot(surface, axis, interval[1]),
            )
            min_length = find_least_span(*find_domain(surface, axis))
            check_length(ends[1] - ends[0], min_length, f"/{'uv'[axis]}")
        pieces.append(("uv"[axis], ends))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None:
            check_within(name, piece, find_domain(surface, axis))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None and piece != find_domain(surface, axis):
            change = Change(axis, surface.degree[axis], piece, f"/{name}")
            surface = refine_over(surface, change, allowed)
    return surface


def split_spline(surface: BsplineSurface, operation: Split, allowed: SizeLimits) -> GroupSurface:
    """Split a B-spline into a group of two or four.

    Piece k along u and l along v has the number k · (number of pieces along v) + l.
    """
    if operation.at is not None:
        raise InvalidRequest(barycentric_issue())
    cuts = [
        (name, None if t is None else snap_to_knot(surface, axis, t))
        for axis, (name, t) in enumerate((("u", operation.u), ("v", operation.v)))
    ]
    for axis, (name, t) in enumerate(cuts):
        if t is not None:
            check_inside(name, t, find_domain(surface, axis))
    pieces = [surface]
    for axis, (name, t) in enumerate(cuts):
        if t is not None:
            first, last = find_domain(surface, axis)
            changes = [
                Change(axis, surface.degree[axis], interval, f"/{name}")
                for interval in ((first, t), (t, last))
            ]
            pieces = [refine_over(piece, change, allowed) for piece in pieces for change in changes]
    return GroupSurface(tuple(map(Member, pieces)), surface.up, surface.name)


def transpose_spline(
    surface: BsplineSurface, _operation: Transpose, _allowed: SizeLimits
) -> BsplineSurface:
    """Exchange u and v of a B-spline: S'(u, v) = S(v, u)."""
    weights = None if surface.weights is None else surface.weights.swapaxes(0, 1)
    return replace(
        surface,
        control_net=surface.control_net.swapaxes(0, 1),
        degree=surface.degree[::-1],
        knots=surface.knots[::-1],
        weights=weights,
        channels=map_channels(surface.channels, lambda net: net.swapaxes(0, 1)),
    )


def reverse_spline(
    surface: BsplineSurface, operation: Reverse, _allowed: SizeLimits
) -> BsplineSurface:
    """Reverse u or v of a B-spline.

    Given knots become negative: S'(−u, v) = S(u, v), which needs no rounding. Named knots keep
    their domain [0, b]: S'(b − u, v) = S(u, v).
    """
    axis = "uv".index(operation.direction)
    knots = list(surface.knots)
    vector = knots[axis]
    order = np.arange(surface.control_net.shape[axis])[::-1]
    if not isinstance(vector, str):
        knots[axis] = 0.0 - vector[::-1]  # not −x, which would make −0 of 0
    elif vector == "periodic":
        # The p points that `wrap_points` repeats at the end must come first after the reversal.
        order = np.roll(order, surface.degree[axis])
    counts = surface.control_net.shape[:2]
    weights = None if surface.weights is None else np.take(surface.weights, order, axis)
    return replace(
        surface,
        control_net=np.take(surface.control_net, order, axis),
        knots=(knots[0], knots[1]),
        weights=weights,
        # A channel with another number of control points is one Bézier net over the domain.
        channels=map_channels(
            surface.channels,
            lambda net: (
                np.take(net, order, axis) if net.shape[:2] == counts else np.flip(net, axis)
            ),
        ),
    )


def bezier_of_spline(
    surface: BsplineSurface, _operation: ToBezier, allowed: SizeLimits
) -> PatchSurface:
    """The Bézier patches of the spans of a B-spline, over shared vertices.

    Points and channels are elevated to the highest degree among them.
    """
    counts = surface.control_net.shape[:2]
    degrees = [surface.degree]
    degrees += [
        (net.shape[0] - 1, net.shape[1] - 1)
        for _, _, _, net in surface.channels.each()
        if net.shape[:2] != counts
    ]
    degree = max(p for p, _ in degrees), max(q for _, q in degrees)
    rows, columns = (  # numbers of spans along u and v
        len(knot.spans(knots, n))
        for knots, n in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    p, q = degree
    check_degree(max(p, q), allowed)
    point_count = rows * columns * (p + 1) * (q + 1)
    check_count(point_count, allowed, count_channel_numbers(surface.channels))
    (batch,) = surface.lower().batches
    lowered_channels = iter(batch.channels)

    def lower_channel(net: FloatArray) -> FloatArray:
        values = next(lowered_channels).nets
        if net.shape[:2] != counts:  # one Bézier net over the domain, cut into the spans
            values = _join_nets(values.reshape(rows, columns, *values.shape[1:]).copy())
            values = values.reshape(rows * columns, *values.shape[2:])
        # Rounding must not move values out of the range of the net: colours must not exceed 1.
        values = np.clip(values, net.min(axis=(0, 1)), net.max(axis=(0, 1)))
        return elevate_nets((values, None), degree, 1)[0]

    channels = map_channels(surface.channels, lower_channel)
    net = elevate_nets((batch.points, batch.weights), degree, 1)
    return share_vertices(Batch(net, channels), None, (), surface.up, surface.name)


def _join_nets(nets: FloatArray) -> FloatArray:
    """Make the nets of one polynomial over neighbouring spans equal, bit for bit, where they meet.

    `nets`, of degree (a, b) and shape (rows, columns, a+1, b+1, d), is overwritten and returned.
    """
    nets[1:, :, 0] = nets[:-1, :, -1]
    nets[:, 1:, :, 0] = nets[:, :-1, :, -1]
    return nets
