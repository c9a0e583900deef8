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

from service.bases.arrays import FloatArray
from service.bases.blossoms import raise_knots
from service.decoders.cad.clamping import clamp, refine, restrict, to_homogeneous
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.de_boor import differentiate, interpolate, interpolate_rows
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.knot_vectors import MAX_DEGREE, to_floats
from service.surface.knots import MAX_BEZIER_POINTS, MAX_PIECES

Spline = TypeVar("Spline", Curve, Surface)

SNAP = 1e-9
"""Parameters that are nearer to a knot than this share of the domain are moved to it."""


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
    net = to_homogeneous(points, weights, 2)
    full = to_floats(knots)
    if (net == net[0]).all():
        raise InvalidGeometry("all control points of a curve are equal")
    full, net = clamp(full, degree, net)
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
    net = to_homogeneous(points, weights, 3)
    first, net = clamp(to_floats(knots[0]), degrees[0], net)
    second, turned = clamp(to_floats(knots[1]), degrees[1], net.swapaxes(0, 1))
    pieces = [len(set(each.tolist())) - 1 for each in (first, second)]
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
    return project_points(interpolate(curve, np.asarray(parameters, np.float64)))


def evaluate_derivatives(curve: Curve, parameters: ArrayLike) -> FloatArray:
    """Points, first and second derivatives (3, k, D) at parameters (k,).

    With A and w, the numerator and the denominator of C = A / w,

        C′ = (A′ − w′ C) / w,   C″ = (A″ − 2 w′ C′ − w″ C) / w.
    """
    t = np.asarray(parameters, np.float64)
    levels, each = [interpolate(curve, t)], curve
    for _ in range(2):
        if each.degree == 0:
            levels.append(np.zeros_like(levels[0]))
            continue
        each = differentiate(each)
        levels.append(interpolate(each, t))
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
    nets = interpolate(flat, rows).reshape(len(rows), count, 4)
    return project_points(interpolate_rows(surface.degrees[1], surface.knots[1], nets, columns))


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
    points = refine(curve.knots, curve.degree, curve.points, target, curve.degree)
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
    points = refine(curve.knots, curve.degree, curve.points, target, degree)
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
    return restrict(knots, degree, net, *ends)


def _reverse_knots(knots: FloatArray) -> FloatArray:
    """The knots of the reversed spline, over the same domain."""
    reversed_knots: FloatArray = (knots[0] + knots[-1]) - knots[::-1]
    reversed_knots[reversed_knots == reversed_knots[0]] = knots[0]
    reversed_knots[reversed_knots == reversed_knots[-1]] = knots[-1]
    return reversed_knots
