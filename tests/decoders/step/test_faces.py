"""Faces, loops and edges of STEP files: which side is out, and in which direction loops run."""

from itertools import product
from math import pi

import numpy as np
import pytest

from service.decoders.cad.content import Face, Part
from service.decoders.cad.splines import evaluate_surface, find_ends
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.step.written import Writer, read_face, read_part

FLAGS = {True: ".T.", False: ".F."}


def normal_of(face: Face) -> np.ndarray:
    """The normal at the middle of a face's surface."""
    middles = [[(knots[0] + knots[-1]) / 2] for knots in face.surface.knots]
    shifted = [
        [middle[0] + 1e-5 * (knots[-1] - knots[0])]
        for middle, knots in zip(middles, face.surface.knots, strict=True)
    ]
    start = evaluate_surface(face.surface, *middles)[0]
    du = evaluate_surface(face.surface, shifted[0], middles[1])[0] - start
    dv = evaluate_surface(face.surface, middles[0], shifted[1])[0] - start
    normal = np.cross(du, dv)
    unit: np.ndarray = (-1 if face.is_reversed else 1) * normal / np.linalg.norm(normal)
    return unit


def area_vector(part: Part) -> np.ndarray:
    """Twice the vector area of the first loop of a face of straight edges."""
    total = np.zeros(3)
    for coedge in part.faces[0].loops[0]:
        start, end = part.vertices[list(part.edges[coedge.edge].vertices)]
        total += (-1 if coedge.is_reversed else 1) * np.cross(start, end)
    return total


@pytest.mark.parametrize(
    ("face_sense", "edge_sense", "oriented", "shell"), list(product((True, False), repeat=4))
)
def test_all_four_flags(face_sense: bool, edge_sense: bool, oriented: bool, shell: bool) -> None:
    """A square whose loop, whatever the flags, is counter-clockwise about its normal."""
    writer = Writer()
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    vertices = [writer.vertex(*corner) for corner in corners]
    names = []
    for first in range(4):
        last = (first + 1) % 4
        ends = [first, last] if oriented else [last, first]
        start, end = (corners[k] for k in ends)
        sign = 1 if edge_sense else -1
        x, y = sign * (end[0] - start[0]), sign * (end[1] - start[1])
        line = writer.line(start, (x, y, 0))
        edge = writer.edge(vertices[ends[0]], vertices[ends[1]], line, FLAGS[edge_sense])
        names.append(edge if oriented else f"-{edge}")
    # Counter-clockwise about z: the same as the face's normal, or else the bound turns it around.
    bound = writer.bound(writer.loop(*names), FLAGS[face_sense])
    plane = writer(f"PLANE('',{writer.frame()})")
    face = writer.face(plane, bound, same_sense=FLAGS[face_sense])
    open_shell = writer.shell(face)
    oriented_shell = writer(f"ORIENTED_OPEN_SHELL('',*,{open_shell},{FLAGS[shell]})")
    model = writer(f"SHELL_BASED_SURFACE_MODEL('',({oriented_shell}))")
    part = read_part(writer, model)
    (found,) = part.faces
    out = 1 if face_sense == shell else -1
    np.testing.assert_allclose(normal_of(found), [0, 0, out], atol=1e-9)
    # Against du × dv, which is z, material is on the left.
    np.testing.assert_allclose(area_vector(part), [0, 0, 2])


@pytest.mark.parametrize("depth", [1, 2])
def test_oriented_faces_are_turned(depth: int) -> None:
    writer = Writer()
    face = writer.square(name="top")
    for _ in range(depth):
        face = writer(f"ORIENTED_FACE('',*,{face},.F.)")
    found = read_face(writer, face)
    np.testing.assert_allclose(normal_of(found), [0, 0, (-1) ** depth], atol=1e-9)
    assert found.name == "top"


def test_edges_of_lines_have_no_curve() -> None:
    writer = Writer()
    part = read_part(writer, writer.square())
    assert [edge.curve for edge in part.edges] == [None] * 4
    assert part.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(("same_sense", "middle"), [(True, 1.0), (False, -1.0)])
def test_arcs_run_as_their_edge_says(same_sense: bool, middle: float) -> None:
    writer = Writer()
    ends = writer.vertex(1, 0, 0), writer.vertex(-1, 0, 0)
    arc = writer.edge(*ends, writer.circle(1), FLAGS[same_sense])
    line = writer.edge(ends[1], ends[0], writer.line((-1, 0, 0), (1, 0, 0)))
    plane = writer(f"PLANE('',{writer.frame()})")
    bound = writer.bound(writer.loop(arc, line), FLAGS[same_sense])
    part = read_part(writer, writer.face(plane, bound, same_sense=FLAGS[same_sense]))
    curve = part.edges[0].curve
    assert curve is not None
    np.testing.assert_allclose(find_ends(curve), [[1, 0, 0], [-1, 0, 0]], atol=1e-15)
    heights = curve.points[:, 1] / curve.points[:, 3]
    assert heights[len(heights) // 2] == pytest.approx(middle)


def test_closed_edges_have_one_vertex() -> None:
    writer = Writer()
    vertex = writer.vertex(0, 2, 0)
    edge = writer.edge(vertex, vertex, writer.circle(2))
    plane = writer(f"PLANE('',{writer.frame()})")
    part = read_part(writer, writer.face(plane, writer.bound(writer.loop(edge))))
    (found,) = part.edges
    assert found.vertices == (0, 0)
    assert found.curve is not None
    np.testing.assert_allclose(find_ends(found.curve), [[0, 2, 0]] * 2, atol=1e-12)


def test_subedges_lie_on_the_curve_of_their_parent() -> None:
    writer = Writer()
    a, b, c = writer.vertex(1, 0, 0), writer.vertex(0, 1, 0), writer.vertex(-1, 0, 0)
    parent = writer.edge(a, c, writer.circle(1))
    first = writer(f"SUBEDGE('',{a},{b},{parent})")
    second = writer(f"SUBEDGE('',{b},{c},{parent})")
    line = writer.edge(c, a, writer.line((-1, 0, 0), (1, 0, 0)))
    plane = writer(f"PLANE('',{writer.frame()})")
    part = read_part(writer, writer.face(plane, writer.bound(writer.loop(first, second, line))))
    curves = [edge.curve for edge in part.edges if edge.curve is not None]
    assert [np.round(find_ends(curve), 12).tolist() for curve in curves] == [
        [[1, 0, 0], [0, 1, 0]],
        [[0, 1, 0], [-1, 0, 0]],
    ]


def test_edges_that_are_one_point_are_poles() -> None:
    writer = Writer()
    top, side = writer.vertex(0, 0, 1), writer.vertex(1, 0, 0)
    pole_points = ",".join([writer.point(0, 0, 1)] * 2)
    pole_curve = writer(
        f"B_SPLINE_CURVE_WITH_KNOTS('',1,({pole_points}),.UNSPECIFIED.,.F.,.F.,(2,2),(0.,1.),.U.)"
    )
    pole = writer.edge(top, top, pole_curve)
    meridian = writer.edge(side, top, writer.circle(1, z=(0, -1, 0)))
    equator = writer.edge(side, side, writer.circle(1))
    sphere = writer(f"SPHERICAL_SURFACE('',{writer.frame()},1.)")
    loop = writer.loop(equator, meridian, pole, f"-{meridian}")
    part = read_part(writer, writer.face(sphere, writer.bound(loop)))
    assert [edge.is_degenerate for edge in part.edges] == [False, False, True]


def test_vertex_loops_bound_nothing_but_stretch_cones() -> None:
    writer = Writer()
    base = writer.vertex(1, 0, 0)
    circle = writer.edge(base, base, writer.circle(1))
    apex = writer(f"VERTEX_LOOP('',{writer.vertex(0, 0, 2)})")
    cone = writer(f"CONICAL_SURFACE('',{writer.frame(z=(0, 0, -1))},1.,{np.arctan(0.5)})")
    plane = writer(f"PLANE('',{writer.frame()})")
    side = writer.face(cone, writer.bound(writer.loop(circle)), writer.bound(apex))
    bottom = writer.face(plane, writer.bound(writer.loop(f"-{circle}"), ".T."), same_sense=".F.")
    solid = writer(f"MANIFOLD_SOLID_BREP('cone',{writer.shell(side, bottom, closed=True)})")
    part = read_part(writer, solid)
    assert [len(face.loops) for face in part.faces] == [1, 1]
    found, cracks = measure_part(part)
    assert not cracks
    assert found == pytest.approx(2 * pi / 3, rel=5e-3)


def test_a_whole_sphere() -> None:
    writer = Writer()
    sphere = writer(f"SPHERICAL_SURFACE('',{writer.frame()},2.)")
    point = writer(f"VERTEX_LOOP('',{writer.vertex(0, 0, 2)})")
    for bounds in ((), (writer.bound(point),)):
        face = writer.face(sphere, *bounds)
        solid = writer(f"MANIFOLD_SOLID_BREP('ball',{writer.shell(face, closed=True)})")
        again = Writer()
        again.lines = list(writer.lines)
        part = read_part(again, solid)
        assert part.faces[0].loops == ()
        found, cracks = measure_part(part)
        assert not cracks
        assert found == pytest.approx(32 * pi / 3, rel=5e-3)


def test_polygons_without_a_surface_have_a_plane() -> None:
    writer = Writer()
    part = read_part(writer, writer.tetrahedron())
    assert (len(part.vertices), len(part.edges), len(part.faces)) == (4, 6, 4)
    for face, expected in zip(
        part.faces, ((0, 0, -1), (0, -1, 0), (1, 1, 1), (-1, 0, 0)), strict=True
    ):
        np.testing.assert_allclose(
            normal_of(face), np.array(expected) / np.linalg.norm(expected), atol=1e-9
        )
    found, cracks = measure_part(part)
    assert not cracks
    assert found == pytest.approx(1 / 6)


def test_points_of_polygons_with_equal_coordinates_are_one_vertex() -> None:
    writer = Writer()
    loops = []
    for corners in (
        ((0, 0, 0), (1, 0, 0), (1, 1, 0)),
        ((0, 0, 0), (1, 1, 0), (1, 1, 0), (0, 1, 0)),
    ):
        points = ",".join(writer.point(*corner) for corner in corners)
        loops.append(writer.bound(writer(f"POLY_LOOP('',({points}))")))
    faces = [writer(f"FACE('',({bound}))") for bound in loops]
    part = read_part(writer, writer.shell(*faces))
    assert len(part.vertices) == 4
    assert len(part.edges) == 5
    assert [len(face.loops[0]) for face in part.faces] == [3, 3]


def test_subfaces_have_the_surface_of_their_parent() -> None:
    writer = Writer()
    parent = writer.square(same_sense=".F.")
    loop, _ = writer.polygon((0, 0, 0), (0, 1, 0), (1, 0, 0))
    face = writer(f"SUBFACE('',({writer.bound(loop)}),{parent})")
    found = read_face(writer, face)
    np.testing.assert_allclose(normal_of(found), [0, 0, -1], atol=1e-9)


def test_complex_records_of_topology() -> None:
    writer = Writer()
    loop, _ = writer.polygon((0, 0, 0), (1, 0, 0), (0, 1, 0))
    plane = writer(f"PLANE('',{writer.frame()})")
    bound = writer(
        f"(FACE_BOUND({loop},.T.)FACE_OUTER_BOUND()REPRESENTATION_ITEM('')"
        "TOPOLOGICAL_REPRESENTATION_ITEM())"
    )
    face = writer(
        f"(ADVANCED_FACE()FACE(({bound}))FACE_SURFACE({plane},.T.)GEOMETRIC_REPRESENTATION_ITEM()"
        "REPRESENTATION_ITEM('one')TOPOLOGICAL_REPRESENTATION_ITEM())"
    )
    assert read_face(writer, face).name == "one"


@pytest.mark.parametrize(
    ("broken", "reason"),
    [
        ("EDGE_LOOP('',(#1))", "is a PLANE, which is not read"),
        ("EDGE_LOOP('',(#99))", "no entity #99"),
        ("EDGE_LOOP('',$)", "not a list"),
        ("POLY_LOOP('',(#2,#3))", "are one point"),
        ("PATH('',())", "a loop is a PATH, which is not read"),
    ],
)
def test_faces_that_cannot_be_read_are_reported(broken: str, reason: str) -> None:
    writer = Writer()
    writer("PLANE('',#4)")
    writer("CARTESIAN_POINT('',(0.,0.,0.))")
    writer("CARTESIAN_POINT('',(0.,0.,0.))")
    writer("AXIS2_PLACEMENT_3D('',#2,$,$)")
    face = writer.face("#1", writer.bound(writer(broken)))
    content = writer.read(writer.shell(writer.square(), face))
    (skipped,) = content.reading.skipped_faces
    assert skipped.entity == face
    assert reason in skipped.reason
    assert content.reading.faces == 1


def test_a_broken_edge_is_named_in_each_of_its_faces() -> None:
    writer = Writer()
    loop, edges = writer.polygon((0, 0, 0), (1, 0, 0), (0, 1, 0))
    plane = writer(f"PLANE('',{writer.frame()})")
    faces = [writer.face(plane, writer.bound(loop)) for _ in range(2)]
    writer.lines[int(edges[1][1:]) - 1] = f"{edges[1]}=EDGE_CURVE('',#1,#2,{plane},.T.);"
    content = writer.read(writer.shell(*faces, writer.square()))
    assert [each.entity for each in content.reading.skipped_faces] == faces
    assert {f"edge {edges[1]}: " in each.reason for each in content.reading.skipped_faces} == {True}


def test_open_loops_are_reported() -> None:
    writer = Writer()
    _, edges = writer.polygon((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    face = writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(writer.loop(*edges[:3])))
    (skipped,) = writer.read(writer.shell(face, writer.square())).reading.skipped_faces
    assert skipped.entity == face
    assert "do not follow" in skipped.reason


@pytest.mark.parametrize("keyword", ["ORIENTED_FACE('',*,#1,.T.)", "SUBFACE('',(),#1)"])
def test_faces_that_refer_to_themselves_end(keyword: str) -> None:
    writer = Writer()
    face = writer(keyword)
    content = writer.read(writer.shell(face, writer.square()))
    assert [each.entity for each in content.reading.skipped_faces] == [face]


def write_square_with_swapped_vertices(writer: Writer, *swapped: int) -> str:
    """The loop of a square; some of its edges have their vertices the wrong way around."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    vertices = [writer.vertex(*corner) for corner in corners]
    edges = []
    for first, start in enumerate(corners):
        last = (first + 1) % 4
        end = corners[last]
        ends = (last, first) if first in swapped else (first, last)
        if first % 2:
            curve = writer.line(start, (end[0] - start[0], end[1] - start[1], 0))
        else:
            middle = writer.point((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, 0)
            points = f"({writer.point(*start)},{middle},{writer.point(*end)})"
            curve = writer(f"BEZIER_CURVE('',2,{points},.UNSPECIFIED.,.F.,.F.)")
        edges.append(writer.edge(vertices[ends[0]], vertices[ends[1]], curve))
    return writer.loop(*edges)


@pytest.mark.parametrize("swapped", [(0,), (1,), (3,)])
def test_edges_whose_vertices_are_swapped_are_turned_around(swapped: tuple[int, ...]) -> None:
    writer = Writer()
    loop = write_square_with_swapped_vertices(writer, *swapped)
    part = read_part(writer, writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(loop)))
    assert area_vector(part) == pytest.approx([0, 0, 2])
    assert [coedge.is_reversed for coedge in part.faces[0].loops[0]] == [
        number in swapped for number in range(4)
    ]


def test_half_of_the_edges_say_as_well_that_the_loop_runs_the_other_way() -> None:
    writer = Writer()
    loop = write_square_with_swapped_vertices(writer, 0, 2)
    face = writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(loop))
    (skipped,) = writer.read(writer.shell(face, writer.square())).reading.skipped_faces
    assert "do not follow" in skipped.reason


def test_arcs_are_not_turned_around() -> None:
    """The other arc would be the rest of the circle."""
    writer = Writer()
    a, b, c = (writer.vertex(*p) for p in ((1, 0, 0), (0, 1, 0), (0, 0, 0)))
    edges = [
        writer.edge(b, a, writer.circle(1)),
        writer.edge(b, c, writer.line((0, 1, 0), (0, -1, 0))),
        writer.edge(c, a, writer.line((0, 0, 0), (1, 0, 0))),
    ]
    face = writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(writer.loop(*edges)))
    (skipped,) = writer.read(writer.shell(face, writer.square())).reading.skipped_faces
    assert "do not follow" in skipped.reason
