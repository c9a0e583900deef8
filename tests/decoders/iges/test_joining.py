"""Faces with sides of their own become shells."""

import itertools

import numpy as np
import pytest

from service.decoders.cad.content import Curve, Edge, Part
from service.decoders.cad.splines import build_curve, reverse
from service.decoders.iges.distances import are_opposite, bound_distance
from service.decoders.iges.points import find_clusters
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.iges.reading import assert_closed, list_parts, list_reasons, read_all
from tests.decoders.iges.writing import Writer, add_box, add_line, add_quad


def list_uses(part: Part) -> list[tuple[Edge, list[bool]]]:
    """Each edge, and whether each of its coedges runs against it, seen from outside."""
    uses: list[list[bool]] = [[] for _ in part.edges]
    for face in part.faces:
        for loop in face.loops:
            for coedge in loop:
                uses[coedge.edge].append(coedge.is_reversed != face.is_reversed)
    return list(zip(part.edges, uses, strict=True))


def test_a_box_of_six_faces_is_closed() -> None:
    writer = Writer()
    add_box(writer, (2, 3, 4))
    content = read_all(writer)
    (part,) = list_parts(content)
    assert len(part.edges) == 12
    assert len(part.vertices) == 8
    assert all(sorted(flags) == [False, True] for _, flags in list_uses(part))
    assert all(edge.curve is None for edge in part.edges)
    assert [shell.is_closed for shell in part.shells] == [True]
    reading = content.reading
    assert (reading.closed_shells, reading.open_shells, reading.faces) == (1, 0, 6)
    assert reading.open_edges == 0
    assert_closed(part, 24)


def test_an_open_box_has_four_borders() -> None:
    writer = Writer()
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    add_quad(writer, corners)
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        add_quad(writer, [a, b, (*b[:2], 1), (*a[:2], 1)])
    content = read_all(writer)
    (part,) = list_parts(content)
    assert [shell.is_closed for shell in part.shells] == [False]
    assert content.reading.open_edges == 4
    assert sorted(len(flags) for _, flags in list_uses(part)) == [1] * 4 + [2] * 8
    assert all(sorted(flags) == [False, True] for _, flags in list_uses(part) if len(flags) == 2)


def test_faces_apart_are_parts_apart() -> None:
    writer = Writer()
    add_box(writer, (1, 1, 1))
    add_quad(writer, [(5, 0, 0), (6, 0, 0), (6, 1, 0), (5, 1, 0)])
    assert [len(part.faces) for part in list_parts(read_all(writer))] == [6, 1]


@pytest.mark.parametrize(("gap", "count"), [(1e-4, 1), (0.01, 2)])
def test_sides_are_joined_within_the_resolution(gap: float, count: int) -> None:
    writer = Writer(resolution="2.D-4")
    add_quad(writer, [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)])
    add_quad(writer, [(10, 0, gap), (20, 0, 0), (20, 10, 0), (10, 10, gap)])
    content = read_all(writer)
    parts = list_parts(content)
    assert len(parts) == count
    if count == 1:
        assert content.reading.edge_gap == pytest.approx(gap)
        assert content.reading.vertex_gap <= gap
        assert parts[0].uncertainty == 2e-4


@pytest.mark.parametrize(("gap", "count"), [(0.0, 3), (4e-4, 2)])
def test_sides_alone_are_joined_up_to_the_gaps_in_loops(gap: float, count: int) -> None:
    # The resolution is finer than the gap between two sides, and in one loop.
    writer = Writer(resolution="1.D-9")
    add_quad(writer, [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)])
    add_quad(writer, [(10, 0, 5e-4), (20, 0, 0), (20, 10, 0), (10, 10, 5e-4)])
    plane = writer.add(108, 0.0, 0.0, 1.0, 9.0)
    corners = [(0, 0, 9), (1, 0, 9), (1, 1, 9), (0, gap, 9)]
    writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, add_line(writer, *corners), 2))
    content = read_all(writer)
    assert len(list_parts(content)) == count
    if gap:
        assert content.reading.edge_gap == pytest.approx(5e-4)
        uncertainties = [edge.uncertainty for edge in list_parts(content)[0].edges]
        assert [each for each in uncertainties if each is not None] == [pytest.approx(5e-4)]


def test_the_sides_of_a_narrow_face_are_no_seam() -> None:
    writer = Writer(resolution="1.D-5")
    columns = [0.0, 1.0, 1.000001, 2.0]
    for left, right in itertools.pairwise(columns):
        add_quad(writer, [(left, 0, 0), (right, 0, 0), (right, 1, 0), (left, 1, 0)])
    (part,) = list_parts(read_all(writer))
    assert [len(face.loops[0]) for face in part.faces] == [4, 2, 4]
    narrow = part.faces[1].loops[0]
    assert narrow[0].edge != narrow[1].edge


def test_the_tolerance_fits_the_size_of_the_faces() -> None:
    for resolution, expected in (("1.D-12", 1e-6), ("1000.", 1e-4), ("", 1e-6)):
        writer = Writer(resolution=resolution)
        add_quad(writer, [(0, 0, 0), (30, 0, 0), (30, 40, 0), (0, 40, 0)])
        (part,) = list_parts(read_all(writer))
        assert part.uncertainty == pytest.approx(50 * expected)


def test_borders_that_agree_in_part_stay_open() -> None:
    writer = Writer()
    add_quad(writer, [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)])
    for x in (0, 1):
        add_quad(writer, [(x, 1, 0), (x + 1, 1, 0), (x + 1, 2, 0), (x, 2, 0)])
    content = read_all(writer)
    assert [len(part.faces) for part in list_parts(content)] == [1, 2]
    assert content.reading.open_edges == 4 + 6


def test_a_third_face_at_an_edge_gets_an_edge_of_its_own() -> None:
    writer = Writer()
    for x, z in ((-1, 0), (1, 0), (0, 1)):
        add_quad(writer, [(0, 0, 0), (x, 0, z), (x, 1, z), (0, 1, 0)])
    parts = list_parts(read_all(writer))
    assert [len(part.faces) for part in parts] == [2, 1]


def test_sides_with_other_parameters_are_one_edge() -> None:
    # A quarter of a cylinder, and a fan: one has the arc, the other a spline of degree 4.
    writer = Writer()
    arc = writer.add(100, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    half = 0.5**0.5
    net = np.array([[1, 0, 1], [half, half, half], [0, 1, 1]])
    weights = [1.0, half / 2 + 0.5, (2 * half**2 * 2 + 2) / 6, half / 2 + 0.5, 1.0]
    square = np.array([1.0, half, 1.0])  # the arc, raised by the factor of a quadratic weight
    raised = np.zeros((5, 3))
    for i, row in enumerate(net):
        for j, factor in enumerate(square):
            share = [1, 2, 1][i] * [1, 2, 1][j] / [1, 4, 6, 4, 1][i + j]
            raised[i + j] += share * factor * row
    assert len(weights) == 5
    points = np.c_[raised[:, :2] / raised[:, 2:], np.zeros(5)]
    other = writer.add(
        126, 4, 4, 1, 0, 0, 0, *[0.0] * 5, *[1.0] * 5, *map(float, raised[:, 2]),
        *map(float, points.ravel()), 0.0, 1.0,
    )  # fmt: skip
    cylinder = writer.add(122, arc, 1.0, 0.0, 1.0)
    top = writer.add(
        102, 4, add_line(writer, (0, 1, 0), (0, 1, 1)),
        writer.add(100, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
        add_line(writer, (1, 0, 1), (1, 0, 0)), arc,
    )  # fmt: skip
    fan = writer.add(
        102, 3, other, add_line(writer, (0, 1), (0, 0)), add_line(writer, (0, 0), (1, 0))
    )
    plane = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    writer.add(144, cylinder, 1, 0, writer.add(142, 0, cylinder, 0, top, 2))
    writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, fan, 2))
    content = read_all(writer)
    assert not list_reasons(content)
    (part,) = list_parts(content)
    assert len(part.edges) == 6
    assert content.reading.edge_gap < 1e-12


def test_open_loops_are_faults_of_their_faces() -> None:
    writer = Writer()
    good = add_quad(writer, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    plane = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    curve = add_line(writer, (0, 0), (1, 0), (1, 1))
    bad = writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, curve, 2))
    content = read_all(writer)
    assert [len(part.faces) for part in list_parts(content)] == [1]
    assert list_reasons(content) == {f"D{bad}": "a loop is open"}
    assert good < bad


def test_short_sides_between_joined_corners_are_left_out() -> None:
    writer = Writer(resolution="1.D-3")
    plane = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    curve = add_line(writer, (0, 0), (10, 0), (10, 5e-4), (10, 10), (0, 10), (0, 0))
    writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, curve, 2))
    (part,) = list_parts(read_all(writer))
    assert len(part.edges) == 4
    assert len(part.faces[0].loops[0]) == 4


def circle(start: float, *, is_clockwise: bool = False) -> Curve:
    half = 0.5**0.5
    angles = start + np.pi / 4 * np.arange(9)
    weights = np.where(np.arange(9) % 2, half, 1.0)
    points = np.stack([np.cos(angles) / weights, np.sin(angles) / weights, 0 * angles], axis=1)
    knots = [0.0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    curve = build_curve(2, knots, points, weights)
    return reverse(curve) if is_clockwise else curve


def test_closed_curves_have_a_direction() -> None:
    first = circle(0.3)
    assert not are_opposite(first, circle(0.3))
    assert are_opposite(first, circle(0.3, is_clockwise=True))


def test_distances_of_curves() -> None:
    first = circle(0.0)
    assert bound_distance(first, circle(0.0), False, 1e-6) < 1e-15
    assert bound_distance(first, circle(0.0, is_clockwise=True), True, 1e-6) < 1e-15
    # With another start the control points differ.
    for start in (0.5, 1.0, 4.0):
        assert bound_distance(first, circle(start), False, 1e-6) < 1e-12
    wider = Curve(first.degree, first.knots, first.points * [1.001, 1.001, 1, 1])
    assert 1e-3 <= bound_distance(first, wider, False, 1e-2) < 1.5e-3
    assert bound_distance(first, wider, False, 1e-4) == np.inf
    line = build_curve(1, [0.0, 0, 1, 1], [[1, 0, 0], [1, 2, 0]])
    assert bound_distance(first, line, False, 1e-3) == np.inf


@pytest.mark.parametrize("is_clockwise", [False, True])
def test_circles_that_begin_at_different_points_are_one_edge(is_clockwise: bool) -> None:
    # A cylinder with a seam at the angle 0, between lids whose circles begin at other angles.
    writer = Writer()
    back = writer.add(124, 1.0, *[0.0] * 4, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    circles = [
        writer.add(100, z, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, matrix=matrix)
        for z, matrix in ((0.0, 0), (2.0, back))
    ]
    axis = add_line(writer, (0, 0, 0), (0, 0, 1))
    surface = writer.add(120, axis, writer.add(110, 1.0, 0.0, 0.0, 1.0, 0.0, 2.0), 0.0, 2 * np.pi)
    seam = [add_line(writer, (1, 0, a), (1, 0, b)) for a, b in ((0, 2), (2, 0))]
    loop = writer.add(102, 4, circles[0], seam[0], circles[1], seam[1])
    turn = (0, 2 * np.pi)
    inside = add_line(writer, (0, 0), (0, turn[1]), (1, turn[1]), (1, 0), (0, 0))
    writer.add(144, surface, 1, 0, writer.add(142, 0, surface, inside, loop, 3))
    sign = -1.0 if is_clockwise else 1.0
    mirror = writer.add(124, 1.0, *[0.0] * 4, sign, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    for z, angle in ((0.0, 1.0), (2.0, 4.0)):
        point = float(np.cos(angle)), float(np.sin(angle))
        lid = writer.add(100, z, 0.0, 0.0, *point, *point, matrix=mirror)
        plane = writer.add(108, 0.0, 0.0, 1.0, z)
        writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, lid, 2))
    content = read_all(writer)
    (part,) = list_parts(content)
    assert len(part.edges) == 3
    assert content.reading.open_edges == 0
    assert part.shells[0].is_closed
    volume, cracks = measure_part(part)
    assert not cracks
    assert volume == pytest.approx(2 * np.pi, rel=0.01)


def test_rings_about_one_center_are_different_edges() -> None:
    writer = Writer()
    plane = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    for radius in (1.0, 1.001):
        ring = writer.add(100, 0.0, 0.0, 0.0, radius, 0.0, radius, 0.0)
        writer.add(144, plane, 1, 0, writer.add(142, 0, plane, 0, ring, 2))
    assert len(list_parts(read_all(writer))) == 2


def test_near_points_have_one_representative() -> None:
    generator = np.random.default_rng(1)
    centers = generator.uniform(-5, 5, (40, 3))
    centers[:8] = np.round(centers[:8])  # on the borders of cells
    points = np.repeat(centers, 5, axis=0) + generator.uniform(-1, 1, (200, 3)) * 1e-3
    found = find_clusters(points, 4e-3)
    assert found.tolist() == np.repeat(np.arange(0, 200, 5), 5).tolist()
    assert find_clusters(points, 1e-9).tolist() == list(range(200))
