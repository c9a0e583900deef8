"""Conversions of a B-spline.

Elevate, restrict, insert knots, split, transpose, reverse, to Bézier patches.
"""

from dataclasses import replace

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue
from service.surface.bspline import BsplineSurface
from service.surface.convert.cut import (
    check_inside,
    check_within,
    highest_degree,
    refuse_barycentric,
)
from service.surface.convert.elevate import check_degrees, elevate_nets
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    check_count,
    check_degree,
    map_channels,
    share_vertices,
)
from service.surface.convert.operations import (
    Elevate,
    Insert,
    Interval,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    Transpose,
    degree_pointer,
)
from service.surface.convert.refine_spline import (
    check_length,
    find_domain,
    refine_over,
    snap_to_knot,
)
from service.surface.convert.unroll import is_over_seam, unroll
from service.surface.group import GroupSurface
from service.surface.knots import find_least_span
from service.surface.member import Member
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
            surface = refine_over(surface, axis, degree, domain, allowed, where=where)
    return surface


def restrict_spline(
    surface: BsplineSurface, operation: Restrict, allowed: SizeLimits
) -> BsplineSurface:
    """Restrict a B-spline to a piece of its domain, which keeps its parameters and knots.

    A direction that is cut becomes clamped. A parameter that differs from a knot by rounding alone
    counts as this knot. A piece of a direction that is periodic may begin one period below the
    domain, and go over the seam.
    """
    pieces: dict[int, Interval] = {}
    for axis, interval in enumerate((operation.u, operation.v)):
        if interval is not None:
            first, last = (snap_to_knot(surface, axis, t) for t in interval)
            if is_over_seam(surface, axis, (first, last)):
                surface = unroll(surface, axis, (first, last))
                first, last = (snap_to_knot(surface, axis, t) for t in interval)
            min_length = find_least_span(*find_domain(surface, axis))
            check_length(last - first, min_length, f"/{'uv'[axis]}")
            pieces[axis] = first, last
    for axis, piece in pieces.items():
        check_within("uv"[axis], piece, find_domain(surface, axis))
    for axis, piece in pieces.items():
        if piece != find_domain(surface, axis):
            degree, where = surface.degree[axis], f"/{'uv'[axis]}"
            surface = refine_over(surface, axis, degree, piece, allowed, where=where)
    return surface


def insert_knots(surface: BsplineSurface, operation: Insert, allowed: SizeLimits) -> BsplineSurface:
    """Insert a knot along u, along v or along both; the direction becomes clamped.

    Knots of a multiplicity up to the degree keep the surface continuous.
    """
    places = {
        axis: snap_to_knot(surface, axis, t)
        for axis, t in enumerate((operation.u, operation.v))
        if t is not None
    }
    for axis, t in places.items():
        degree, name = surface.degree[axis], "uv"[axis]
        check_inside(name, t, find_domain(surface, axis), "A knot is inserted inside the domain.")
        count = int(np.count_nonzero(surface.knot_vectors[axis] == t))
        if count >= degree:
            raise InvalidRequest(
                Issue(
                    "knot_multiplicity",
                    "With more equal knots than its degree, the surface could have a gap there.",
                    f"/{name}",
                    f"the multiplicity {count} already",
                    f"below the degree, {degree}",
                )
            )
    for axis, t in places.items():
        domain, degree = find_domain(surface, axis), surface.degree[axis]
        where = f"/{'uv'[axis]}"
        surface = refine_over(surface, axis, degree, domain, allowed, where=where, new_knots=(t,))
    return surface


def split_spline(surface: BsplineSurface, operation: Split, allowed: SizeLimits) -> GroupSurface:
    """Split a B-spline into a group of two or four.

    Piece k along u and l along v has the number k · (number of pieces along v) + l.
    """
    refuse_barycentric(operation)
    cuts = {
        axis: snap_to_knot(surface, axis, t)
        for axis, t in enumerate((operation.u, operation.v))
        if t is not None
    }
    for axis, t in cuts.items():
        check_inside("uv"[axis], t, find_domain(surface, axis))
    pieces = [surface]
    for axis, t in cuts.items():
        first, last = find_domain(surface, axis)
        pieces = [
            refine_over(piece, axis, piece.degree[axis], interval, allowed, where=f"/{'uv'[axis]}")
            for piece in pieces
            for interval in ((first, t), (t, last))
        ]
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
    # A channel with another number of control points is one Bézier net over the domain.
    bezier_shapes = [n.shape for *_, n in surface.channels.each() if n.shape[:2] != counts]
    p, q = degree = highest_degree([tuple(n + 1 for n in surface.degree), *bezier_shapes])
    rows, columns = (  # numbers of spans along u and v
        len(knot.spans(knots, n))
        for knots, n in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    check_degree(max(p, q), allowed)
    channel_numbers = Batch.of_net(surface).channel_numbers
    check_count(rows * columns * (p + 1) * (q + 1), allowed, channel_numbers)
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
