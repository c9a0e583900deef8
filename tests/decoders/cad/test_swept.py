"""Extrusions and revolutions: the standard's parameters, and parts that cover the outline."""

from math import atan, cos, pi, sin, sqrt, tan, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import least_squares

from service.decoders.cad.conics import BasisCurve, Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, build_frame
from service.decoders.cad.outline import NO_OUTLINE, Outline
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.profiles import cut_basis
from service.decoders.cad.splines import build_curve, evaluate, evaluate_surface, find_domain
from service.decoders.cad.swept import Extrusion, Revolution, rule
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.cad.test_solids import measure_spindle
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

Array = NDArray[np.float64]

FRAME = build_frame((1.0, 2.0, 3.0), (0.3, -0.2, 0.9), (1.0, 0.2, 0.0))
ORIGIN, Z = FRAME.origin, FRAME.z

CORNERS = (1, 0, 0), (2, 1, 0.5), (3, 0, 1), (2, 0, 2)
SPLINE = build_curve(3, [0, 0, 0, 0, 2, 2, 2, 2], [FRAME.place(*corner) for corner in CORNERS])

BASES: tuple[BasisCurve, ...] = (
    Line(FRAME.place(2, 0, 0), FRAME.x),
    Ellipse(FRAME, 2.0, 1.0),
    Parabola(FRAME, 0.5),
    Hyperbola(FRAME, 1.0, 2.0),
    SPLINE,
)


def to_vector(a: float, b: float, c: float) -> Vector:
    """The vector with these local coordinates."""
    x, y, z = np.subtract(FRAME.place(a, b, c), ORIGIN).tolist()
    return x, y, z


def outline_of(points: Array) -> Outline:
    return Outline(points, points)


def find_distances(surface: Surface, points: Array) -> Array:
    """Distances of points from a surface, by least squares from the nearest sample."""
    low, high = (np.array([knots[k] for knots in surface.knots]) for k in (0, -1))
    grid = low + (high - low) * np.stack(np.divmod(np.arange(65 * 65), 65), axis=1) / 64
    samples = evaluate_surface(surface, *grid.T)
    result = []
    for point in points:
        start = grid[np.square(samples - point).sum(axis=1).argmin()]
        found = least_squares(
            lambda place, goal=point: (evaluate_surface(surface, *place[:, np.newaxis]) - goal)[0],
            np.clip(start, low, high),
            bounds=(low, high),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        result.append(float(np.sqrt(2 * found.cost)))
    return np.array(result)


@pytest.mark.slow
@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("vector", [to_vector(0, 0, 2), to_vector(0.5, -1, 2)])
def test_extrusions_cover_their_outline(basis: BasisCurve, vector: Vector) -> None:
    curve = basis if basis is SPLINE else cut_basis(basis, (-0.7, 0.9))
    t = np.linspace(*find_domain(curve), 9)
    base = evaluate(curve, t)
    points = np.concatenate([base + k * np.array(vector) for k in (-1.0, 0.3, 2.0)])
    surface = Extrusion(basis, vector).cut(outline_of(points))
    assert find_distances(surface, points).max() < 1e-6
    # Not much more than the outline.
    if basis is not SPLINE:
        low, high = surface.knots[1][[0, -1]]
        assert (low, high) == pytest.approx((-1, 2), abs=0.02)
    if isinstance(basis, Line | Parabola | Hyperbola):
        assert surface.knots[0][[0, -1]] == pytest.approx((-0.7, 0.9), abs=0.02)


def test_the_parameters_of_extrusions_are_those_of_the_standard() -> None:
    vector = to_vector(0.5, -1, 2)
    surface = Extrusion(SPLINE, vector).trim(None, (-1.0, 3.0))
    u, v = np.array([0.0, 0.7, 2.0]), np.array([-1.0, 0.5, 3.0])
    expected = evaluate(SPLINE, u) + v[:, np.newaxis] * np.array(vector)
    assert evaluate_surface(surface, u, v) == pytest.approx(expected)
    part = Extrusion(SPLINE, vector).trim((0.5, 1.0), (0.0, 1.0))
    assert part.knots[0][[0, -1]].tolist() == [0.5, 1.0]


@pytest.mark.parametrize(
    ("basis", "vector"), [(BASES[0], FRAME.x), (BASES[1], FRAME.y), (BASES[2], (0.0, 0.0, 0.0))]
)
def test_flat_extrusions_are_refused(basis: BasisCurve, vector: Vector) -> None:
    points = np.array([FRAME.place(0, 0, 0), FRAME.place(1, 1, 1)])
    with pytest.raises(InvalidGeometry):
        Extrusion(basis, vector).cut(outline_of(points))


def turn(points: Array, angle: float) -> Array:
    """Points turned about the z axis of the frame."""
    x, y, z = FRAME.locate_all(points)
    c, s = cos(angle), sin(angle)
    turned = zip((c * x - s * y).tolist(), (s * x + c * y).tolist(), z.tolist(), strict=True)
    return np.array([FRAME.place(*point) for point in turned])


UPRIGHT = build_frame(FRAME.place(1.0, 0, 0), FRAME.y, FRAME.z)
"""A frame with the axis as its x, at the distance 1 from the axis."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("basis", "parameters"),
    [
        (Line(FRAME.place(2, 0, 0), FRAME.z), (-1.0, 3.0)),
        (Line(FRAME.place(2, 0, 0), to_vector(0.5, 0, 2)), (-1.0, 2.0)),
        (Line(FRAME.place(2, 0, 0), to_vector(0.3, 1, 1)), (-1.0, 2.0)),
        (Line(FRAME.place(2, 0, 1), FRAME.x), (-1.5, 2.0)),
        (Line(FRAME.place(2, 1, 1), FRAME.x), (-1.5, 2.0)),
        (Ellipse(build_frame(FRAME.place(4.0, 0, 0), FRAME.y, FRAME.x), 2.0, 1.0), (0.0, tau)),
        (Parabola(build_frame(ORIGIN, FRAME.y, FRAME.z), 0.5), (0.0, 3.0)),
        (Parabola(UPRIGHT, 0.5), (-3.0, 2.0)),
        (Hyperbola(build_frame(ORIGIN, FRAME.y, FRAME.z), 1.0, 0.5), (0.0, 2.0)),
        (SPLINE, (0.0, 2.0)),
    ],
)
def test_revolutions_cover_their_outline(
    basis: BasisCurve, parameters: tuple[float, float]
) -> None:
    curve = cut_basis(basis, parameters)
    base = evaluate(curve, np.linspace(*find_domain(curve), 7))
    points = np.concatenate([turn(base, angle) for angle in (0.3, 2.0, 4.0)])
    surface = Revolution(basis, ORIGIN, Z).cut(outline_of(points))
    assert find_distances(surface, points).max() < 1e-6
    if not isinstance(basis, Parabola | Hyperbola):
        # Not much more: in the box of the outline's turns.
        far = np.sqrt(np.square(FRAME.locate_all(points)).sum(axis=0)).max()
        u, v = (np.linspace(knots[0], knots[-1], 20) for knots in surface.knots)
        own = FRAME.locate_all(evaluate_surface(surface, np.repeat(u, 20), np.tile(v, 20)))
        assert np.sqrt(np.square(own).sum(axis=0)).max() < 1.02 * far


def test_the_parameters_of_revolutions_are_those_of_the_standard() -> None:
    surface = Revolution(SPLINE, ORIGIN, Z).cut(NO_OUTLINE)
    assert surface.knots[0][[0, -1]] == pytest.approx((0, tau))
    v = np.array([0.0, 0.4, 1.1, 2.0])
    for quarter in range(5):
        angle = quarter * pi / 2
        points = evaluate_surface(surface, np.full(4, angle), v)
        assert points == pytest.approx(turn(evaluate(SPLINE, v), angle))
    part = Revolution(SPLINE, ORIGIN, Z).trim((0.5, 1.5), (0.5, 1.0))
    ends = evaluate_surface(part, [0.5, 1.5], [0.7, 0.7])
    expected = [turn(evaluate(SPLINE, [0.7]), angle)[0] for angle in (0.5, 1.5)]
    assert ends == pytest.approx(np.array(expected))


def test_a_line_through_the_axis_ends_at_the_apex() -> None:
    line = Line(FRAME.place(0, 0, 1), to_vector(tan(0.3), 0, 1))  # the apex is at t = 0
    ring = Ellipse(FRAME.move(FRAME.place(0, 0, 3)), 2 * tan(0.3), 2 * tan(0.3)).cut_whole()
    high = Ellipse(FRAME.move(FRAME.place(0, 0, 1.001)), 1e-3, 1e-3).cut_whole()
    surface = Revolution(line, ORIGIN, Z).cut(Outline.of([ring, high]))
    assert surface.knots[1][0] == pytest.approx(0.0, abs=1e-15)
    tip = evaluate_surface(surface, np.linspace(0, tau, 5), np.zeros(5))
    assert np.ptp(tip, axis=0).max() < 1e-14
    # A ring alone, around which the face runs, has the apex inside.
    around = Outline(Outline.of([ring]).hull, Outline.of([ring]).ends, (9,))
    whole = Revolution(line, ORIGIN, Z).cut(around)
    assert whole.knots[1][0] == pytest.approx(0.0, abs=1e-15)


def test_poles_of_revolutions_are_points() -> None:
    arc = Ellipse(build_frame(ORIGIN, FRAME.y, FRAME.z), 2.0, 2.0).cut(0.0, pi)
    surface = Revolution(arc, ORIGIN, Z).cut(NO_OUTLINE)
    net = surface.points[..., :3] / surface.points[..., 3:]
    for column in (0, -1):
        assert np.ptp(net[:, column], axis=0).max() < 1e-15 * 8
    assert find_distances(surface, np.array([FRAME.place(0, sqrt(2), sqrt(2))]))[0] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("offset", "is_outer", "expected"),
    [
        (0.0, True, 4 / 3 * pi * 8),
        (1.0, True, measure_spindle(1.0, 2.0, True)),
        (1.0, False, measure_spindle(1.0, 2.0, False)),
        (-1.0, True, measure_spindle(1.0, 2.0, True)),
        (-1.0, False, measure_spindle(1.0, 2.0, False)),
        (3.0, True, 2 * pi**2 * 3 * 4),
    ],
)
def test_a_circle_that_crosses_the_axis_makes_a_sphere_or_a_spindle(
    offset: float, is_outer: bool, expected: float
) -> None:
    """Its whole turn would cover the surface twice."""
    circle = Ellipse(build_frame(FRAME.place(offset, 0, 0.5), FRAME.y, FRAME.x), 2.0, 2.0)
    radius = 2 + abs(offset) if is_outer else 2 - abs(offset)
    ring = Ellipse(FRAME.move(FRAME.place(0, 0, 0.5)), radius, radius)
    surface = Revolution(circle, ORIGIN, Z).cut(Outline.of([ring.cut_whole()]))
    builder = PartBuilder()
    builder.add_shell([builder.add_face(surface, [])], True)
    part = builder.build()
    assert part is not None
    volume, cracks = measure_part(part)
    assert not cracks
    assert abs(volume) == pytest.approx(expected, rel=0.02)


def test_an_ellipse_beside_the_axis_stays_whole() -> None:
    for frame in (
        build_frame(FRAME.place(0, 1.0, 0), FRAME.y, FRAME.x),  # in a plane beside the axis
        build_frame(FRAME.place(0.5, 0, 0), to_vector(0, 1, 1), FRAME.x),  # in an oblique plane
        build_frame(FRAME.place(5.0, 0, 0), FRAME.y, FRAME.x),
    ):
        surface = Revolution(Ellipse(frame, 2.0, 1.0), ORIGIN, Z).cut(NO_OUTLINE)
        assert surface.points.shape[1] == 9
        assert (surface.points[:, 0] == surface.points[:, -1]).all()


def test_a_disc_that_does_not_reach_its_edges_is_refused() -> None:
    line = Line(FRAME.place(0, 5, 0), FRAME.x)
    points = np.array([FRAME.place(1, 0, 0), FRAME.place(0, 2, 0)])
    with pytest.raises(InvalidGeometry, match="not on its surface"):
        Revolution(line, ORIGIN, Z).cut(outline_of(points))


def test_unbounded_curves_have_no_whole() -> None:
    for basis in BASES[:1] + BASES[2:4]:
        with pytest.raises(InvalidGeometry, match="no ends"):
            cut_basis(basis, None)
    assert cut_basis(SPLINE, None) is SPLINE


@given(a=knot_vectors(max_spans=3), b=knot_vectors(max_spans=3), seed=st.integers(0, 2**32 - 1))
def test_ruled_surfaces_join_equal_parameters(a: KnotVector, b: KnotVector, seed: int) -> None:
    first, second = (
        build_curve(
            each.degree,
            each.knots,
            random_points(each.point_count, seed + k),
            random_weights(each.point_count, seed + k),
        )
        for k, each in enumerate((a, b))
    )
    surface = rule(first, second)
    share = np.linspace(0, 1, 9)
    for curve, v in ((first, 0.0), (second, 1.0)):
        low, high = find_domain(curve)
        expected = evaluate(curve, low + share * (high - low))
        points = evaluate_surface(surface, share, np.full(9, v))
        assert points == pytest.approx(expected, abs=1e-7)
    middle = evaluate_surface(surface, share, np.full(9, 0.5))
    ends = [evaluate_surface(surface, share, np.full(9, v)) for v in (0.0, 1.0)]
    along, whole = middle - ends[0], ends[1] - ends[0]
    assert np.linalg.norm(np.cross(along, whole), axis=1) == pytest.approx(np.zeros(9), abs=1e-9)


def test_knots_of_ruled_surfaces_that_differ_by_rounding_are_one() -> None:
    """Between them there would be a span that later steps cannot divide by."""
    points = [[0, 0, 0], [1, 2, 0], [2, 0, 0], [3, 1, 0], [4, 0, 0]]
    curves = [build_curve(2, [0, 0, 0, k, k, 1, 1, 1], points) for k in (1 / 3, 1 / 3 + 1e-14)]
    surface = rule(*curves)
    assert surface.knots[0] == pytest.approx([0, 0, 0, 1 / 3, 1 / 3, 1, 1, 1])
    close = build_curve(1, [0, 0, 0.5, 0.5 + 9.5e-13, 1, 1], points[:4])
    assert np.isfinite(rule(close, curves[0]).points).all()


def test_a_cone_as_a_revolution_is_the_cone() -> None:
    angle = atan(0.5)
    line = Line(FRAME.place(2, 0, 0), to_vector(0.5, 0, 1))
    ring = Ellipse(FRAME.move(FRAME.place(0, 0, 2)), 3.0, 3.0).cut(0.0, 2.0)
    other = Ellipse(FRAME, 2.0, 2.0).cut(0.0, 2.0)
    surface = Revolution(line, ORIGIN, Z).cut(Outline.of([ring, other]))
    u, v = (np.linspace(knots[0], knots[-1], 11) for knots in surface.knots)
    x, y, z = FRAME.locate_all(evaluate_surface(surface, np.repeat(u, 11), np.tile(v, 11)))
    assert np.hypot(x, y) == pytest.approx(2 + z * tan(angle))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_face_beside_the_axis_is_on_its_side_of_a_large_circle(side: float) -> None:
    """A circle of the radius 232 crosses the axis beside a face that is 1.3 wide."""
    radius, middle, height = 232.14, 18.04, -231.4
    circle = Ellipse(build_frame(FRAME.place(middle, 0, height), FRAME.y, FRAME.x), radius, radius)
    # Of both circles that this makes in a plane, one has each face.
    rings = []
    for distance in (0.375, 1.65):
        up = height + sqrt(radius**2 - (side * distance - middle) ** 2)
        rings.append(Ellipse(FRAME.move(FRAME.place(0, 0, up)), distance, distance))
    surface = Revolution(circle, ORIGIN, Z).cut(Outline.of([ring.cut_whole() for ring in rings]))
    low, high = surface.knots[1][[0, -1]]
    v = np.concatenate([low + np.linspace(1e-3, 8e-3, 8), high - np.linspace(1e-3, 8e-3, 8)])
    x, y, z = FRAME.locate_all(evaluate_surface(surface, np.full(16, 1.0), v))
    distances = np.hypot(x, y)
    expected = height + np.sqrt(radius**2 - (side * distances - middle) ** 2)
    assert (np.abs(z - expected) < 1e-9).sum() == 8  # the end at the other crossing is elsewhere
