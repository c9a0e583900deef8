"""Parameter curves through the foot points of curves of space, as ordinary splines.

On a plane the curve of foot points is the affine image of the curve itself: of its control points,
with its weights and knots. On other surfaces it is interpolated: a *piece* is the polynomial of
degree n through the foot points at n + 1 Chebyshev–Lobatto nodes (1 − cos πk/n) / 2. Pieces begin as
the spans of the curve. Where a piece is further from the curve between its nodes than at them, by
more than `goal`, it is divided: at the parameter at which it crosses a knot line of the surface,
because foot points have only as many derivatives as the surface, and otherwise in the middle.

The result does not depend on the tolerance of any mesh.

References
----------
Trefethen, Approximation Theory and Approximation Practice, chapters 2 and 5.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_tables import FootTable
from service.engine.trims.inversion import find_feet
from service.engine.trims.piecewise import join_spans
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items, length

DEGREE = 7
"""n of the pieces."""

DEPTH = 10
"""No piece is divided that is shorter than 2^-DEPTH of its curve's domain."""

KEPT = 0.5
"""A piece ends, if the distance between its nodes is above this share of that of its parent."""


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces(Items):
    """m pieces: curve, ends, distance that the piece from which they were cut had to lose, feet at
    their ends and guesses at their inner nodes."""

    curve: Ints
    low: FloatArray
    high: FloatArray
    excess: FloatArray
    first: FloatArray
    last: FloatArray
    inner: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class _Done(Items):
    """Finished pieces: curve, ends, and control points (n + 1, 2, m)."""

    curve: Ints
    low: FloatArray
    high: FloatArray
    points: FloatArray


def fit_feet(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    table: FootTable,
    goal: float,
    tolerance: float,
) -> Splines:
    """The parameter curves of the foot points of curves on the surfaces of faces.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each curve.
    curves : Splines
        n curves of space.
    table : FootTable
        First guesses.
    goal : float
        The greatest distance that interpolation may add. Model units.
    tolerance : float
        Points that are nearer than this to a pole are at it. Model units.
    """
    poles = _find_end_poles(surfaces, face, curves, tolerance)
    pieces = _begin(surfaces, face, curves, table, poles)
    done: list[_Done] = []
    straight: Ints | None = None
    while len(pieces.curve):
        t = pieces.low + (pieces.high - pieces.low) * _nodes()[:, np.newaxis]
        feet, distance = _find_nodes(surfaces, face, curves, pieces, t)
        feet = _extrapolate(feet, pieces, poles, curves)
        if straight is None:
            straight = _find_straight(surfaces, face, curves, pieces, (t, feet, distance), goal)
            is_straight = np.isin(pieces.curve, straight)
            done += _make_lines(curves, pieces, feet, straight)
            keep = ~is_straight
            pieces, t, feet, distance = (
                pieces.take(keep),
                t[:, keep],
                feet[..., keep],
                distance[:, keep],
            )
        points = np.einsum("ij,jkm->ikm", _to_bezier(), feet)
        excess = _measure(surfaces, face, curves, pieces, points) - distance.max(axis=0)
        domain = curves.end[pieces.curve] - curves.start[pieces.curve]
        is_done = (excess <= goal) | (pieces.high - pieces.low < domain * 2.0**-DEPTH)
        is_done |= (excess > KEPT * pieces.excess) & (pieces.high - pieces.low < domain / 16)
        done.append(_Done(pieces.curve, pieces.low, pieces.high, points).take(is_done))
        rest = ~is_done
        pieces = _divide(
            surfaces, face, curves, pieces.take(rest), (points[..., rest], excess[rest])
        )
    return _join(done)


def project_to_planes(surfaces: ClosedSurfaces, face: Ints, curves: Splines) -> Splines:
    """The curves of foot points of curves on planes: affine images, with the curves' own weights."""
    corner = surfaces.low[face]
    origin, su, sv = surfaces.evaluate_partials(face, corner)
    uu, uv, vv = (np.einsum("ij,ij->i", a, b) for a, b in ((su, su), (su, sv), (sv, sv)))
    determinant = uu * vv - uv * uv
    dual_u = (vv[:, np.newaxis] * su - uv[:, np.newaxis] * sv) / determinant[:, np.newaxis]
    dual_v = (uu[:, np.newaxis] * sv - uv[:, np.newaxis] * su) / determinant[:, np.newaxis]
    spans = curves.list_spans()
    nets = []
    for rows, net in curves.restrict(spans):
        owner = spans.curve[rows]
        weights = net[..., 3:] if net.shape[-1] == 4 else np.ones((*net.shape[:2], 1))
        rest = net[..., :3] - weights * origin[owner][:, np.newaxis]
        u, v = (np.einsum("ijk,ik->ij", rest, dual[owner]) for dual in (dual_u, dual_v))
        image = np.stack([u, v], axis=2) + weights * corner[owner][:, np.newaxis]
        nets.append((rows, np.concatenate([image, weights], 2) if net.shape[-1] == 4 else image))
    return join_spans(2, spans, nets)


@cache
def _nodes() -> FloatArray:
    """The n + 1 nodes, from 0 to 1."""
    return (1.0 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2


@cache
def _checks() -> FloatArray:
    """A parameter between any two neighbouring nodes, (n,)."""
    return (1.0 - np.cos(np.pi * (np.arange(DEGREE) + 0.5) / DEGREE)) / 2


@cache
def _to_bezier() -> FloatArray:
    """The matrix from values at the nodes to Bézier points; its end rows are exact."""
    matrix: FloatArray = np.linalg.inv(bernstein(DEGREE, _nodes()))
    matrix[0], matrix[-1] = np.eye(DEGREE + 1)[0], np.eye(DEGREE + 1)[-1]
    return matrix


@cache
def _extrapolation(drop_first: bool, drop_last: bool) -> FloatArray:
    """Weights (2, n + 1) of the values at inner nodes for the values at the first and last node."""
    used = np.arange(int(drop_first), DEGREE + 1 - int(drop_last))
    x = _nodes()
    weights = np.zeros((2, DEGREE + 1))
    for row, target in enumerate((x[0], x[-1])):
        for k in used:
            others = used[used != k]
            weights[row, k] = np.prod((target - x[others]) / (x[k] - x[others]))
    return weights


def _find_end_poles(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, tolerance: float
) -> tuple[Ints, FloatArray]:
    """For the start and the end of each curve: the axis (2, n) of a pole there or −1; its side."""
    number = np.arange(len(face))
    axes, sides = np.full((2, len(face)), -1), np.zeros((2, len(face)))
    if surfaces.is_pole[face].any():
        for k, t in enumerate((curves.start, curves.end)):
            axis, end = surfaces.find_poles(face, curves.evaluate(number, t), tolerance)
            axes[k] = axis
            both = np.stack([surfaces.low, surfaces.surfaces.high])
            sides[k] = both[end, face, axis]
    return axes, sides


def _begin(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    table: FootTable,
    poles: tuple[Ints, FloatArray],
) -> _Pieces:
    """The spans of the curves, with the feet at all breaks."""
    spans = curves.list_spans()
    owner = np.repeat(np.arange(len(curves)), curves.span_count + 1)
    guess = table.guess(owner, curves.breaks)
    feet, _ = find_feet(surfaces, face[owner], curves.evaluate(owner, curves.breaks), guess)
    axes, sides = poles
    for k, at in enumerate((curves.first_break, curves.first_break + curves.span_count)):
        rows = (axes[k] >= 0).nonzero()[0]
        feet[at[rows]] = guess[at[rows]]
        feet[at[rows], axes[k, rows]] = sides[k, rows]
    begin = curves.first_break[spans.curve] + spans.span
    t = spans.low + (spans.high - spans.low) * _nodes()[1:-1, np.newaxis]
    inner = table.guess(np.tile(spans.curve, DEGREE - 1), t.ravel())
    return _Pieces(
        spans.curve,
        spans.low,
        spans.high,
        np.full(len(spans.curve), np.inf),
        feet[begin].T,
        feet[begin + 1].T,
        inner.reshape(DEGREE - 1, -1, 2).transpose(0, 2, 1),
    )


def _find_nodes(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, pieces: _Pieces, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Feet (n + 1, 2, m) at the nodes t (n + 1, m), and distances (n − 1, m) at inner ones."""
    curve = np.tile(pieces.curve, DEGREE - 1)
    points = curves.evaluate(curve, t[1:-1].ravel())
    guess = pieces.inner.transpose(0, 2, 1).reshape(-1, 2)
    inner, distance = find_feet(surfaces, face[curve], points, guess)
    inner = inner.reshape(DEGREE - 1, -1, 2).transpose(0, 2, 1)
    feet = np.concatenate([pieces.first[np.newaxis], inner, pieces.last[np.newaxis]])
    return feet, distance.reshape(DEGREE - 1, -1)


def _extrapolate(
    feet: FloatArray, pieces: _Pieces, poles: tuple[Ints, FloatArray], curves: Splines
) -> FloatArray:
    """Feet (n + 1, 2, m); at poles the free parameter continues that of the other nodes."""
    axes, _ = poles
    if (axes < 0).all():
        return feet
    curve = pieces.curve
    first = np.where(pieces.low == curves.start[curve], axes[0, curve], -1)
    last = np.where(pieces.high == curves.end[curve], axes[1, curve], -1)
    feet = feet.copy()
    for drop_first, drop_last in ((True, False), (False, True), (True, True)):
        chosen = ((first >= 0) == drop_first) & ((last >= 0) == drop_last)
        rows = chosen.nonzero()[0]
        if not len(rows):
            continue
        ends = np.einsum("ij,jkm->ikm", _extrapolation(drop_first, drop_last), feet[..., rows])
        if drop_first:
            feet[0, 1 - first[rows], rows] = ends[0, 1 - first[rows], np.arange(len(rows))]
        if drop_last:
            feet[-1, 1 - last[rows], rows] = ends[1, 1 - last[rows], np.arange(len(rows))]
    return feet


def _find_straight(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    pieces: _Pieces,
    nodes: tuple[FloatArray, FloatArray, FloatArray],
    goal: float,
) -> Ints:
    """The curves whose feet move uniformly along a segment, up to a tenth of `goal`."""
    t, feet, distance = nodes
    curve = pieces.curve
    begins = np.flatnonzero(np.diff(curve, prepend=-1))
    ends = np.append(begins[1:], len(curve)) - 1
    start, stop = feet[0][:, begins][:, curve], feet[-1][:, ends][:, curve]
    share = (t - curves.start[curve]) / (curves.end - curves.start)[curve]
    line = start + share[:, np.newaxis] * (stop - start)
    off = np.abs(line - feet) <= 1e-6 * surfaces.period[face[curve]].T
    candidates = np.logical_and.reduceat(off.all(axis=(0, 1)), begins)
    rows = candidates[curve].nonzero()[0]
    if not len(rows):
        return np.zeros(0, np.intp)
    owner = np.tile(curve[rows], DEGREE - 1)
    parameters = line[1:-1][..., rows].transpose(0, 2, 1).reshape(-1, 2)
    reached = surfaces.evaluate(face[owner], parameters)
    gap = length(reached - curves.evaluate(owner, t[1:-1][:, rows].ravel()), -1)
    excess = (gap.reshape(DEGREE - 1, -1) - distance[:, rows]).max(axis=0)
    is_good = np.zeros(len(curve), bool)
    is_good[rows] = excess <= 0.1 * goal
    straight: Ints = np.logical_and.reduceat(is_good, begins).nonzero()[0]
    return straight


def _make_lines(curves: Splines, pieces: _Pieces, feet: FloatArray, chosen: Ints) -> list[_Done]:
    """Segments from the first foot to the last of the chosen curves, as pieces of degree 1."""
    if not len(chosen):
        return []
    begins = np.searchsorted(pieces.curve, chosen)
    ends = np.searchsorted(pieces.curve, chosen, side="right") - 1
    points = np.stack([feet[0][:, begins], feet[-1][:, ends]])
    return [_Done(chosen, curves.start[chosen], curves.end[chosen], points)]


def _measure(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, pieces: _Pieces, points: FloatArray
) -> FloatArray:
    """The largest distance (m,) between curves and pieces (n + 1, 2, m) at the check parameters."""
    count = len(_checks())
    owner = np.tile(pieces.curve, count)
    t = pieces.low + (pieces.high - pieces.low) * _checks()[:, np.newaxis]
    feet = np.einsum("ij,jkm->imk", bernstein(DEGREE, _checks()), points)
    apart = surfaces.evaluate(face[owner], feet.reshape(-1, 2)) - curves.evaluate(owner, t.ravel())
    return np.asarray(length(apart, -1).reshape(count, -1).max(axis=0))


def _divide(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    pieces: _Pieces,
    fit: tuple[FloatArray, FloatArray],
) -> _Pieces:
    """Both parts of pieces; `fit` are their control points (n + 1, 2, m) and excesses (m,)."""
    points, excess = fit
    count = len(pieces.curve)
    if not count:
        return pieces
    share, foot = _find_cuts(surfaces, face, curves, pieces, points)
    width = pieces.high - pieces.low
    middle = pieces.low + share * width
    guesses = []
    for begin, size in ((np.zeros(count), share), (share, 1.0 - share)):
        x = begin + size * _nodes()[1:-1, np.newaxis]
        basis = bernstein(DEGREE, x.ravel()).reshape(DEGREE - 1, count, DEGREE + 1)
        guesses.append(np.einsum("imj,jkm->ikm", basis, points))
    left = _Pieces(pieces.curve, pieces.low, middle, excess, pieces.first, foot, guesses[0])
    right = _Pieces(pieces.curve, middle, pieces.high, excess, foot, pieces.last, guesses[1])
    return _Pieces.join([left, right])


def _find_cuts(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, pieces: _Pieces, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Where pieces are divided: shares (m,) of their length, and the feet (2, m) there."""
    count = len(pieces.curve)
    share, axis, knot = _find_crossings(surfaces, face[pieces.curve], points)
    low, high = np.zeros(count), np.ones(count)
    below = points[0, np.maximum(axis, 0), np.arange(count)] < knot
    has_knot: Bools = axis >= 0
    foot = np.zeros((count, 2))
    # Regula falsi, by feet of the curve itself: a few steps.
    low_value = points[0, np.maximum(axis, 0), np.arange(count)] - knot
    high_value = points[-1, np.maximum(axis, 0), np.arange(count)] - knot
    active = np.arange(count)
    for _ in range(6):
        x = share[active]
        basis = bernstein(DEGREE, x)
        guess = np.einsum("mj,jkm->mk", basis, points[..., active])
        t = pieces.low[active] + x * (pieces.high - pieces.low)[active]
        curve = pieces.curve[active]
        foot[active], _ = find_feet(surfaces, face[curve], curves.evaluate(curve, t), guess)
        active = active[has_knot[active]]
        value = foot[active, axis[active]] - knot[active]
        width = surfaces.period[face[pieces.curve[active]], axis[active]]
        is_before = (value < 0) == below[active]
        low[active] = np.where(is_before, share[active], low[active])
        low_value[active] = np.where(is_before, value, low_value[active])
        high[active] = np.where(is_before, high[active], share[active])
        high_value[active] = np.where(is_before, high_value[active], value)
        goes_on = np.abs(value) > 1e-14 * width
        active = active[goes_on]
        if not len(active):
            break
        a, b = low_value[active], high_value[active]
        new = low[active] - a * (high - low)[active] / np.where(a == b, 1.0, b - a)
        share[active] = np.where(a == b, (low + high)[active] / 2, new)
    # A knot that is met at an end of the piece does not divide it.
    is_end = (share < 2.0**-20) | (share > 1 - 2.0**-20) | ~np.isfinite(share)
    rows = is_end.nonzero()[0]
    if len(rows):
        share[rows] = 0.5
        guess = np.einsum("j,jkm->mk", bernstein(DEGREE, [0.5])[0], points[..., rows])
        curve = pieces.curve[rows]
        t = (pieces.low + pieces.high)[rows] / 2
        foot[rows], _ = find_feet(surfaces, face[curve], curves.evaluate(curve, t), guess)
    return share, foot.T


def _find_crossings(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray
) -> tuple[FloatArray, Ints, FloatArray]:
    """Where pieces cross the knot line nearest to their middle: share (m,), axis or −1, knot."""
    count = points.shape[2]
    share, axis, knot = np.full(count, 0.5), np.full(count, -1), np.zeros(count)
    nodes = np.einsum("ij,jkm->ikm", bernstein(DEGREE, _nodes()), points)
    every = np.arange(count)
    for a in range(2):
        first, last = nodes[0, a], nodes[-1, a]
        middle = (first + last) / 2
        near = _find_near_knot(surfaces, face, a, middle)
        margin = 1e-9 * surfaces.period[face, a]
        low, high = np.minimum(first, last) + margin, np.maximum(first, last) - margin
        rows = ((near > low) & (near < high) & (axis < 0)).nonzero()[0]
        if not len(rows):
            continue
        value = (nodes[:, a, rows] - near[rows]) * np.sign(last - first)[rows]
        k = np.maximum((value >= 0).argmax(axis=0), 1)
        before, after = value[k - 1, np.arange(len(rows))], value[k, np.arange(len(rows))]
        x = _nodes()
        share[rows] = x[k - 1] + (x[k] - x[k - 1]) * (-before / (after - before))
        axis[every[rows]], knot[rows] = a, near[rows]
    return share, axis, knot


def _find_near_knot(
    surfaces: ClosedSurfaces, face: Ints, axis: int, value: FloatArray
) -> FloatArray:
    """The inner knot nearest to values (m,) along an axis; infinite if a surface has one span.

    Along closed axes the sides are knots, too, and all knots recur.
    """
    span = surfaces.find_spans(face, axis, value)
    left, right = surfaces.list_knots(face, axis, span)
    is_open = ~surfaces.is_closed[face, axis]
    left = np.where(is_open & (span == 0), -np.inf, left)
    is_last = span + 1 == surfaces.surfaces.faces.spans[axis, face]
    right = np.where(is_open & is_last, np.inf, right)
    return np.where(np.abs(left - value) <= np.abs(right - value), left, right)


def _join(parts: list[_Done]) -> Splines:
    """Splines from finished pieces of all curves."""
    curve = np.concatenate([part.curve for part in parts])
    low = np.concatenate([part.low for part in parts])
    high = np.concatenate([part.high for part in parts])
    order = np.lexsort((low, curve))
    place = np.empty(len(order), np.intp)
    place[order] = np.arange(len(order))
    nets, first = [], 0
    for part in parts:
        rows = place[first : first + len(part.curve)]
        nets.append((rows, part.points.transpose(2, 0, 1)))
        first += len(part.curve)
    intervals = Intervals(
        curve[order], curve[order], low[order], high[order], np.zeros(len(order), np.intp)
    )
    return join_spans(2, intervals, nets)
