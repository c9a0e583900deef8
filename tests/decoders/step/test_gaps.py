"""Distances from edges to elementary surfaces."""

from math import pi

import numpy as np
import pytest

from service.decoders.cad.elementary import Cone, Cylinder, Elementary, Plane, Sphere, Torus
from service.decoders.cad.frames import build_frame
from service.decoders.cad.outline import NO_OUTLINE, Outline
from service.decoders.step.gaps import find_gap
from tests.decoders.step.written import Writer

FRAME = build_frame((1.0, 2.0, 3.0), (0.0, 1.0, 1.0), (1.0, 0.0, 0.0))

SHAPES: list[tuple[Elementary, tuple[float, float, float], float]] = [
    (Plane(FRAME), (5.0, 7.0, -0.25), 0.25),
    (Cylinder(FRAME, 2.0), (0.0, 2.5, 9.0), 0.5),
    (Cylinder(FRAME, 2.0), (1.0, 0.0, 9.0), 1.0),
    (Sphere(FRAME, 2.0), (0.0, 0.0, 2.5), 0.5),
    (Cone(FRAME, 1.0, pi / 4), (3.0, 0.0, 2.0), 0.0),
    (Cone(FRAME, 1.0, pi / 4), (3.0, 0.0, 3.0), np.sqrt(0.5)),
    (Cone(FRAME, 1.0, pi / 4), (2.0, 0.0, -3.0), 0.0),
    (Torus(FRAME, 5.0, 2.0), (0.0, 7.5, 0.0), 0.5),
    (Torus(FRAME, 1.0, 2.0, is_outer=False), (0.5, 0.0, 0.0), 0.5),
]


@pytest.mark.parametrize(("shape", "local", "expected"), SHAPES)
def test_distances_from_ends(
    shape: Elementary, local: tuple[float, float, float], expected: float
) -> None:
    points = np.array([shape.frame.place(*local)])
    assert find_gap(shape, Outline(points, points)) == pytest.approx(expected, abs=1e-14)


def test_without_edges_there_is_no_gap() -> None:
    assert find_gap(Sphere(FRAME, 1.0), NO_OUTLINE) == 0


def test_gaps_are_in_the_report_in_the_root_s_unit() -> None:
    writer = Writer()
    loop, _ = writer.polygon((0, 0, 0), (1, 0, 0), (1, 1, 0.125), (0, 1, 0))
    face = writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(loop))
    metres = writer.context(writer.unit("$"))
    near = writer.vertex(0, 0, 0.5), writer.vertex(1, 0, 0)
    line = writer.edge(*near, writer.line((0, 0, 0), (1, 0, 0)))
    back = writer.edge(near[1], near[0], writer.line((1, 0, 0), (-1, 0, 0.5)))
    third = writer.face(
        writer(f"PLANE('',{writer.frame()})"), writer.bound(writer.loop(line, back))
    )
    writer.product("first", writer.representation([writer.square()]))
    writer.product("second", writer.representation([face, third], metres))
    reading = writer.read().reading
    assert reading.edge_gap == pytest.approx(500)
    assert reading.vertex_gap == pytest.approx(500)
