"""The builder of parts: shared edges, directions, gaps, outlines, and parts without some faces."""

from math import nan, pi

import numpy as np
import pytest

from service.decoders.cad.conics import Ellipse
from service.decoders.cad.content import Coedge, Curve, Part
from service.decoders.cad.elementary import Plane
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Frame, Vector, build_frame
from service.decoders.cad.outline import NO_OUTLINE, Outline, enclose_points
from service.decoders.cad.parts import PartBuilder, reverse_loop
from service.decoders.cad.scaling import scale_matrix, scale_part
from service.decoders.cad.splines import build_curve
from tests.decoders.cad.part_meshes import measure_part

PCURVE = Curve(1, np.array([0.0, 0, 1, 1]), np.array([[0.0, 0, 1], [1, 0, 1]]))

CORNERS: list[Vector] = [
    (float(i), float(2 * j), float(3 * k)) for k in range(2) for j in range(2) for i in range(2)
]
RINGS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def build_box(turns_with_face: bool) -> PartBuilder:
    """A box whose planes have normals that point inwards on every second face.

    `turns_with_face` tells against which normal the loops are given.
    """
    builder = PartBuilder("box", 1e-5, (1.0, 0.0, 0.0))
    faces = []
    for number, ring in enumerate(RINGS):
        a, b, d = (CORNERS[ring[k]] for k in (0, 1, 3))
        outwards = np.cross(np.subtract(b, a), np.subtract(d, a))
        is_reversed = number % 2 == 1
        x, y, z = (outwards * (-1 if is_reversed else 1)).tolist()
        loop = []
        for first, last in zip(ring, (*ring[1:], ring[0]), strict=True):
            key = min(first, last), max(first, last)
            edge = builder.find_edge(key)
            if edge is None:
                ends = [builder.add_vertex(corner, CORNERS[corner]) for corner in key]
                edge = builder.add_edge(key, (ends[0], ends[1]))
            loop.append(Coedge(edge, is_reversed=first > last))
        loops = [tuple(loop)]
        if is_reversed and not turns_with_face:
            loops = [reverse_loop(loop)]
        surface = Plane(build_frame(a, (x, y, z))).cut(builder.find_outline(loops))
        faces.append(
            builder.add_face(
                surface, loops, is_reversed=is_reversed, turns_with_face=turns_with_face
            )
        )
    builder.add_shell(faces, True)
    return builder


def finish(builder: PartBuilder) -> Part:
    part = builder.build()
    assert part is not None
    return part


@pytest.mark.parametrize("turns_with_face", [True, False])
def test_loops_of_reversed_faces_are_seen_against_the_normal_of_the_surface(
    turns_with_face: bool,
) -> None:
    part = finish(build_box(turns_with_face))
    assert (len(part.vertices), len(part.edges), len(part.faces)) == (8, 12, 6)
    volume, cracks = measure_part(part)
    assert volume == pytest.approx(6.0)
    assert not cracks
    assert (part.name, part.uncertainty, part.color) == ("box", 1e-5, (1.0, 0.0, 0.0))


def test_scaled_parts_have_scaled_meshes() -> None:
    builder = build_box(True)
    ball = Ellipse(build_frame((0.5, 1.0, 1.5)), 0.25, 0.25).cut_whole()
    vertex = builder.add_vertex("v", (0.75, 1.0, 1.5))
    edge = builder.add_edge("e", (vertex, vertex), ball, uncertainty=1e-4)
    loop = [Coedge(edge, pcurve=PCURVE)]
    disc = Plane(build_frame((0.5, 1.0, 1.5))).cut(builder.find_outline([loop]))
    face = builder.add_face(disc, [loop], name="disc", color=(0.0, 1.0, 0.0))
    builder.add_shell([face], False)
    part = finish(builder)
    scaled = scale_part(part, 25.4)
    assert scaled.vertices == pytest.approx(part.vertices * 25.4)
    assert scaled.uncertainty == pytest.approx(25.4e-5)
    assert scaled.edges[-1].uncertainty == pytest.approx(25.4e-4)
    assert scaled.faces[-1].loops == part.faces[-1].loops
    assert (scaled.faces[-1].name, scaled.faces[-1].color) == ("disc", (0.0, 1.0, 0.0))
    assert measure_part(scaled)[0] == pytest.approx(measure_part(part)[0] * 25.4**3)
    own, new = part.edges[-1].curve, scaled.edges[-1].curve
    assert own is not None
    assert new is not None
    assert (new.points[:, 3] == own.points[:, 3]).all()
    assert new.points[:, :3] == pytest.approx(own.points[:, :3] * 25.4)
    assert scale_part(part, 1.0) is part
    matrix = np.arange(16.0).reshape(4, 4)
    expected = matrix.copy()
    expected[:3, 3] *= 2
    assert (scale_matrix(matrix, 2.0) == expected).all()
    assert matrix[0, 3] == 3


def test_a_key_makes_one_vertex() -> None:
    builder = PartBuilder()
    assert builder.add_vertex(5, (1.0, 0.0, 0.0)) == 0
    assert builder.add_vertex(7, (0.0, 1.0, 0.0)) == 1
    assert builder.add_vertex(5, (2.0, 0.0, 0.0)) == 0
    assert builder.find_point(0) == (1.0, 0.0, 0.0)
    assert builder.find_edge(9) is None
    edge = builder.add_edge(9, (0, 0), Ellipse(build_frame((0, 0, 0)), 1.0, 1.0).cut_whole())
    assert builder.find_edge(9) == edge == 0


def test_gaps_are_the_largest_distances() -> None:
    builder = PartBuilder()
    first, last = builder.add_vertex(0, (1.0, 0.0, 0.0)), builder.add_vertex(1, (-1.0, 1e-3, 0.0))
    arc = Ellipse(build_frame((0.0, 0.0, 0.0)), 1.0, 1.0).cut(0.0, pi)
    builder.add_edge("arc", (first, last), arc)
    assert builder.vertex_gap == pytest.approx(1e-3)
    builder.add_edge("line", (first, last), gap=1e-4)
    assert builder.vertex_gap == pytest.approx(1e-3)
    builder.add_edge("other", (first, last), arc, gap=2e-3)
    assert builder.vertex_gap == 2e-3
    builder.note_gap(3e-3)
    builder.note_gap(1e-3)
    assert builder.edge_gap == 3e-3


@pytest.mark.parametrize("value", [nan, float("inf"), 1e13])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_wrong_vertices_are_refused(value: float, axis: int) -> None:
    point = [0.0, 1.0, 2.0]
    point[axis] = value
    with pytest.raises(InvalidGeometry, match="finite"):
        PartBuilder().add_vertex(0, (point[0], point[1], point[2]))


def test_lines_of_no_length_and_open_loops_are_refused() -> None:
    builder = build_box(True)
    with pytest.raises(InvalidGeometry, match="no length"):
        builder.add_edge("short", (0, 0))
    surface = finish(builder).faces[0].surface
    for loop in ([Coedge(0), Coedge(2)], [Coedge(0, True), Coedge(1)], [Coedge(0)]):
        with pytest.raises(InvalidGeometry, match="follow"):
            builder.add_face(surface, [loop])
    assert builder.face_count == 6


def test_edges_and_vertices_of_no_face_are_left_out() -> None:
    builder = PartBuilder()
    vertices = [builder.add_vertex(k, (float(k), float(k * k), 0.0)) for k in range(5)]
    edges = [builder.add_edge(k, (vertices[k], vertices[(k + 1) % 5])) for k in range(5)]
    shortcut = builder.add_edge("shortcut", (vertices[4], vertices[2]))
    loop = [Coedge(edges[2]), Coedge(edges[3]), Coedge(shortcut, pcurve=PCURVE)]
    plane = Plane(build_frame((0.0, 0.0, 0.0))).cut(builder.find_outline([loop]))
    builder.add_face(plane, [loop], name="triangle", color=(1.0, 1.0, 0.0))
    part = finish(builder)
    assert part.vertices[:, 0].tolist() == [2, 3, 4]
    assert [edge.vertices for edge in part.edges] == [(0, 1), (1, 2), (2, 0)]
    face = part.faces[0]
    assert [coedge.edge for coedge in face.loops[0]] == [0, 1, 2]
    assert face.loops[0][2].pcurve is PCURVE
    assert (face.name, face.color) == ("triangle", (1.0, 1.0, 0.0))
    # The face is in no shell: it becomes an open one.
    assert [(shell.faces, shell.is_closed) for shell in part.shells] == [((0,), False)]


def test_faces_without_loops_and_parts_without_faces() -> None:
    builder = PartBuilder()
    builder.add_shell([], True)
    assert builder.build() is None
    pole = builder.add_pole("pole", builder.add_vertex(0, (0.0, 0.0, 1.0)))
    surface = Plane(build_frame((0.0, 0.0, 0.0))).trim((0.0, 1.0), (0.0, 1.0))
    builder.add_face(surface, [[], []])
    part = finish(builder)
    assert part.faces[0].loops == ()
    assert not part.edges
    builder.add_face(surface, [[Coedge(pole)]])
    assert finish(builder).edges[0].is_degenerate


def count_turns(outline: Outline, frame: Frame) -> int:
    local = outline.locate(frame)
    return local.count_turns(local.find_angles())


def test_outlines_have_edges_in_the_direction_of_their_loops() -> None:
    builder = PartBuilder()
    frame = build_frame((0.0, 0.0, 0.0))
    ring = Ellipse(frame, 1.0, 1.0).cut_whole()
    vertex = builder.add_vertex(0, (1.0, 0.0, 0.0))
    apex = builder.add_vertex(1, (0.0, 0.0, 5.0))
    edge = builder.add_edge("ring", (vertex, vertex), ring)
    forward = builder.find_outline([[Coedge(edge)]], [apex])
    assert count_turns(forward, frame) == 1
    assert forward.hull[-1].tolist() == forward.ends[-1].tolist() == [0, 0, 5]
    assert forward.middles is not None
    assert np.linalg.norm(forward.middles, axis=1) == pytest.approx([1.0])
    backward = builder.find_outline([[Coedge(edge, is_reversed=True)]])
    assert count_turns(backward, frame) == -1
    both = builder.find_outline([[Coedge(edge)], [Coedge(edge, is_reversed=True)]])
    assert count_turns(both, frame) == 0
    beside = build_frame((5.0, 0.0, 0.0))
    assert count_turns(forward, beside) == 0
    assert builder.find_outline([]) is NO_OUTLINE
    assert Outline.of([]) is NO_OUTLINE
    assert not NO_OUTLINE


def test_long_edges_are_enclosed_in_few_points() -> None:
    t = np.linspace(0.0, 6.0, 100_001)
    net = np.stack([np.cos(t), np.sin(t), t], axis=1)
    few = enclose_points(net)
    assert len(few) < 1100
    assert (few[[0, -1]] == net[[0, -1]]).all()
    directions = np.random.default_rng(3).normal(size=(50, 3))
    reach = (few @ directions.T).max(axis=0), (net @ directions.T).max(axis=0)
    assert (reach[0] >= reach[1]).all()
    assert (reach[0] <= reach[1] + 0.1 * np.linalg.norm(directions, axis=1)).all()
    builder = PartBuilder()
    ends = []
    for key, (x, y, z) in enumerate(net[[0, -1]].tolist()):
        ends.append(builder.add_vertex(key, (x, y, z)))
    edge = builder.add_edge("spiral", (ends[0], ends[1]), build_curve(1, [0.0, *t, 6.0], net))
    outline = builder.find_outline([[Coedge(edge)]])
    assert len(outline.hull) == len(few)
    assert (outline.ends == net[[0, -1]]).all()


def test_two_vertices_at_one_point_are_one() -> None:
    """Loops of some files end at one of them and go on from the other."""
    builder = PartBuilder()
    numbers = [builder.add_vertex(key, (1.0, 2.0, 3.0)) for key in ("a", "b", "a")]
    assert numbers == [0, 0, 0]
    assert builder.add_vertex("c", (1.0, 2.0, 4.0)) == 1
