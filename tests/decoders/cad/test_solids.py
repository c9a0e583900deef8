"""Solids of elementary surfaces: their meshes are closed, and their volumes have the right sign."""

from math import acos, atan, pi, sin, sqrt

import pytest

from service.decoders.cad.conics import Ellipse
from service.decoders.cad.content import Coedge, Part
from service.decoders.cad.elementary import Cone, Cylinder, Elementary, Plane, Sphere, Torus
from service.decoders.cad.frames import Vector, build_frame, scale
from service.decoders.cad.outline import NO_OUTLINE
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.pieces import cut_between
from tests.decoders.cad.part_meshes import measure_part, prepare_part

FRAME = build_frame((1.0, 2.0, 3.0), (0.3, -0.2, 0.9), (1.0, 0.2, 0.0))
RADIUS, HEIGHT = 2.0, 5.0


def build_whole(surface: Elementary, is_reversed: bool = False) -> Part:
    """A solid of one surface without loops."""
    builder = PartBuilder()
    face = builder.add_face(surface.cut(NO_OUTLINE), [], is_reversed=is_reversed)
    builder.add_shell([face], True)
    part = builder.build()
    assert part is not None
    return part


def build_turned(top_radius: float, kind: str) -> Part:
    """A cylinder, a frustum or a cone of a height, in one of three forms.

    Its side has a seam edge, no seam edge, or is split into two halves.
    """
    builder = PartBuilder()
    top = FRAME.move(FRAME.place(0.0, 0.0, HEIGHT))
    circles = [Ellipse(FRAME, RADIUS, RADIUS)]
    if top_radius:
        circles.append(Ellipse(top, top_radius, top_radius))
    angles = (0.0, pi) if kind == "halves" else (0.0,)
    # Vertices and edges of each circle, from angle to angle.
    rings, edges = [], []
    for circle in circles:
        points = [circle.evaluate(angle) for angle in angles]
        ring = [builder.add_vertex((circle, k), point) for k, point in enumerate(points)]
        rings.append(ring)
        own = []
        for k, first in enumerate(ring):
            last = ring[(k + 1) % len(ring)]
            piece = cut_between(
                circle,
                builder.find_point(first),
                builder.find_point(last),
                is_loop=first == last,
            )
            own.append(builder.add_edge((circle, k), (first, last), piece.curve, gap=piece.gap))
        edges.append(own)
    bottom = [[Coedge(edge, is_reversed=True) for edge in reversed(edges[0])]]
    outline = builder.find_outline(bottom)
    faces = [builder.add_face(Plane(FRAME).cut(outline), bottom, is_reversed=True)]
    if top_radius:
        lid = [[Coedge(edge) for edge in edges[1]]]
        faces.append(builder.add_face(Plane(top).cut(builder.find_outline(lid)), lid))
    else:
        rings.append([builder.add_vertex("apex", top.origin)])
    side: Elementary = Cylinder(FRAME, RADIUS)
    if top_radius != RADIUS:
        side = Cone(FRAME, RADIUS, atan((top_radius - RADIUS) / HEIGHT))
    sides = []
    if kind == "no seam":
        sides.append(
            [[Coedge(edges[0][0])], *([[Coedge(edges[1][0], True)]] if top_radius else [])]
        )
    else:
        lines = [
            builder.add_edge(("line", k), (low, rings[1][k % len(rings[1])]))
            for k, low in enumerate(rings[0])
        ]
        for k, edge in enumerate(edges[0]):
            loop = [Coedge(edge), Coedge(lines[(k + 1) % len(lines)])]
            if top_radius:
                loop.append(Coedge(edges[1][k], True))
            sides.append([[*loop, Coedge(lines[k], True)]])
    for loops in sides:
        surface = side.cut(builder.find_outline(loops))
        assert surface.points.shape[0] == (7 if kind == "halves" else 9)
        faces.append(builder.add_face(surface, loops))
    builder.add_shell(faces, True)
    assert builder.vertex_gap < 1e-14
    part = builder.build()
    assert part is not None
    return part


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["seam", "no seam", "halves"])
@pytest.mark.parametrize("top_radius", [RADIUS, 1.0, 3.0, 0.0, 1e-5])
def test_cylinders_and_cones_are_closed(top_radius: float, kind: str) -> None:
    part = build_turned(top_radius, kind)
    expected = pi * HEIGHT / 3 * (RADIUS**2 + RADIUS * top_radius + top_radius**2)
    volume, cracks = measure_part(part)
    assert not cracks
    assert 0.99 * expected < volume < expected


def measure_spindle(major: float, minor: float, is_outer: bool) -> float:
    """The volume inside the outer or the inner part of a torus that crosses itself (Pappus)."""
    angle = acos(-major / minor) if is_outer else acos(major / minor)
    # The segment of a circle that is beyond the chord on the axis.
    area = minor**2 * (angle - sin(angle) * (major / minor) * (-1 if is_outer else 1))
    centre = (2 * minor**3 * sin(angle) ** 3 / 3) / area
    return 2 * pi * area * (centre + (major if is_outer else -major))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "is_reversed", "expected"),
    [
        (Sphere(FRAME, 2.0), False, 4 / 3 * pi * 8),
        (Torus(FRAME, 3.0, 1.0), False, 2 * pi**2 * 3),
        (Torus(FRAME, 2.0, 2.0), False, 2 * pi**2 * 8),
        (Torus(FRAME, 1.0, 2.0, True), False, measure_spindle(1.0, 2.0, True)),
        # The normal du × dv of the inner part points to the axis.
        (Torus(FRAME, 1.0, 2.0, False), True, measure_spindle(1.0, 2.0, False)),
        (Torus(FRAME, 0.0, 2.0), False, 4 / 3 * pi * 8),
    ],
)
def test_spheres_and_tori_without_loops_are_closed(
    surface: Elementary, is_reversed: bool, expected: float
) -> None:
    volume, cracks = measure_part(build_whole(surface, is_reversed))
    assert not cracks
    assert 0.98 * expected < volume < expected


def test_the_parts_of_a_spindle_add_up() -> None:
    """Over the whole circle Pappus's theorem counts the inner part as negative."""
    both = measure_spindle(1.0, 2.0, True) - measure_spindle(1.0, 2.0, False)
    assert both == pytest.approx(2 * pi**2 * 4)
    assert measure_spindle(sqrt(1e-20), 2.0, True) == pytest.approx(4 / 3 * pi * 8)


def test_a_face_on_a_torus_that_touches_its_axis_has_edges_on_its_surface() -> None:
    """Both ends of v are the point on the axis; v was taken for closed there."""
    size, frame = 0.5, build_frame((-1.54, -12.14, 14.76), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    circles = [
        Ellipse(frame.move(frame.place(0, 0, size)), size, size),
        Ellipse(build_frame(frame.place(0, -size, 0), scale(frame.x, -1.0), frame.z), size, size),
        Ellipse(frame, 2 * size, 2 * size),
        Ellipse(build_frame(frame.place(size, 0, 0), scale(frame.y, -1.0), frame.z), size, size),
    ]
    places = ((1, 0, 1), (0, -1, 1), (0, -2, 0), (2, 0, 0))
    builder = PartBuilder()
    corners = [
        builder.add_vertex(place, frame.place(*(size * x for x in place))) for place in places
    ]
    loop = []
    for k, circle in enumerate(circles):
        pair = corners[k], corners[(k + 1) % 4]
        ends = [builder.find_point(vertex) for vertex in pair]
        # All arcs are quarters: the shorter way around.
        pieces = [cut_between(circle, *ends, same_sense=sense).curve for sense in (True, False)]
        curves = [piece for piece in pieces if piece is not None and len(piece.points) == 3]
        assert len(curves) == 1
        loop.append(Coedge(builder.add_edge(k, pair, curves[0])))
    surface = Torus(frame, size, size).cut(builder.find_outline([loop]))
    builder.add_face(surface, [loop])
    part = builder.build()
    assert part is not None
    assert builder.vertex_gap < 1e-12
    prepared = prepare_part(part)
    assert len(prepared.gaps) == 4  # the face is not left out
    assert prepared.gaps.max() < 1e-9


def build_cut_ball(direction: Vector, height: float, is_upper: bool) -> Part:
    """A ball of radius 2 that a plane cuts: the part above or below a height along a direction."""
    builder = PartBuilder()
    cut = build_frame((0.0, 0.0, 0.0), direction)
    plane = cut.move(cut.place(0.0, 0.0, height))
    ring = Ellipse(plane, sqrt(4.0 - height * height), sqrt(4.0 - height * height))
    vertex = builder.add_vertex(0, ring.evaluate(0.3))
    point = builder.find_point(vertex)
    piece = cut_between(ring, point, point, is_loop=True)
    edge = builder.add_edge(0, (vertex, vertex), piece.curve)
    loop = [[Coedge(edge, is_reversed=not is_upper)]]
    lid = [[Coedge(edge, is_reversed=is_upper)]]
    ball = Sphere(build_frame((0.0, 0.0, 0.0)), 2.0).cut(builder.find_outline(loop))
    disc = Plane(plane).cut(builder.find_outline(lid))
    faces = [builder.add_face(ball, loop), builder.add_face(disc, lid, is_reversed=is_upper)]
    builder.add_shell(faces, True)
    part = builder.build()
    assert part is not None
    return part


@pytest.mark.slow
@pytest.mark.parametrize("is_upper", [True, False])
@pytest.mark.parametrize(
    ("direction", "height"),
    [
        ((0.0, 0.0, 1.0), 1.5),
        ((1.0, 0.0, 0.0), 1.5),
        ((-1.0, 0.0, 0.0), 1.5),
        ((1.0, 1.0, 1.0), 0.0),
        ((0.0, 0.3, 1.0), 0.0),
    ],
)
def test_both_parts_of_a_cut_ball_are_closed(
    direction: Vector, height: float, is_upper: bool
) -> None:
    """The loop is about a pole, across the seam, away from both, or has a pole inside."""
    cap = pi * (2.0 - height) ** 2 * (4.0 + height) / 3
    expected = cap if is_upper else 4 / 3 * pi * 8 - cap
    volume, cracks = measure_part(build_cut_ball(direction, height, is_upper))
    assert not cracks
    assert volume == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("is_upper", [True, False])
def test_both_parts_of_a_torus_between_its_rings_are_closed(is_upper: bool) -> None:
    """A plane across the axis: the torus has two loops around its axis, and the lid is a ring."""
    major, minor, height = 3.0, 1.0, 0.4
    frame = build_frame((1.0, 0.0, 0.0), (0.2, 0.1, 1.0))
    plane = frame.move(frame.place(0.0, 0.0, height))
    half = sqrt(minor**2 - height**2)
    builder = PartBuilder()
    edges = []
    for key, radius in enumerate((major + half, major - half)):
        ring = Ellipse(plane, radius, radius)
        vertex = builder.add_vertex(key, ring.evaluate(1.0))
        edges.append(builder.add_edge(key, (vertex, vertex), ring.cut(1.0, 1.0 + 2 * pi)))
    # Counter-clockwise about the axis, the material of the upper part is on the left outside.
    sides = [[Coedge(edges[0], not is_upper)], [Coedge(edges[1], is_upper)]]
    lid = [[Coedge(edges[0], is_upper)], [Coedge(edges[1], not is_upper)]]
    torus = Torus(frame, major, minor).cut(builder.find_outline(sides))
    disc = Plane(plane).cut(builder.find_outline(lid))
    faces = [builder.add_face(torus, sides), builder.add_face(disc, lid, is_reversed=is_upper)]
    builder.add_shell(faces, True)
    part = builder.build()
    assert part is not None
    volume, cracks = measure_part(part)
    assert not cracks
    angle = acos(height / minor)
    segment = minor**2 * (angle - sin(angle) * height / minor)
    area = segment if is_upper else pi * minor**2 - segment
    assert volume == pytest.approx(2 * pi * major * area, rel=0.02)
