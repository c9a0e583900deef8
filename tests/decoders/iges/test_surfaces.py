"""Surfaces of each type, compared with their equations."""

from math import cos, pi, radians, sin, tan

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.outline import NO_OUTLINE, Outline
from service.decoders.cad.splines import evaluate_surface, transform
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.surfaces import BaseSurface
from tests.decoders.iges.reading import build_readers
from tests.decoders.iges.writing import Word, Writer, add_line

TURN = [0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""A matrix that turns x to y, and then moves along x by 5."""

POINTS = Outline(
    np.array([[-1.0, -2, 0.5], [1, 2, 3.0], [2, 0, 1.0]]), np.array([[1.0, 2, 3], [2, 0, 1]])
)


def read_base(writer: Writer, number: int) -> BaseSurface:
    return build_readers(writer).surfaces.read(number)


def read_surface(kind: int, *words: Word, form: int = 0) -> Surface:
    writer = Writer()
    return read_base(writer, writer.add(kind, *words, form=form)).cut(POINTS)


def sample(surface: Surface, count: int = 6) -> FloatArray:
    """Points on a grid of parameters, (count², 3)."""
    u, v = (np.linspace(knots[0], knots[-1], count) for knots in surface.knots)
    grid = np.meshgrid(u, v, indexing="ij")
    return evaluate_surface(surface, grid[0].ravel(), grid[1].ravel())


def find_normal(surface: Surface, u: float, v: float) -> FloatArray:
    step = 1e-5
    s, a, b = evaluate_surface(surface, [u, u + step, u], [v, v, v + step])
    normal = np.cross(a - s, b - s)
    unit: FloatArray = normal / np.linalg.norm(normal)
    return unit


def test_a_plane_by_its_equation_covers_the_outline() -> None:
    plane = read_surface(108, 0.0, 3.0, 4.0, 10.0)
    points = sample(plane)
    np.testing.assert_allclose(points @ [0, 3, 4], 10)
    np.testing.assert_allclose(
        find_normal(plane, *(knots.mean() for knots in plane.knots)), [0, 0.6, 0.8], atol=1e-9
    )
    feet = POINTS.hull - np.outer((POINTS.hull @ [0, 3, 4] - 10) / 25, [0, 3, 4])
    assert (feet >= points.min(axis=0) - 1e-9).all()
    assert (feet <= points.max(axis=0) + 1e-9).all()
    with pytest.raises(Fault):
        read_surface(108, 0.0, 0.0, 0.0, 10.0)


def add_frame(writer: Writer, axis: tuple[float, float, float]) -> list[int]:
    """A point, the axis and a direction of reference."""
    return [
        writer.add(116, 1.0, 2.0, 3.0, status="00010000"),
        writer.add(123, *axis, status="00010200"),
        writer.add(123, 0.0, 1.0, 0.0, status="00010200"),
    ]


@pytest.mark.parametrize("has_matrix", [False, True])
@pytest.mark.parametrize("form", [0, 1])
def test_elementary_surfaces(form: int, has_matrix: bool) -> None:
    writer = Writer()
    origin, axis, reference = add_frame(writer, (0.0, 0.0, 2.0))
    last = [reference] if form else []
    matrix = writer.add(124, *TURN) if has_matrix else 0
    kinds: dict[int, list[Word]] = {
        190: [origin, axis],
        192: [origin, axis, 2.0],
        194: [origin, axis, 2.0, 30.0],
        196: [origin, 2.0, *([axis] if form else [])],
        198: [origin, axis, 3.0, 1.0],
    }
    numbers = {
        kind: writer.add(kind, *words, *last, form=form, matrix=matrix)
        for kind, words in kinds.items()
    }
    back = np.linalg.inv(np.array([*TURN, 0, 0, 0, 1]).reshape(4, 4))
    for kind, number in numbers.items():
        base = read_base(writer, number)
        surface = base.cut(POINTS)
        local = transform(surface, back) if has_matrix else surface
        x, y, z = (sample(local) - [1, 2, 3]).T
        r = np.hypot(x, y)
        distances = {
            190: z,
            192: r - 2,
            194: r - 2 - z * tan(radians(30)),
            196: np.sqrt(r**2 + z**2) - 2,
            198: np.hypot(r - 3, z) - 1,
        }
        np.testing.assert_allclose(distances[kind], 0, atol=1e-9)
        assert base.is_bounded == (kind in (196, 198))
        # Normals point outwards, and that of a plane along its own.
        u, v = (float(knots[1] + np.ptp(knots) / 3) for knots in local.knots)
        normal = find_normal(local, u, v)
        (point,) = evaluate_surface(local, [u], [v]) - [1, 2, 3]
        if kind == 190:
            np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-9)
        elif kind == 198:
            ring = 3 * point * [1, 1, 0] / np.hypot(*point[:2])
            assert normal @ (point - ring) > 0.99
        else:
            assert normal @ (point * [1, 1, kind == 196]) > 0


def test_mirrored_cylinders_are_cut_too() -> None:
    writer = Writer()
    origin, axis, _ = add_frame(writer, (0.0, 0.0, 1.0))
    mirror = writer.add(124, -1.0, *[0.0] * 4, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, form=1)
    number = writer.add(192, origin, axis, 2.0, matrix=mirror)
    outline = Outline(np.array([[1.0, 2, -7], [-3.0, 2, 9]]), np.zeros((0, 3)))
    points = sample(read_base(writer, number).cut(outline), 9)
    np.testing.assert_allclose(np.hypot(points[:, 0] + 1, points[:, 1] - 2), 2)
    assert points[:, 2].min() < -7
    assert points[:, 2].max() > 9


def test_planes_without_an_outline_have_no_ends() -> None:
    writer = Writer()
    number = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    with pytest.raises(InvalidGeometry):
        read_base(writer, number).cut(NO_OUTLINE)


def test_a_surface_of_revolution_has_the_curve_first_and_the_angle_second() -> None:
    writer = Writer()
    axis = add_line(writer, (1, 0, 0), (1, 0, 5))
    curve = writer.add(110, 3.0, 0.0, 0.0, 2.0, 0.0, 4.0)
    surface = read_base(writer, writer.add(120, axis, curve, 0.0, pi / 2)).cut(NO_OUTLINE)
    assert [(k[0], k[-1]) for k in surface.knots] == [(0, 1), (0, pytest.approx(pi / 2))]
    # Counter-clockwise about the axis.
    ends = evaluate_surface(surface, [0, 1, 0, 0.5], [0, 0, pi / 2, pi / 4])
    middle = [1 + 1.5 * cos(pi / 4), 1.5 * sin(pi / 4), 2]
    np.testing.assert_allclose(
        ends, np.array([[3.0, 0, 0], [2, 0, 4], [1, 2, 0], middle]), atol=1e-12
    )
    whole = read_base(writer, writer.add(120, axis, curve, 0.0, 6.283185307)).cut(NO_OUTLINE)
    first, last = evaluate_surface(whole, [0.5, 0.5], whole.knots[1][[0, -1]])
    np.testing.assert_array_equal(first, last)


def test_a_tabulated_cylinder_runs_from_its_curve_to_its_end() -> None:
    writer = Writer()
    curve = add_line(writer, (0, 0, 0), (2, 0, 0), (2, 2, 0))
    surface = read_base(writer, writer.add(122, curve, 0.0, 0.0, 3.0)).cut(NO_OUTLINE)
    assert [(k[0], k[-1]) for k in surface.knots] == [(0, 1), (0, 1)]
    points = evaluate_surface(surface, [0, 0.25, 0.75, 1], [0, 0.5, 0.5, 1])
    np.testing.assert_allclose(points, np.array([[0.0, 0, 0], [1, 0, 1.5], [2, 1, 1.5], [2, 2, 3]]))


@pytest.mark.parametrize("is_crossed", [False, True])
def test_a_ruled_surface_joins_points_with_equal_parameters(is_crossed: bool) -> None:
    writer = Writer()
    first = add_line(writer, (0, 0, 0), (1, 0, 0), (1, 1, 0))
    second = writer.add(110, 0.0, 0.0, 5.0, 4.0, 0.0, 5.0)
    number = writer.add(118, first, second, int(is_crossed), 0, form=1)
    surface = read_base(writer, number).cut(NO_OUTLINE)
    points = evaluate_surface(surface, [0.0, 0.25, 0.25, 1.0], [0.0, 0.0, 1.0, 0.5])
    there, end = (3.0, 0.0) if is_crossed else (1.0, 4.0)
    expected = np.array([[0, 0, 0], [0.5, 0, 0], [there, 0, 5], [(1 + end) / 2, 0.5, 2.5]])
    np.testing.assert_allclose(points, expected)


def test_surfaces_ruled_by_the_lengths_of_curves_are_read_where_these_are_even() -> None:
    writer = Writer()
    line = add_line(writer, (0, 0, 5), (4, 0, 5))
    other = add_line(writer, (0, 0, 0), (1, 0, 0))
    quarter = writer.add(100, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    polyline = writer.add(106, 1, 3, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 2.0, form=11)
    read_base(writer, writer.add(118, line, other, 0, 0))
    read_base(writer, writer.add(118, quarter, quarter, 0, 0))
    for curves in ((line, polyline), (line, quarter)):
        with pytest.raises(Unsupported):
            read_base(writer, writer.add(118, *curves, 0, 0))


def test_parametric_spline_surfaces_are_pieces_of_powers() -> None:
    # z = u v² + u³ over [0, 3] × [0, 2], in 2 × 1 pieces; one without a meaning ends each row.
    breaks = [0.0, 1.0, 3.0]
    blocks = []
    for start in breaks[:-1]:
        x, y, z = np.zeros((3, 4, 4))  # powers of v, of u
        x[0, :2] = start, 1
        y[1, 0] = 1
        z[2, :2] = start, 1
        z[0] = start**3, 3 * start**2, 3 * start, 1
        blocks += [*x.ravel(), *y.ravel(), *z.ravel(), *[7.5] * 48]
    words = [6, 1, 2, 1, *breaks, 0.0, 2.0, *map(float, blocks), *[7.5] * 96]
    surface = read_surface(114, *words)
    u, v = np.array([0.0, 0.5, 1.7, 3.0]), np.array([0.0, 1.2, 0.3, 2.0])
    expected = np.stack([u, v, u * v**2 + u**3], axis=1)
    np.testing.assert_allclose(evaluate_surface(surface, u, v), expected, atol=1e-12)
    with pytest.raises(Fault):
        read_surface(114, 6, 1, 10**6, 10**6, *words[4:])


def test_rational_surfaces_have_u_fastest_and_are_cut_to_their_range() -> None:
    net = [[(float(i), float(j), float(i * j)) for j in range(2)] for i in range(3)]
    flat = [number for j in range(2) for i in range(3) for number in net[i][j]]
    knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    words = [2, 1, 2, 1, 0, 0, 1, 0, 0, *knots, *[1.0] * 6, *flat]
    surface = read_surface(128, *words, 0.0, 1.0, 0.0, 0.5)
    assert surface.points.shape == (3, 2, 4)
    assert [(k[0], k[-1]) for k in surface.knots] == [(0, 1), (0, 0.5)]
    np.testing.assert_allclose(evaluate_surface(surface, [0.5], [0.5]), [[1, 0.5, 0.5]])
    words[0] = 10**9
    with pytest.raises(Fault):
        read_surface(128, *words)


def test_offsets_of_elementary_surfaces() -> None:
    writer = Writer()
    origin, axis, reference = add_frame(writer, (0.0, 0.0, 1.0))
    plane = writer.add(108, 0.0, 0.0, 1.0, 4.0)
    below = writer.add(140, 0.0, 0.0, -1.0, 1.5, plane)
    np.testing.assert_allclose(sample(read_base(writer, below).cut(POINTS))[:, 2], 2.5)
    # The reference is y: in the middle of the parameters the outer normal is −y.
    cylinder = writer.add(192, origin, axis, 2.0, reference, form=1)
    for side, radius in ((-1.0, 2.5), (1.0, 1.5)):
        number = writer.add(140, 0.0, side, 0.0, 0.5, cylinder)
        points = sample(read_base(writer, number).cut(POINTS)) - [1, 2, 0]
        np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), radius)
    plain = writer.add(192, origin, axis, 2.0)
    spline = writer.add(122, add_line(writer, (0, 0), (1, 0)), 0.0, 0.0, 1.0)
    for base in (plain, spline):
        with pytest.raises(Unsupported):
            read_base(writer, writer.add(140, 0.0, 1.0, 0.0, 0.5, base))


def test_damaged_surfaces_are_faults() -> None:
    writer = Writer()
    line = add_line(writer, (0, 0), (1, 0))
    origin, axis, _ = add_frame(writer, (0.0, 0.0, 0.0))
    wrong = [
        writer.add(120, line, line, 1.0, 1.0),
        writer.add(122, line, 0.0, 0.0, 0.0),
        writer.add(192, origin, axis, 1.0),
        writer.add(192, line, axis, 1.0),
        writer.add(192, 999, axis, 1.0),
        writer.add(196, origin, -1.0),
        writer.add(110, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0),
    ]
    surfaces = build_readers(writer).surfaces
    for number in wrong:
        with pytest.raises((Fault, InvalidGeometry)):
            surfaces.read(number).cut(POINTS)
