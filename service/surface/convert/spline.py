"""Conversions of a B-spline: elevate, restrict, split, transpose, reverse, to Bézier patches."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from service.bases import knots as knot
from service.bases import polynomials
from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray, Ints
from service.bases.extraction import SAME_SHARE
from service.bases.polynomials import Net
from service.bases.refine import find_refinement, raise_knots
from service.errors import InvalidRequest, Issue, TooLarge
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_DEGREE
from service.surface.convert.cut import barycentric_issue, check_inside, check_within
from service.surface.convert.elevate import check_degrees, elevate_nets
from service.surface.convert.nets import (
    SizeLimits,
    apply_along,
    check_count,
    check_degree,
    check_size,
    count_channel_numbers,
    map_channels,
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
from service.surface.convert.sharing import Batch, share_vertices
from service.surface.group import GroupSurface, Member
from service.surface.knots import Knots, check_bezier_points, find_least_span
from service.surface.patches import PatchSurface

MAX_WORK = 1 << 26
"""Most work along one direction, in control points × both degrees: about ten seconds."""


def elevate_spline(
    surface: BsplineSurface, operation: Elevate, allowed: SizeLimits
) -> BsplineSurface:
    """Raise the degree; the multiplicity of each knot rises with it."""
    check_degrees(surface.degree, operation.degree)
    for axis, degree in enumerate(operation.degree):
        if degree > surface.degree[axis]:
            where = degree_pointer(operation.degree, axis)
            check_degree(degree, allowed, where)
            domain = find_domain(surface, axis)
            surface = _refine_over(surface, _Change(axis, degree, domain, where), allowed)
    return surface


def restrict_spline(
    surface: BsplineSurface, operation: Restrict, allowed: SizeLimits
) -> BsplineSurface:
    """Take a piece, which keeps its parameters and knots; directions that are cut become clamped.

    A parameter that differs from a knot by rounding alone counts as this knot.
    """
    pieces: list[tuple[str, Interval | None]] = []
    for axis, interval in enumerate((operation.u, operation.v)):
        ends = None
        if interval is not None:
            ends = (
                snap_to_knot(surface, axis, interval[0]),
                snap_to_knot(surface, axis, interval[1]),
            )
            least = find_least_span(*find_domain(surface, axis))
            _check_length(ends[1] - ends[0], least, f"/{'uv'[axis]}")
        pieces.append(("uv"[axis], ends))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None:
            check_within(name, piece, find_domain(surface, axis))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None and piece != find_domain(surface, axis):
            change = _Change(axis, surface.degree[axis], piece, f"/{name}")
            surface = _refine_over(surface, change, allowed)
    return surface


def split_spline(surface: BsplineSurface, operation: Split, allowed: SizeLimits) -> GroupSurface:
    """Split into a group of two or four B-splines: (k, l) has number k · (pieces along v) + l."""
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
                _Change(axis, surface.degree[axis], interval, f"/{name}")
                for interval in ((first, t), (t, last))
            ]
            pieces = [
                _refine_over(piece, change, allowed) for piece in pieces for change in changes
            ]
    return GroupSurface(tuple(map(Member, pieces)), surface.up, surface.name)


def transpose_spline(
    surface: BsplineSurface, _operation: Transpose, _allowed: SizeLimits
) -> BsplineSurface:
    """S'(u, v) = S(v, u)."""
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
    """S'(−u, v) = S(u, v), since negating knots is exact; named knots keep their domain."""
    axis = "uv".index(operation.direction)
    knots = list(surface.knots)
    vector = knots[axis]
    order = np.arange(surface.control_net.shape[axis])[::-1]
    if not isinstance(vector, str):
        knots[axis] = 0.0 - vector[::-1]
    elif vector == "periodic":
        # The p points that are repeated at the end must come first after the reversal.
        order = np.roll(order, surface.degree[axis])
    counts = surface.control_net.shape[:2]
    weights = None if surface.weights is None else np.take(surface.weights, order, axis)
    return replace(
        surface,
        control_net=np.take(surface.control_net, order, axis),
        knots=(knots[0], knots[1]),
        weights=weights,
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
    """The Bézier patches of the spans over shared vertices, points and channels in one degree."""
    counts = surface.control_net.shape[:2]
    degrees = [surface.degree]
    degrees += [
        (net.shape[0] - 1, net.shape[1] - 1)
        for _, _, _, net in surface.channels.each()
        if net.shape[:2] != counts
    ]
    degree = max(p for p, _ in degrees), max(q for _, q in degrees)
    rows, columns = (
        len(knot.spans(u, p)) for u, p in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    check_size(degree, rows * columns, allowed, count_channel_numbers(surface.channels))
    (batch,) = surface.lower().batches
    nets = iter(batch.channels)

    def carried(net: FloatArray) -> FloatArray:
        values = next(nets).nets
        if net.shape[:2] != counts:
            values = _join_nets(values.reshape(rows, columns, *values.shape[1:]).copy())
            values = values.reshape(rows * columns, *values.shape[2:])
        # Rounding must not take means beyond the values of the net: colours end at 1.
        values = np.clip(values, net.min(axis=(0, 1)), net.max(axis=(0, 1)))
        return elevate_nets((values, None), degree, 1)[0]

    channels = map_channels(surface.channels, carried)
    net = elevate_nets((batch.points, batch.weights), degree, 1)
    return share_vertices(Batch(net, channels), None, (), surface.up, surface.name)


def snap_to_knot(surface: BsplineSurface, axis: int, parameter: float) -> float:
    """The knot nearest to a parameter if they differ by rounding alone, else the parameter."""
    breaks = knot.breaks(surface.knot_vectors[axis], surface.degree[axis])
    nearest = float(breaks[np.abs(breaks - parameter).argmin()])
    is_knot = abs(parameter - nearest) < find_least_span(*find_domain(surface, axis))
    return nearest if is_knot else parameter


def find_domain(surface: BsplineSurface, axis: int) -> Interval:
    """First and last parameter along u or v."""
    return knot.domain(surface.knot_vectors[axis], surface.degree[axis])


class _Change(NamedTuple):
    """A new degree and a piece of the domain along one axis; `where` points to its field."""

    axis: int
    degree: int
    piece: Interval
    where: str


def _refine_over(surface: BsplineSurface, change: _Change, allowed: SizeLimits) -> BsplineSurface:
    """The spline over a piece of its domain along one axis, clamped, in the new degree."""
    axis, degree, piece, where = change
    knots, old = surface.knot_vectors[axis], surface.degree[axis]
    target = raise_knots(knots, old, degree, *piece)
    shortest = float(np.diff(knot.breaks(target, degree)).min())
    _check_length(shortest, find_least_span(*find_domain(surface, axis)), where)
    count = len(target) - degree - 1
    counts = surface.control_net.shape[:2]
    beside = sum(n.shape[-1] for _, _, _, n in surface.channels.each() if n.shape[:2] == counts)
    check_count(count * counts[1 - axis], allowed, beside)
    vectors, degrees = list(surface.knot_vectors), list(surface.degree)
    vectors[axis], degrees[axis] = target, degree
    check_bezier_points((vectors[0], vectors[1]), (degrees[0], degrees[1]), where)
    _check_work(count * degree * old, where)
    index, shares = find_refinement(knots, old, target, degree)
    periodic = isinstance(surface.knots[axis], str) and surface.knots[axis] == "periodic"

    def refined(net: Net) -> Net:
        if periodic:
            points, weights = net
            net = (
                knot.wrap_points(points, old),
                None if weights is None else knot.wrap_points(weights, old),
            )
        return _close_rows(combine(*net, index, shares), net, index, shares)

    points, weights = apply_along((surface.control_net, surface.weights), axis, refined)
    new = list(counts)
    new[axis] = count
    low, high = find_domain(surface, axis)
    ends = tuple((t - low) / (high - low) for t in piece)

    def carried(net: FloatArray) -> FloatArray:
        if net.shape[:2] == counts:
            return apply_along((net, None), axis, refined)[0]
        cut = partial(polynomials.restrict, first=ends[0], last=ends[1])
        return _elevate_ambiguous(apply_along((net, None), axis, cut)[0], (new[0], new[1]))

    new_vectors: list[Knots] = list(surface.knots)
    new_vectors[axis] = target
    return replace(
        surface,
        control_net=points,
        degree=(degrees[0], degrees[1]),
        knots=(new_vectors[0], new_vectors[1]),
        weights=weights,
        channels=map_channels(surface.channels, carried),
    )


def _close_rows(closed_net: Net, net: Net, index: Ints, shares: FloatArray) -> Net:
    """Copy the first row to the last where both are equal means of equal points.

    The ends of a periodic spline are equal in exact arithmetic, and rounding must not part them.
    """
    first, last = (np.flatnonzero(shares[:, end]) for end in (0, -1))
    same = len(first) == len(last) and bool(
        (np.abs(shares[first, 0] - shares[last, -1]) <= SAME_SHARE).all()
    )
    one, other = index[first, 0], index[last, -1]
    if same and all(np.array_equal(v[one], v[other]) for v in net if v is not None):
        for values in closed_net:
            if values is not None:
                values[-1] = values[0]
    return closed_net


def _elevate_ambiguous(net: FloatArray, counts: tuple[int, int]) -> FloatArray:
    """A channel's net over the whole domain, elevated if it would have the form of a spline's."""
    axis = 0 if len(net) <= MAX_DEGREE else 1
    while net.shape[:2] == counts:
        net = apply_along((net, None), axis, partial(polynomials.elevate, degree=net.shape[axis]))[
            0
        ]
    return net


def _join_nets(nets: FloatArray) -> FloatArray:
    """Nets (rows, columns, a+1, b+1, d) of one polynomial, equal bit for bit where they meet."""
    nets[1:, :, 0] = nets[:-1, :, -1]
    nets[:, 1:, :, 0] = nets[:, :-1, :, -1]
    return nets


def _check_work(work: int, where: str) -> None:
    """Refuse conversions that would take minutes, by the number of knots and both degrees."""
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


def _check_length(shortest: float, least: float, where: str) -> None:
    """Refuse a piece so short that rounding would make its parameters equal."""
    if shortest < least:
        raise InvalidRequest(
            Issue(
                "knots_too_close",
                "The cut is too near to a knot: the piece between them would be too short.",
                where,
                f"{shortest:.3g} from the next knot",
                f"the knot itself, or at least {least:.3g} from it",
            )
        )
