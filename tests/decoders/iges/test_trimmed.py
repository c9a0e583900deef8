"""Trimmed faces: loops, their directions, and curves of parameters."""

import itertools
from math import pi, tau

import numpy as np
import pytest

from service.decoders.cad.faults import InvalidGeometry
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.polygons import measure_area
from service.decoders.iges.trimmed import TrimmedFace, TrimmedReader
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.iges.reading import build_readers, list_parts, read_all
from tests.decoders.iges.writing import Writer, add_line


def read_face(writer: Writer, number: int) -> TrimmedFace:
    return TrimmedReader(build_readers(writer)).read(number)


def add_square(writer: Writer) -> int:
    """The surface (3 u, 2 v, 0) over [0, 1]²."""
    return writer.add(
        128, 1, 1, 1, 1, 0, 0, 1, 0, 0, *[0.0, 0.0, 1.0, 1.0] * 2, *[1.0] * 4,
        *map(float, [0, 0, 0, 3, 0, 0, 0, 2, 0, 3, 2, 0]), 0.0, 1.0, 0.0, 1.0, status="00010000",
    )  # fmt: skip


OUTER = [(0.3, 0.2), (2.7, 0.2), (2.7, 1.8), (0.3, 1.8), (0.3, 0.2)]
INNER = [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.5)]


def shrink(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points of the square as parameters."""
    return [(x / 3, y / 2) for x, y in points]


def measure_face(face: TrimmedFace) -> float:
    """The area of the parameters of a face, by its polygons."""
    return sum(measure_area(polygon) for polygon in face.polygons)


@pytest.mark.parametrize("has_parameters", [False, True])
@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("is_swapped", [False, True])
def test_loops_get_the_material_on_their_left(
    has_parameters: bool, is_turned: bool, is_swapped: bool
) -> None:
    writer = Writer()
    surface = add_square(writer)
    loops = []
    for points in (OUTER, INNER):
        ring = points[::-1] if is_turned else points
        pcurve = add_line(writer, *shrink(ring)) if has_parameters else 0
        loops.append(writer.add(142, 0, surface, pcurve, add_line(writer, *ring), 3))
    first, second = loops[::-1] if is_swapped else loops
    face = read_face(writer, writer.add(144, surface, 1, 1, first, second))
    assert measure_face(face) == pytest.approx((2.4 * 1.6 - 0.25) / 6)
    assert sorted(map(len, face.loops)) == [3, 4]
    assert all((side.pcurve is not None) == has_parameters for loop in face.loops for side in loop)


@pytest.mark.parametrize(("preference", "is_kept"), [(0, True), (1, True), (2, False), (3, True)])
def test_the_preference_decides_whether_curves_of_parameters_are_used(
    preference: int, is_kept: bool
) -> None:
    writer = Writer()
    surface = add_square(writer)
    pcurve, curve = add_line(writer, *shrink(OUTER)), add_line(writer, *OUTER)
    loop = writer.add(142, 0, surface, pcurve, curve, preference)
    face = read_face(writer, writer.add(144, surface, 1, 0, loop))
    assert all((side.pcurve is not None) == is_kept for side in face.loops[0])
    assert all(side.curve is not None for side in face.loops[0])


def test_curves_of_parameters_elsewhere_are_left_out() -> None:
    writer = Writer()
    surface = add_square(writer)
    pcurve = add_line(writer, *shrink([(x, y + 0.15) for x, y in OUTER]))
    loop = writer.add(142, 0, surface, pcurve, add_line(writer, *OUTER), 1)
    face = read_face(writer, writer.add(144, surface, 1, 0, loop))
    assert all(side.pcurve is None for side in face.loops[0])
    assert measure_face(face) == pytest.approx(2.4 * 1.6 / 6)


def test_without_curves_in_space_sides_are_fitted() -> None:
    writer = Writer()
    axis = add_line(writer, (0, 0, 0), (0, 0, 1))
    surface = writer.add(122, writer.add(100, 0.0, 0.0, 0.0, 2.0, 0.0, -2.0, 0.0), 2.0, 0.0, 1.0)
    square = add_square(writer)
    circle = writer.add(100, 0.0, 0.5, 0.5, 0.7, 0.5, 0.7, 0.5)
    loop = writer.add(142, 0, square, circle, 0, 1)
    face = read_face(writer, writer.add(144, square, 0, 1, 0, loop))
    (side,) = face.loops[1]
    assert side.curve is not None
    assert side.deviation < 1e-6
    assert measure_face(face) == pytest.approx(1 - pi * 0.04, rel=0.03)
    # On an arc the file's parameters are angles; level lines can be converted.
    half = add_line(writer, (0.2, 0), (0.8, 0), (0.8, 1), (0.2, 1), (0.2, 0))
    level = writer.add(144, surface, 1, 0, writer.add(142, 0, surface, half, 0, 1))
    ends = [side.curve.points[0, :3] for side in read_face(writer, level).loops[0] if side.curve]
    angles = np.arctan2(*np.array(ends).T[[1, 0]])
    np.testing.assert_allclose(angles, pi * np.array([0.2, 0.8, 0.8, 0.2]))
    slope = add_line(writer, (0.2, 0), (0.8, 0.5), (0.2, 1), (0.2, 0))
    loop = writer.add(142, 0, surface, slope, 0, 1)
    with pytest.raises(Unsupported):
        read_face(writer, writer.add(144, surface, 1, 0, loop))
    assert axis


def test_a_face_may_end_at_the_border_of_its_surface() -> None:
    writer = Writer()
    surface = add_square(writer)
    loop = writer.add(142, 0, surface, 0, add_line(writer, *INNER), 2)
    face = read_face(writer, writer.add(144, surface, 0, 1, 0, loop))
    assert [len(sides) for sides in face.loops] == [4, 3]
    assert measure_face(face) == pytest.approx(1 - 0.25 / 6)


def test_bounded_surfaces_find_their_outer_loop() -> None:
    writer = Writer()
    surface = add_square(writer)
    lines = [
        [add_line(writer, a, b) for a, b in itertools.pairwise(ring)]
        for ring in (INNER, OUTER[::-1])
    ]
    # The second line of the triangle is written against the loop.
    lines[0][1] = add_line(writer, INNER[2], INNER[1])
    senses = [[1, 2, 1], [1, 1, 1, 1]]
    boundaries = [
        writer.add(
            141, 0, 2, surface, len(ring),
            *(word for line, sense in zip(ring, flags, strict=True) for word in (line, sense, 0)),
        )
        for ring, flags in zip(lines, senses, strict=True)
    ]  # fmt: skip
    face = read_face(writer, writer.add(143, 0, surface, 2, *boundaries))
    assert measure_face(face) == pytest.approx((2.4 * 1.6 - 0.25) / 6)
    whole = read_face(writer, writer.add(143, 0, surface, 0))
    assert measure_face(whole) == pytest.approx(1)


def test_boundaries_may_have_curves_of_parameters() -> None:
    writer = Writer()
    surface = add_square(writer)
    words: list[int] = []
    for (a, b), (p, q) in zip(
        itertools.pairwise(OUTER),
        zip(shrink(OUTER)[:-1], shrink(OUTER)[1:], strict=True),
        strict=True,
    ):
        words += [add_line(writer, a, b), 1, 1, add_line(writer, p, q)]
    boundary = writer.add(141, 1, 1, surface, 4, *words)
    face = read_face(writer, writer.add(143, 1, surface, 1, boundary))
    assert all(side.pcurve is not None for side in face.loops[0])


def test_a_bounded_plane_is_a_face() -> None:
    writer = Writer()
    turn = writer.add(124, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    circle = writer.add(100, 4.0, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, status="00010000")
    writer.add(108, 0.0, 0.0, 1.0, 4.0, circle, form=1, matrix=turn)
    (part,) = list_parts(read_all(writer))
    np.testing.assert_allclose(part.vertices, [[4, 2, 0]], atol=1e-12)
    (face,) = part.faces
    net = face.surface.points[..., :3] / face.surface.points[..., 3:]
    np.testing.assert_allclose(net[..., 0], 4)


def test_faces_have_matrices_of_their_own() -> None:
    writer = Writer()
    move = writer.add(124, 1.0, 0.0, 0.0, 7.0, 0.0, 1.0, 0.0, 8.0, 0.0, 0.0, 1.0, 9.0)
    surface = add_square(writer)
    loop = writer.add(142, 0, surface, 0, add_line(writer, *OUTER), 2)
    face = read_face(writer, writer.add(144, surface, 1, 0, loop, matrix=move))
    assert face.surface.points[0, 0].tolist() == [7, 8, 9, 1]
    curve = face.loops[0][0].curve
    assert curve is not None
    np.testing.assert_allclose(curve.points[0], [7.3, 8.2, 9, 1])


@pytest.mark.parametrize("turns", [1, -1])
def test_rings_around_a_cylinder_need_no_seam(turns: int) -> None:
    # A cylinder of the radius 2 from z = 1 to 3, between circles without parameter curves.
    writer = Writer()
    axis = add_line(writer, (0, 0, 0), (0, 0, 1))
    surface = writer.add(120, axis, writer.add(110, 2.0, 0.0, 0.0, 2.0, 0.0, 5.0), 0.0, tau)
    mirror = writer.add(124, 1.0, *[0.0] * 4, float(turns), 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    loops = [
        writer.add(
            142, 0, surface, 0, writer.add(100, z, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, matrix=mirror), 2
        )
        for z in (1.0, 3.0)
    ]
    number = writer.add(144, surface, 1, 1, *loops)
    face = read_face(writer, number)
    # The area of the parameters: u from 0.2 to 0.6, and a full turn.
    assert measure_face(face) == pytest.approx(0.4 * tau)
    volumes = [measure_part(part)[0] for part in list_parts(read_all(writer))]
    # Without its lids it has two thirds of the volume, by the sum over its triangles.
    assert [abs(volume) for volume in volumes] == [pytest.approx(2 / 3 * 8 * pi, rel=0.01)]


def test_a_ring_on_a_sphere_ends_at_a_pole() -> None:
    writer = Writer()
    axis = add_line(writer, (0, 0, 0), (0, 0, 1))
    turn = writer.add(124, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    arc = writer.add(100, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, matrix=turn)
    surface = writer.add(120, axis, arc, 0.0, tau)
    circle = writer.add(100, 1.0, 0.0, 0.0, 3**0.5, 0.0, 3**0.5, 0.0)
    loop = writer.add(142, 0, surface, 0, circle, 2)
    face = read_face(writer, writer.add(144, surface, 1, 0, loop))
    # From the latitude of 30 degrees to the pole.
    assert measure_face(face) == pytest.approx(pi / 3 * tau, rel=0.02)


def test_damaged_faces_are_faults() -> None:
    writer = Writer()
    surface = add_square(writer)
    line = add_line(writer, *OUTER)
    loop = writer.add(142, 0, surface, 0, line, 2)
    plane = writer.add(108, 0.0, 0.0, 1.0, 0.0)
    wrong = [
        writer.add(144, 999, 1, 0, loop),
        writer.add(144, surface, 1, 0, 999),
        writer.add(144, surface, 1, 0, line),
        writer.add(144, surface, 1, 10**9, loop),
        writer.add(144, surface, 1, 0, writer.add(142, 0, surface, 0, 0, 0)),
        writer.add(144, plane, 0, 0, 0),
        writer.add(144, plane, 0, 1, 0, loop),
        writer.add(143, 0, surface, 1, line),
        line,
    ]
    reader = TrimmedReader(build_readers(writer))
    for number in wrong:
        with pytest.raises((Fault, InvalidGeometry)):
            reader.read(number)
