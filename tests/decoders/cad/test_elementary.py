"""Elementary surfaces: on their equations, with the parameters and normals of the standard."""

from collections.abc import Callable
from itertools import pairwise
from math import atan, cos, hypot, inf, nan, pi, sin, tan, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.decoders.cad.conics import Ellipse, Line
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import (
    Cone,
    Cylinder,
    Elementary,
    Plane,
    Sphere,
    Torus,
    find_gap,
)
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, build_frame
from service.decoders.cad.outline import NO_OUTLINE, Outline
from service.decoders.cad.splines import evaluate_surface

Array = NDArray[np.float64]

FRAME = build_frame((1.0, 2.0, 3.0), (0.3, -0.2, 0.9), (1.0, 0.2, 0.0))
U, V = (0.3, 5.0), (-0.7, 1.4)
"""Ranges for `trim`."""


def sample(surface: Surface, count: int = 23) -> tuple[Array, Array, Array]:
    """Local coordinates of a grid of points of a surface."""
    u, v = (np.linspace(knots[0], knots[-1], count) for knots in surface.knots)
    points = evaluate_surface(surface, np.repeat(u, count), np.tile(v, count))
    x, y, z = FRAME.locate_all(points)
    return x, y, z


def find_normals(surface: Surface, u: Array, v: Array) -> Array:
    """du × dv in local coordinates (3, k), by differences."""
    step = 1e-5
    du = evaluate_surface(surface, u + step, v) - evaluate_surface(surface, u - step, v)
    dv = evaluate_surface(surface, u, v + step) - evaluate_surface(surface, u, v - step)
    normals: Array = FRAME.locate_all(np.cross(du, dv) + np.array(FRAME.origin))
    normals /= np.linalg.norm(normals, axis=0)
    return normals


def place_cylinder(u: float, v: float) -> tuple[float, float, float]:
    return 2 * cos(u), 2 * sin(u), v


def place_cone(u: float, v: float) -> tuple[float, float, float]:
    return (2 + v * tan(0.4)) * cos(u), (2 + v * tan(0.4)) * sin(u), v


def place_sphere(u: float, v: float) -> tuple[float, float, float]:
    return 2 * cos(v) * cos(u), 2 * cos(v) * sin(u), 2 * sin(v)


def place_torus(u: float, v: float) -> tuple[float, float, float]:
    return (3 + cos(v)) * cos(u), (3 + cos(v)) * sin(u), sin(v)


@pytest.mark.parametrize(
    ("surface", "place"),
    [
        (Cylinder(FRAME, 2.0), place_cylinder),
        (Cone(FRAME, 2.0, 0.4), place_cone),
        (Sphere(FRAME, 2.0), place_sphere),
        (Torus(FRAME, 3.0, 1.0), place_torus),
    ],
)
def test_knots_are_the_parameters_of_the_standard(
    surface: Elementary, place: Callable[[float, float], tuple[float, float, float]]
) -> None:
    cut = surface.trim(U, V)
    assert (cut.knots[0][0], cut.knots[0][-1]) == pytest.approx(U)
    assert (cut.knots[1][0], cut.knots[1][-1]) == pytest.approx(V)
    u, v = (np.unique(knots) for knots in cut.knots)
    grid = [(a, b) for a in u.tolist() for b in v.tolist()]
    expected = np.array([FRAME.place(*place(a, b)) for a, b in grid])
    points = evaluate_surface(cut, [a for a, _ in grid], [b for _, b in grid])
    assert points == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "surface", [Cylinder(FRAME, 2.0), Cone(FRAME, 2.0, 0.4), Sphere(FRAME, 2.0)]
)
def test_normals_point_away_from_the_axis(surface: Elementary) -> None:
    cut = surface.trim(U, V)
    u, v = np.array([1.0, 2.0, 4.0]), np.array([0.5, -0.4, 1.0])
    x, y, z = FRAME.locate_all(evaluate_surface(cut, u, v))
    nx, ny, nz = find_normals(cut, u, v)
    assert (x * nx + y * ny > 0).all()
    if isinstance(surface, Sphere):
        assert x * nx + y * ny + z * nz == pytest.approx(np.full(3, 2.0))
    if isinstance(surface, Cone):
        assert nz == pytest.approx(np.full(3, -sin(0.4)))


def measure_excess(surface: Elementary, x: Array, y: Array, z: Array) -> Array:
    """The left sides of the implicit equations, 0 on the surface."""
    r = np.hypot(x, y)
    if isinstance(surface, Plane):
        return z
    if isinstance(surface, Cylinder):
        return r - surface.radius
    if isinstance(surface, Cone):
        return r - np.abs(surface.radius + z * tan(surface.angle))
    if isinstance(surface, Sphere):
        return np.sqrt(r**2 + z**2) - surface.radius
    outer, inner = np.hypot(r - surface.major, z), np.hypot(r + surface.major, z)
    return np.minimum(np.abs(outer - surface.minor), np.abs(inner - surface.minor))


SURFACES: tuple[Elementary, ...] = (
    Plane(FRAME),
    Cylinder(FRAME, 2.0),
    Cone(FRAME, 2.0, 0.4),
    Cone(FRAME, 2.0, -0.4),
    Sphere(FRAME, 2.0),
    Torus(FRAME, 3.0, 1.0),
    Torus(FRAME, 1.0, 2.0),
    Torus(FRAME, 1.0, 2.0, is_outer=False),
)


@pytest.mark.parametrize("surface", SURFACES)
def test_surfaces_satisfy_their_equations(surface: Elementary) -> None:
    arc = Ellipse(FRAME.move(FRAME.place(0, 0, 1)), 1.5, 1.5).cut(0.2, 4.0)
    cut = surface.cut(Outline.of([arc]))
    assert np.abs(measure_excess(surface, *sample(cut))).max() < 1e-12


@pytest.mark.parametrize("surface", SURFACES[:7])
@pytest.mark.parametrize("distance", [0.3, -0.3])
def test_offsets_are_at_their_distance_along_the_normal(
    surface: Elementary, distance: float
) -> None:
    base, moved = surface.trim(U, V), surface.offset(distance).trim(U, V)
    u, v = np.array([1.0, 2.0, 4.0]), np.array([0.0, 0.5, 1.0])
    points = FRAME.locate_all(evaluate_surface(base, u, v))
    shifted = points + distance * find_normals(base, u, v)
    excess = measure_excess(surface.offset(distance), *shifted)
    expected = distance if isinstance(surface, Plane) else 0.0
    assert excess == pytest.approx(np.full(3, expected), abs=1e-8)
    own = find_normals(moved, u, v)
    assert (own * find_normals(base, u, v)).sum(axis=0) == pytest.approx(np.ones(3), abs=1e-8)


@given(point=st.tuples(*[st.floats(-5, 5)] * 3), index=st.integers(0, len(SURFACES) - 1))
def test_distances_from_surfaces(point: Vector, index: int) -> None:
    """No point of a grid on the surface is nearer, and one is nearly as near."""
    surface = SURFACES[index]
    points = np.array([FRAME.place(*point)])
    found = float(surface.measure(points)[0])
    ranges = {Plane: ((-9.0, 9.0), (-9.0, 9.0)), Cylinder: ((0.0, tau), (-9.0, 9.0))}
    ranges |= {Cone: ((0.0, tau), (-16.0, 16.0))}
    if type(surface) in ranges:
        cut = surface.trim(*ranges[type(surface)])
    else:
        cut = surface.cut(NO_OUTLINE)
    x, y, z = sample(cut, 61)
    grid = np.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2 + (z - point[2]) ** 2)
    assert grid.min() < found + 0.6
    if isinstance(surface, Torus) and surface.minor > surface.major:
        return  # the nearer part may be the other one
    assert found <= grid.min() + 1e-9


def test_the_gap_of_a_face_is_the_largest_distance_of_its_edges() -> None:
    arc = Ellipse(FRAME, 2.0, 2.0 + 1e-3).cut(0.0, pi)
    outline = Outline.of([arc])
    assert find_gap(Cylinder(FRAME, 2.0), outline) < 1e-14
    middles = np.array([Ellipse(FRAME, 2.0, 2.0 + 1e-3).evaluate(pi / 2)])
    with_middles = Outline(outline.hull, outline.ends, (), middles)
    assert find_gap(Cylinder(FRAME, 2.0), with_middles) == pytest.approx(1e-3)
    assert find_gap(Sphere(FRAME, 2.0), NO_OUTLINE) == 0.0


def test_a_plane_is_cut_to_the_outline_of_its_face_with_a_margin() -> None:
    corners = [FRAME.place(a, b) for a, b in ((1, 1), (4, 1), (4, 3))]
    edges = [Line(a, tuple(np.subtract(b, a))).cut(0, 1) for a, b in pairwise(corners)]
    cut = Plane(FRAME).cut(Outline.of(edges))
    x, y, z = sample(cut, 2)
    for values, ends in ((x, (1, 4)), (y, (1, 3))):
        assert ends[0] - 5e-3 < values.min() < ends[0] - 1e-3
        assert ends[1] + 1e-3 < values.max() < ends[1] + 5e-3
    assert np.abs(z).max() < 1e-14
    assert cut.knots[0][[0, -1]] == pytest.approx((x.min(), x.max()))


def build_band(low: float, high: float, first: float, last: float, radius: float = 2.0) -> Outline:
    """Two arcs at two heights, and two lines between them."""
    arcs = [
        Ellipse(FRAME.move(FRAME.place(0, 0, h)), radius, radius).cut(first, last)
        for h in (low, high)
    ]
    sides = [np.stack([arc.points[k] for arc in arcs]) for k in (0, -1)]
    ends = [Curve(1, np.array([0.0, 0, 1, 1]), side) for side in sides]
    return Outline.of([*arcs, *ends])


@given(
    first=st.floats(-4, 4),
    sweep=st.floats(0.01, tau),
    low=st.floats(-5, 5),
    height=st.floats(0.01, 5),
)
def test_cylinders_cover_their_outline(
    first: float, sweep: float, low: float, height: float
) -> None:
    cut = Cylinder(FRAME, 2.0).cut(build_band(low, low + height, first, first + sweep))
    v0, v1 = cut.knots[1][[0, -1]]
    assert low - 0.01 < v0 < low
    assert low + height < v1 < low + height + 0.01
    u0, u1 = cut.knots[0][[0, -1]]
    if sweep <= pi - 1e-6:
        assert u1 - u0 == pytest.approx(sweep, rel=3e-3)
    elif sweep > pi + 1e-5:
        assert (u0, u1) == pytest.approx((0, tau))
        assert (cut.points[0] == cut.points[-1]).all()
    inside = (first + np.linspace(0, sweep, 9) - u0) % tau
    assert (np.minimum(inside, tau - inside) <= max(u1 - u0, 0) + 1e-9).all()
    assert (inside <= u1 - u0 + 1e-9).all()


def test_an_outline_of_both_sides_of_a_cone_is_cut_at_the_apex() -> None:
    cone = Cone(FRAME, 2.0, atan(0.5))  # the apex is at height −4
    band = build_band(-4.001, 1.0, 0.0, tau)
    cut = cone.cut(band)
    assert cut.knots[1][0] == pytest.approx(-4.0)
    apex = evaluate_surface(cut, np.linspace(0, tau, 9), np.full(9, -5.0))
    assert np.ptp(apex, axis=0).max() < 8e-15
    below = cone.cut(build_band(-9.0, -3.9, 0.0, tau))
    assert below.knots[1][-1] == pytest.approx(-4.0)


@pytest.mark.parametrize("angle", [0.5, -0.5])
@pytest.mark.parametrize("low", [-9.0, -3.0])
def test_half_cones_are_wedges_on_either_side_of_the_apex(low: float, angle: float) -> None:
    cone = Cone(FRAME, 2.0, atan(angle))
    heights = (low, low + 2.0) if angle > 0 else (-low, -low - 2.0)
    radii = [abs(2.0 + h * angle) for h in heights]
    arcs = [
        Ellipse(FRAME.move(FRAME.place(0, 0, h)), r, r).cut(1.0, 1.0 + pi)
        for h, r in zip(heights, radii, strict=True)
    ]
    cut = cone.cut(Outline.of(arcs))
    assert len(cut.points) == 7
    x, y, _ = sample(cut)
    # All points of the arcs are covered: the side y cos 1 ≥ x sin 1 of the axis.
    across = y * cos(1.0) - x * sin(1.0)
    assert across.min() > -0.02
    assert across.max() == pytest.approx(max(radii), rel=0.02)


def test_a_spindle_is_the_part_on_which_the_edges_are() -> None:
    torus = Torus(FRAME, 1.0, 2.0)
    outer = Ellipse(FRAME, 3.0, 3.0).cut(0.0, 2.0)
    inner = Ellipse(FRAME, 1.0, 1.0).cut(0.0, 2.0)
    assert np.hypot(*sample(torus.cut(Outline.of([outer])))[:2]).max() == pytest.approx(3.0)
    assert np.hypot(*sample(torus.cut(Outline.of([inner])))[:2]).max() == pytest.approx(1.0)
    assert torus.cut(NO_OUTLINE).knots[1][0] == -torus.cut(NO_OUTLINE).knots[1][-1]


def test_cuts_do_not_depend_on_the_order_of_edges() -> None:
    outline = build_band(0.0, 2.0, 0.5, 2.0)
    backwards = Outline(outline.hull[::-1], outline.ends[::-1])
    for surface in SURFACES:
        one, other = surface.cut(outline), surface.cut(backwards)
        assert (one.points == other.points).all()


@pytest.mark.parametrize("size", [0.0, -1.0, nan, inf])
def test_wrong_sizes_are_refused(size: float) -> None:
    for build in (
        lambda: Cylinder(FRAME, size),
        lambda: Sphere(FRAME, size),
        lambda: Torus(FRAME, 3.0, size),
        lambda: Plane(FRAME).trim((0.0, size), V),
    ):
        with pytest.raises(InvalidGeometry):
            build()
    for build_more in (
        lambda: Cone(FRAME, 1.0, pi / 2),
        lambda: Cone(FRAME, nan, 0.3),
        lambda: Torus(FRAME, -1.0, 0.3),
        lambda: Cylinder(FRAME, 1.0).offset(-1.0),
        lambda: Plane(FRAME).offset(nan),
    ):
        with pytest.raises(InvalidGeometry):
            build_more()


def test_unbounded_surfaces_need_edges() -> None:
    point = Outline(np.ones((3, 3)), np.ones((2, 3)))
    for surface in SURFACES[:4]:
        with pytest.raises(InvalidGeometry, match="no edges"):
            surface.cut(NO_OUTLINE)
        with pytest.raises(InvalidGeometry, match="one point"):
            surface.cut(point)


def test_empty_and_too_large_ranges_are_refused() -> None:
    for surface in SURFACES:
        for ranges in (((1.0, 1.0), V), (U, (0.4, 0.4)), (U, (nan, 1.0)), ((0.0, nan), V)):
            with pytest.raises(InvalidGeometry):
                surface.trim(*ranges)
    with pytest.raises(InvalidGeometry, match="full turn"):
        Cylinder(FRAME, 1.0).trim((0.0, 7.0), V)
    with pytest.raises(InvalidGeometry, match="too large"):
        Cylinder(FRAME, 1e13).trim(U, V)
    assert hypot(*Sphere(FRAME, 1.0).trim(U, (-2.0, 2.0)).knots[1][[0, -1]]) == hypot(
        pi / 2, pi / 2
    )
