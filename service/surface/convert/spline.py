"""Operations on a B-spline: over other knots, in a higher degree, turned about, lowered."""

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
from service.bases.refine import blossoms, raised_knots
from service.errors import InvalidRequest, Issue, TooLarge
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_DEGREE
from service.surface.convert.cut import check_inside, check_within, not_barycentric
from service.surface.convert.elevate import check_degrees, raised
from service.surface.convert.nets import (
    Allowed,
    along,
    changed,
    check_count,
    check_degree,
    check_size,
    width,
)
from service.surface.convert.operations import (
    Elevate,
    Interval,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    Transpose,
    degree_place,
)
from service.surface.convert.sharing import Batch, shared
from service.surface.group import GroupSurface, Member
from service.surface.knots import Knots, check_bezier_points, least_span
from service.surface.patches import PatchSurface

MAX_WORK = 1 << 26
"""Control points times both degrees, along one direction: some ten seconds."""


def elevate_spline(surface: BsplineSurface, operation: Elevate, allowed: Allowed) -> BsplineSurface:
    """Each distinct knot stands as many times more as the degree rises."""
    check_degrees(surface.degree, operation.degree)
    for axis, degree in enumerate(operation.degree):
        if degree > surface.degree[axis]:
            where = degree_place(operation.degree, axis)
            check_degree(degree, allowed, where)
            whole = domain_of(surface, axis)
            surface = _over(surface, _Change(axis, degree, whole, where), allowed)
    return surface


def restrict_spline(
    surface: BsplineSurface, operation: Restrict, allowed: Allowed
) -> BsplineSurface:
    """The piece keeps its parameters and its knots; a direction that is cut is clamped.

    A parameter that differs from a knot by rounding alone is that knot.
    """
    pieces: list[tuple[str, Interval | None]] = []
    for axis, given in enumerate((operation.u, operation.v)):
        ends = None
        if given is not None:
            ends = at_knot(surface, axis, given[0]), at_knot(surface, axis, given[1])
        pieces.append(("uv"[axis], ends))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None:
            check_within(name, piece, domain_of(surface, axis))
    for axis, (name, piece) in enumerate(pieces):
        if piece is not None and piece != domain_of(surface, axis):
            change = _Change(axis, surface.degree[axis], piece, f"/{name}")
            surface = _over(surface, change, allowed)
    return surface


def split_spline(surface: BsplineSurface, operation: Split, allowed: Allowed) -> GroupSurface:
    """A group of two B-splines or four, in the order of the pieces of a patch."""
    if operation.at is not None:
        raise InvalidRequest(not_barycentric())
    cuts = [
        (name, None if t is None else at_knot(surface, axis, t))
        for axis, (name, t) in enumerate((("u", operation.u), ("v", operation.v)))
    ]
    for axis, (name, t) in enumerate(cuts):
        if t is not None:
            check_inside(name, t, domain_of(surface, axis))
    pieces = [surface]
    for axis, (name, t) in enumerate(cuts):
        if t is not None:
            first, last = domain_of(surface, axis)
            changes = [
                _Change(axis, surface.degree[axis], interval, f"/{name}")
                for interval in ((first, t), (t, last))
            ]
            pieces = [_over(piece, change, allowed) for piece in pieces for change in changes]
    return GroupSurface(tuple(map(Member, pieces)), surface.up, surface.name)


def transpose_spline(
    surface: BsplineSurface, _operation: Transpose, _allowed: Allowed
) -> BsplineSurface:
    """S'(u, v) = S(v, u)."""
    weights = None if surface.weights is None else surface.weights.swapaxes(0, 1)
    return replace(
        surface,
        control_net=surface.control_net.swapaxes(0, 1),
        degree=surface.degree[::-1],
        knots=surface.knots[::-1],
        weights=weights,
        channels=changed(surface.channels, lambda net: net.swapaxes(0, 1)),
    )


def reverse_spline(
    surface: BsplineSurface, operation: Reverse, _allowed: Allowed
) -> BsplineSurface:
    """S'(−u, v) = S(u, v), for negative knots are exact; named knots keep their domain."""
    axis = "uv".index(operation.direction)
    knots = list(surface.knots)
    given = knots[axis]
    order = np.arange(surface.control_net.shape[axis])[::-1]
    if not isinstance(given, str):
        knots[axis] = 0.0 - given[::-1]
    elif given == "periodic":
        # The first p points, which come once more at the end, come first.
        order = np.roll(order, surface.degree[axis])
    own = surface.control_net.shape[:2]
    weights = None if surface.weights is None else np.take(surface.weights, order, axis)
    return replace(
        surface,
        control_net=np.take(surface.control_net, order, axis),
        knots=(knots[0], knots[1]),
        weights=weights,
        channels=changed(
            surface.channels,
            lambda net: np.take(net, order, axis) if net.shape[:2] == own else np.flip(net, axis),
        ),
    )


def bezier_of_spline(
    surface: BsplineSurface, _operation: ToBezier, allowed: Allowed
) -> PatchSurface:
    """The Bézier patches of the spans, over shared vertices; all carry channels in one degree."""
    own = surface.control_net.shape[:2]
    degrees = [surface.degree]
    degrees += [
        (net.shape[0] - 1, net.shape[1] - 1)
        for _, _, _, net in surface.channels.each()
        if net.shape[:2] != own
    ]
    degree = max(p for p, _ in degrees), max(q for _, q in degrees)
    rows, columns = (
        len(knot.spans(u, p)) for u, p in zip(surface.knot_vectors, surface.degree, strict=True)
    )
    check_size(degree, rows * columns, allowed, width(surface.channels))
    (batch,) = surface.lower().batches
    nets = iter(batch.channels)

    def carried(net: FloatArray) -> FloatArray:
        values = next(nets).nets
        if net.shape[:2] != own:
            values = _joined(values.reshape(rows, columns, *values.shape[1:]).copy())
            values = values.reshape(rows * columns, *values.shape[2:])
        # Rounding can lead beyond the net that the values are means of, and white is the limit.
        values = np.clip(values, net.min(axis=(0, 1)), net.max(axis=(0, 1)))
        return raised((values, None), degree, 1)[0]

    channels = changed(surface.channels, carried)
    net = raised((batch.points, batch.weights), degree, 1)
    return shared(Batch(net, channels), None, (), surface.up, surface.name)


def at_knot(surface: BsplineSurface, axis: int, parameter: float) -> float:
    """The knot that a parameter along u or v differs from by rounding alone; else the parameter."""
    breaks = knot.breaks(surface.knot_vectors[axis], surface.degree[axis])
    nearest = float(breaks[np.abs(breaks - parameter).argmin()])
    is_knot = abs(parameter - nearest) < least_span(*domain_of(surface, axis))
    return nearest if is_knot else parameter


def domain_of(surface: BsplineSurface, axis: int) -> Interval:
    """First and last parameter along u or v."""
    return knot.domain(surface.knot_vectors[axis], surface.degree[axis])


class _Change(NamedTuple):
    """A degree and a piece of the domain along one axis; `where` asked for them."""

    axis: int
    degree: int
    piece: Interval
    where: str


def _over(surface: BsplineSurface, change: _Change, allowed: Allowed) -> BsplineSurface:
    """The spline over a piece of its domain along one axis, clamped, in a degree."""
    axis, degree, piece, where = change
    knots, old = surface.knot_vectors[axis], surface.degree[axis]
    target = raised_knots(knots, old, degree, *piece)
    _check_spans(target, degree, least_span(*domain_of(surface, axis)), where)
    count = len(target) - degree - 1
    own = surface.control_net.shape[:2]
    beside = sum(n.shape[-1] for _, _, _, n in surface.channels.each() if n.shape[:2] == own)
    check_count(count * own[1 - axis], allowed, beside)
    vectors, degrees = list(surface.knot_vectors), list(surface.degree)
    vectors[axis], degrees[axis] = target, degree
    check_bezier_points((vectors[0], vectors[1]), (degrees[0], degrees[1]), where)
    _check_work(count * degree * old, where)
    index, shares = blossoms(knots, old, target, degree)
    periodic = isinstance(surface.knots[axis], str) and surface.knots[axis] == "periodic"

    def refined(net: Net) -> Net:
        if periodic:
            points, weights = net
            net = (
                knot.wrapped(points, old),
                None if weights is None else knot.wrapped(weights, old),
            )
        return _closed(combine(*net, index, shares), net, index, shares)

    points, weights = along((surface.control_net, surface.weights), axis, refined)
    new = list(own)
    new[axis] = count
    low, high = domain_of(surface, axis)
    ends = tuple((t - low) / (high - low) for t in piece)

    def carried(net: FloatArray) -> FloatArray:
        if net.shape[:2] == own:
            return along((net, None), axis, refined)[0]
        cut = partial(polynomials.restrict, first=ends[0], last=ends[1])
        return _told_apart(along((net, None), axis, cut)[0], (new[0], new[1]))

    given: list[Knots] = list(surface.knots)
    given[axis] = target
    return replace(
        surface,
        control_net=points,
        degree=(degrees[0], degrees[1]),
        knots=(given[0], given[1]),
        weights=weights,
        channels=changed(surface.channels, carried),
    )


def _closed(made: Net, net: Net, index: Ints, shares: FloatArray) -> Net:
    """The last row made the first one, where both are the same mean of the same points.

    So the ends of a periodic spline are; rounding makes them differ.
    """
    first, last = (np.flatnonzero(shares[:, end]) for end in (0, -1))
    same = len(first) == len(last) and bool(
        (np.abs(shares[first, 0] - shares[last, -1]) <= SAME_SHARE).all()
    )
    one, other = index[first, 0], index[last, -1]
    if same and all(np.array_equal(v[one], v[other]) for v in net if v is not None):
        for values in made:
            if values is not None:
                values[-1] = values[0]
    return made


def _told_apart(net: FloatArray, own: tuple[int, int]) -> FloatArray:
    """The net of a channel over the whole domain, raised where it would look like a spline's."""
    axis = 0 if len(net) <= MAX_DEGREE else 1
    while net.shape[:2] == own:
        net = along((net, None), axis, partial(polynomials.elevate, degree=net.shape[axis]))[0]
    return net


def _joined(nets: FloatArray) -> FloatArray:
    """Nets (rows, columns, a+1, b+1, d) of one polynomial, equal where they meet bit for bit."""
    nets[1:, :, 0] = nets[:-1, :, -1]
    nets[:, 1:, :, 0] = nets[:, :-1, :, -1]
    return nets


def _check_work(work: int, where: str) -> None:
    """Refuses what would take minutes, by the number of knots and both degrees."""
    if work > MAX_WORK:
        raise TooLarge(
            Issue(
                "too_many_knots",
                "So many knots of so high a degree would take too long.",
                where,
                f"{work} = control points × degree before × degree after",
                f"at most {MAX_WORK}",
            )
        )


def _check_spans(knots: FloatArray, degree: int, least: float, where: str) -> None:
    """Refuses a piece so short that rounding would tell no parameters within it apart."""
    shortest = float(np.diff(knot.breaks(knots, degree)).min())
    if shortest < least:
        raise InvalidRequest(
            Issue(
                "knots_too_close",
                "So near a knot there is no room for a piece of the surface.",
                where,
                f"{shortest:.3g} from the next knot",
                f"the knot itself, or at least {least:.3g} from it",
            )
        )
