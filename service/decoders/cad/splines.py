"""B-spline curves and surfaces in homogeneous coordinates: making, checking, cutting, joining.

All changes of knots and degrees are values of blossoms (`service.bases.blossoms`), so that new
control points are weighted means of old ones. An axis of a surface is treated as a curve whose
control points are rows of the net.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., chapters 2 to 5.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray, Ints
from service.bases.blossoms import find_refinement, raise_knots
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import MAX_COORDINATE
from service.decoders.cad.knot_vectors import MAX_DEGREE, check_knots
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.knots import MAX_BEZIER_POINTS, MAX_PIECES

Spline = TypeVar("Spline", Curve, Surface)

SNAP = 1e-9
"""Parameters that are nearer to a knot than this share of the domain are moved to it."""

JUMP = 1e-9
"""At p + 1 equal knots the two control points may be this far apart, as a share of the largest
coordinate; then one of them is left out."""


def build_curve(
    degree: int, knots: ArrayLike, points: ArrayLike, weights: ArrayLike | None = None
) -> Curve:
    """A clamped curve from what a file has.

    Parameters
    ----------
    knots : array_like, shape (n + p + 1,)
        The full knot vector, clamped or not.
    points : array_like, shape (n, D)
    weights : array_like, shape (n,), or None

    Raises
    ------
    InvalidGeometry
        Degree, knots, numbers of points or of weights don't fit; a coordinate is not finite or too
        large; a weight is not positive, or weights differ too much; all points are equal; the curve
        jumps inside its domain.
    """
    net = _to_homogeneous(points, weights, 2)
    full = np.asarray(knots, np.float64)
    if (net == net[0]).all():
        raise InvalidGeometry("all control points of a curve are equal")
    full, net = _clamp(full, degree, net)
    return Curve(degree, full, net)


def build_surface(
    degrees: tuple[int, int],
    knots: tuple[ArrayLike, ArrayLike],
    points: ArrayLike,
    weights: ArrayLike | None = None,
) -> Surface:
    """A clamped surface from what a file has.

    Parameters
    ----------
    knots : tuple of two array_like
        The full knot vectors, clamped or not.
    points : array_like, shape (n, m, 3)
    weights : array_like, shape (n, m), or None

    Raises
    ------
    InvalidGeometry
        As `build_curve`.
    """
    net = _to_homogeneous(points, weights, 3)
    first, net = _clamp(np.asarray(knots[0], np.float64), degrees[0], net)
    second, turned = _clamp(np.asarray(knots[1], np.float64), degrees[1], net.swapaxes(0, 1))
    pieces = [len(np.unique(each)) - 1 for each in (first, second)]
    if pieces[0] * pieces[1] > MAX_PIECES or (
        pieces[0] * (degrees[0] + 1) * pieces[1] * (degrees[1] + 1) > MAX_BEZIER_POINTS
    ):
        raise InvalidGeometry("a surface has too many spans")
    return Surface(degrees, (first, second), np.ascontiguousarray(turned.swapaxes(0, 1)))


def project_points(net: FloatArray) -> FloatArray:
    """The control points P (…, D) of homogeneous ones (…, D + 1)."""
    points: FloatArray = net[..., :-1] / net[..., -1:]
    return points


def find_domain(curve: Curve) -> tuple[float, float]:
    """The first and the last parameter."""
    return float(curve.knots[0]), float(curve.knots[-1])


def find_ends(curve: Curve) -> FloatArray:
    """The first and the last point, (2, D)."""
    return project_points(curve.points[[0, -1]])


def evaluate(curve: Curve, parameters: ArrayLike) -> FloatArray:
    """Points (k, D) at parameters (k,), which are clamped to the domain."""
    return project_points(_de_boor(curve, np.asarray(parameters, np.float64)))


def evaluate_derivatives(curve: Curve, parameters: ArrayLike) -> FloatArray:
    """Points, first and second derivatives (3, k, D) at parameters (k,).

    With A and w, the numerator and the denominator of C = A / w,

        C′ = (A′ − w′ C) / w,   C″ = (A″ − 2 w′ C′ − w″ C) / w.
    """
    t = np.asarray(parameters, np.float64)
    levels, each = [_de_boor(curve, t)], curve
    for _ in range(2):
        if each.degree == 0:
            levels.append(np.zeros_like(levels[0]))
            continue
        each = _differentiate(each)
        levels.append(_de_boor(each, t))
    (a, da, dda), (w, dw, ddw) = (
        [level[:, :-1] for level in levels],
        [level[:, -1:] for level in levels],
    )
    point = a / w
    first = (da - dw * point) / w
    second = (dda - 2.0 * dw * first - ddw * point) / w
    return np.stack([point, first, second])


def evaluate_surface(surface: Surface, u: ArrayLike, v: ArrayLike) -> FloatArray:
    """Points (k, 3) at parameters u and v (k,), which are clamped to the domain."""
    rows = np.asarray(u, np.float64)
    columns = np.asarray(v, np.float64)
    count = surface.points.shape[1]
    flat = Curve(surface.degrees[0], surface.knots[0], surface.points.reshape(-1, count * 4))
    nets = _de_boor(flat, rows).reshape(len(rows), count, 4)
    return project_points(_de_boor_rows(surface.degrees[1], surface.knots[1], nets, columns))


def segment(curve: Curve, first: float, last: float) -> Curve:
    """The piece of a curve over [first, last], clamped; parameters stay.

    Raises
    ------
    InvalidGeometry
        The piece has no length.
    """
    knots, points = _restrict(curve.knots, curve.degree, curve.points, first, last)
    return Curve(curve.degree, knots, points)


def segment_surface(surface: Surface, axis: int, first: float, last: float) -> Surface:
    """The part of a surface over [first, last] along an axis; parameters stay.

    Raises
    ------
    InvalidGeometry
        The part has no length.
    """
    net = surface.points.swapaxes(0, axis)
    knots, net = _restrict(surface.knots[axis], surface.degrees[axis], net, first, last)
    both = list(surface.knots)
    both[axis] = knots
    return Surface(surface.degrees, (both[0], both[1]), np.ascontiguousarray(net.swapaxes(0, axis)))


def insert_knots(curve: Curve, knots: Sequence[float]) -> Curve:
    """The curve with more knots, which are inside its domain."""
    target = np.sort(np.concatenate([curve.knots, np.asarray(knots, np.float64)]))
    points = _refine(curve.knots, curve.degree, curve.points, target, curve.degree)
    return Curve(curve.degree, target, points)


def elevate(curve: Curve, degree: int) -> Curve:
    """The curve in a higher degree.

    Raises
    ------
    InvalidGeometry
        The degree is above `MAX_DEGREE`.
    """
    if degree == curve.degree:
        return curve
    if degree > MAX_DEGREE:
        raise InvalidGeometry(f"the degree of a spline is not between 1 and {MAX_DEGREE}")
    target = raise_knots(curve.knots, curve.degree, degree, *find_domain(curve))
    points = _refine(curve.knots, curve.degree, curve.points, target, degree)
    return Curve(degree, target, points)


def reverse(curve: Curve) -> Curve:
    """The curve from its end to its start, over the same domain."""
    return Curve(curve.degree, _reverse_knots(curve.knots), curve.points[::-1].copy())


def reverse_surface(surface: Surface, axis: int) -> Surface:
    """The surface with one parameter reversed, over the same domain; its normal is opposite."""
    knots = list(surface.knots)
    knots[axis] = _reverse_knots(knots[axis])
    net = np.flip(surface.points, axis).copy()
    return Surface(surface.degrees, (knots[0], knots[1]), net)


def swap_axes(surface: Surface) -> Surface:
    """The surface S(v, u); its normal is opposite."""
    (p, q), (u, v) = surface.degrees, surface.knots
    return Surface((q, p), (v, u), np.ascontiguousarray(surface.points.swapaxes(0, 1)))


def join(curves: Sequence[Curve], tolerance: float) -> Curve:
    """One curve of curves that follow each other; each keeps the length of its domain.

    Parameters
    ----------
    tolerance : float
        How far the end of a curve may be from the start of the next; the joint is in the middle.

    Raises
    ------
    InvalidGeometry
        There is no curve, or two of them don't meet.
    """
    if not curves:
        raise InvalidGeometry("a composite curve has no segments")
    if len(curves) == 1:
        return curves[0]
    degree = max(curve.degree for curve in curves)
    all_knots: list[FloatArray] = []
    all_points: list[FloatArray] = []
    end = 0.0
    for curve in (elevate(each, degree) for each in curves):
        points, knots = curve.points, curve.knots
        if not all_knots:
            all_points.append(points.copy())
            all_knots.append(knots[:-1])
            end = knots.item(-1)
            continue
        last = all_points[-1][-1]
        points = points * (last[-1] / points[0, -1])
        ends = project_points(np.stack([last, points[0]]))
        if not np.sqrt(np.square(ends[1] - ends[0]).sum()) <= tolerance:
            raise InvalidGeometry("the segments of a composite curve do not meet")
        all_points[-1][-1] = (last + points[0]) / 2
        all_points.append(points[1:])
        moved = knots + (end - knots[0])
        all_knots.append(moved[degree + 1 : -1])
        end = moved.item(-1)
    return Curve(degree, np.append(np.concatenate(all_knots), end), np.concatenate(all_points))


def drop_z(curve: Curve) -> Curve:
    """The curve (x, y) of a curve of space, for pcurves."""
    return Curve(curve.degree, curve.knots, curve.points[:, [0, 1, 3]])


def transform(spline: Spline, matrix: FloatArray) -> Spline:
    """A curve of space or a surface after an affine map (4, 4), which may mirror and scale."""
    net = spline.points @ matrix.T
    net[..., 3] = spline.points[..., 3]
    if isinstance(spline, Curve):
        return Curve(spline.degree, spline.knots, net)
    return Surface(spline.degrees, spline.knots, net)


def _to_homogeneous(points: ArrayLike, weights: ArrayLike | None, axes: int) -> FloatArray:
    """Checked control points with their weights as (…, D + 1)."""
    values = np.asarray(points, np.float64)
    if values.ndim != axes or 0 in values.shape:
        raise InvalidGeometry("control points are missing or of different dimensions")
    if not np.abs(values).max() <= MAX_COORDINATE:  # true for NaN, too
        raise InvalidGeometry("a coordinate is not finite or too large")
    net = np.ones((*values.shape[:-1], values.shape[-1] + 1))
    net[..., :-1] = values
    if weights is None:
        return net
    factors = np.asarray(weights, np.float64)
    if factors.shape != values.shape[:-1]:
        raise InvalidGeometry("there is not one weight for each control point")
    low, high = float(factors.min()), float(factors.max())
    if not (low > 0.0 and np.isfinite(high)):
        raise InvalidGeometry("a weight is not positive")
    if high > MAX_WEIGHT_RATIO * low:
        raise InvalidGeometry("weights differ too much")
    if low < high:
        net *= (factors / high)[..., np.newaxis]
    return net


def _clamp(knots: FloatArray, degree: int, net: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Checked knots and control points (n, …) of a clamped spline without jumps."""
    knots = check_knots(knots, degree, len(net))
    pieces = int((np.diff(knots[degree:-degree]) > 0).sum())
    if pieces > MAX_PIECES or pieces * (degree + 1) ** 2 > MAX_BEZIER_POINTS:
        raise InvalidGeometry("a spline has too many spans")
    knots, net = _close_jumps(knots, degree, net)
    first, last = float(knots[degree]), float(knots[-degree - 1])
    if knots[0] == first and knots[-1] == last:
        return knots, net
    target = raise_knots(knots, degree, degree, first, last)
    return target, _refine(knots, degree, net, target, degree)


def _close_jumps(knots: FloatArray, degree: int, net: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The spline without one of two equal control points at each p + 1 equal inner knots."""
    low, high = knots[degree], knots[-degree - 1]
    is_jump = (knots[degree:] == knots[: len(knots) - degree]) & (knots[degree:] > low)
    at = np.flatnonzero(is_jump & (knots[degree:] < high))
    if not len(at):
        return knots, net
    # Knots at … at + p are equal: points at − 1 and at are the two ends.
    ends = project_points(net)
    size = JUMP * np.abs(ends).max()
    if np.abs(ends[at] - ends[at - 1]).max() > size:
        raise InvalidGeometry("a spline is discontinuous")
    if np.abs(net[at] - net[at - 1]).max() > 1e-6 * np.abs(net).max():
        raise InvalidGeometry("the weights of a spline are discontinuous")
    return np.delete(knots, at), np.delete(net, at, axis=0)


def _restrict(
    knots: FloatArray, degree: int, net: FloatArray, first: float, last: float
) -> tuple[FloatArray, FloatArray]:
    """Knots and control points (n, …) over [first, last]."""
    low, high = float(knots[0]), float(knots[-1])
    near = SNAP * (high - low)
    ends = []
    for value in (first, last):
        inside = min(max(value, low), high)
        nearest = float(knots[np.abs(knots - inside).argmin()])
        ends.append(nearest if abs(nearest - inside) <= near else inside)
    if not ends[0] < ends[1]:
        raise InvalidGeometry("a piece of a spline has no length")
    if ends == [low, high]:
        return knots, net
    target = raise_knots(knots, degree, degree, *ends)
    return target, _refine(knots, degree, net, target, degree)


def _refine(
    knots: FloatArray, degree: int, net: FloatArray, target: FloatArray, new_degree: int
) -> FloatArray:
    """Control points (N, …) over other knots, from control points (n, …)."""
    index, shares = find_refinement(knots, degree, target, new_degree)
    flat = net.reshape(len(net), -1)
    points = shares[0][:, np.newaxis] * flat[index[0]]
    for rows, share in zip(index[1:], shares[1:], strict=True):
        points += share[:, np.newaxis] * flat[rows]
    refined: FloatArray = points.reshape(-1, *net.shape[1:])
    return refined


def _reverse_knots(knots: FloatArray) -> FloatArray:
    """The knots of the reversed spline, over the same domain."""
    reversed_knots: FloatArray = (knots[0] + knots[-1]) - knots[::-1]
    reversed_knots[reversed_knots == reversed_knots[0]] = knots[0]
    reversed_knots[reversed_knots == reversed_knots[-1]] = knots[-1]
    return reversed_knots


def _differentiate(curve: Curve) -> Curve:
    """The derivative in homogeneous coordinates, of degree p − 1: p (P_i+1 − P_i) / ΔU."""
    degree, knots = curve.degree, curve.knots
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    # Steps over no length belong to no span.
    factor = degree / np.where(width > 0, width, np.inf)
    steps = np.diff(curve.points, axis=0) * factor[:, np.newaxis]
    return Curve(degree - 1, knots[1:-1], steps)


def _de_boor(curve: Curve, t: FloatArray) -> FloatArray:
    """Homogeneous points (k, D + 1) at parameters (k,)."""
    degree, knots = curve.degree, curve.knots
    t, span = _find_spans(degree, knots, t)
    rows = curve.points[span[:, np.newaxis] + np.arange(-degree, 1)]
    return _interpolate(degree, knots, rows, t, span)


def _de_boor_rows(degree: int, knots: FloatArray, nets: FloatArray, t: FloatArray) -> FloatArray:
    """Homogeneous points (k, D + 1) of k curves with nets (k, n, D + 1), one parameter each."""
    t, span = _find_spans(degree, knots, t)
    columns = span[:, np.newaxis] + np.arange(-degree, 1)
    rows = np.take_along_axis(nets, columns[..., np.newaxis], axis=1)
    return _interpolate(degree, knots, rows, t, span)


def _find_spans(degree: int, knots: FloatArray, t: FloatArray) -> tuple[FloatArray, Ints]:
    """Parameters in the domain, and their spans."""
    t = np.clip(t, knots[degree], knots[-degree - 1])
    # The last knot belongs to the last span of some length.
    last = int(np.searchsorted(knots, knots[-degree - 1], side="left")) - 1
    return t, np.minimum(np.searchsorted(knots, t, side="right") - 1, last)


def _interpolate(
    degree: int,
    knots: FloatArray,
    rows: FloatArray,
    t: FloatArray,
    span: Ints,
) -> FloatArray:
    """De Boor's algorithm on control points (k, p + 1, D)."""
    for level in range(1, degree + 1):
        at = span[:, np.newaxis] + np.arange(level - degree, 1)
        low, high = knots[at], knots[at + degree - level + 1]
        share = ((t[:, np.newaxis] - low) / (high - low))[..., np.newaxis]
        rows = (1.0 - share) * rows[:, :-1] + share * rows[:, 1:]
    result: FloatArray = rows[:, 0]
    return result
