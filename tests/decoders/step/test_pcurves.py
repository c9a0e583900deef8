"""Parameter curves of STEP files: which are used, in which direction, and which of a seam's two."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from service.decoders.cad.content import Coedge, Edge, Face, Part
from service.decoders.cad.splines import evaluate, evaluate_surface, find_domain
from service.decoders.format import FileLimits
from service.decoders.step.read import read
from tests.decoders.step.written import Writer, read_part

BOWL = ((0, 0, 0), (0, 1, 0)), ((1, 0, 0), (1, 1, 1))


def write_surface(writer: Writer) -> str:
    """A bilinear surface that is not flat: x = u, y = v, z = u v, for u and v from 0 to 2."""
    rows = ",".join(
        f"({','.join(writer.point(2 * x, 2 * y, 4 * z) for x, y, z in row)})" for row in BOWL
    )
    return writer(
        f"B_SPLINE_SURFACE_WITH_KNOTS('',1,1,({rows}),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),"
        "(0.,2.),(0.,2.),.UNSPECIFIED.)"
    )


def write_pcurve(writer: Writer, surface: str, curve: str, kind: str = "PCURVE") -> str:
    context = writer("(GEOMETRIC_REPRESENTATION_CONTEXT(2)REPRESENTATION_CONTEXT('',''))")
    definition = writer(f"DEFINITIONAL_REPRESENTATION('',({curve}),{context})")
    return writer(f"{kind}('',{surface},{definition})")


def write_polyline(writer: Writer, *points: tuple[float, ...]) -> str:
    return writer(f"POLYLINE('',({','.join(writer.point(*point) for point in points)}))")


def pcurves_of(part: Part) -> Iterator[tuple[Face, Edge, Coedge]]:
    for face in part.faces:
        for loop in face.loops:
            for coedge in loop:
                if coedge.pcurve is not None:
                    yield face, part.edges[coedge.edge], coedge


def check_gaps(part: Part) -> int:
    """The number of pcurves; each is on its edge, at the parameters of the edge."""
    count = 0
    for face, edge, coedge in pcurves_of(part):
        assert coedge.pcurve is not None
        shares = np.linspace(0, 1, 9)
        low, high = find_domain(coedge.pcurve)
        u, v = evaluate(coedge.pcurve, low + shares * (high - low)).T
        points = evaluate_surface(face.surface, u, v)
        if edge.curve is None:
            start, end = part.vertices[list(edge.vertices)]
            expected = start + shares[:, np.newaxis] * (end - start)
        else:
            low, high = find_domain(edge.curve)
            expected = evaluate(edge.curve, low + shares * (high - low))
        np.testing.assert_allclose(points, expected, atol=1e-9 * np.abs(part.vertices).max())
        count += 1
    return count


@pytest.mark.parametrize(
    ("name", "count"),
    [("loft_ap242.step", 4), ("hollow_ap203.step", 0), ("elementary_mm_ap214.step", 0)],
)
def test_pcurves_of_open_cascade(name: str, count: int) -> None:
    content = read((Path("tests/cad_files") / name).read_bytes(), FileLimits())
    parts = [part for definition in content.definitions for part in definition.parts]
    assert sum(map(check_gaps, parts)) == count


def write_triangle(
    writer: Writer,
    *,
    is_forward: bool = True,
    kind: str = "SURFACE_CURVE",
    pcurve: str = "",
    domain: str = "-1.,3.",
) -> str:
    """A face with one edge on a curve of the surface from (0, 0) to (2, 2), and two lines."""
    surface = write_surface(writer)
    # The parabola (t, t, t²) for t from −1 to 3, of which the edge is the piece from 0 to 2.
    points = ((-1, -1, 1), (1, 1, -3), (3, 3, 9))
    net = ",".join(writer.point(*point) for point in points)
    curve = writer(
        f"B_SPLINE_CURVE_WITH_KNOTS('',2,({net}),.UNSPECIFIED.,.F.,.F.,(3,3),(-1.,3.),.U.)"
    )
    spline = writer(
        f"B_SPLINE_CURVE_WITH_KNOTS('',1,({writer.point(-1, -1)},{writer.point(3, 3)}),"
        f".UNSPECIFIED.,.F.,.F.,(2,2),({domain}),.U.)"
    )
    used = pcurve or write_pcurve(writer, surface, spline)
    on_surface = writer(f"{kind}('',{curve},({used}),.CURVE_3D.)")
    a, b, c = writer.vertex(0, 0, 0), writer.vertex(2, 2, 4), writer.vertex(0, 2, 0)
    diagonal = writer.edge(a, b, on_surface) if is_forward else writer.edge(b, a, on_surface, ".F.")
    top = writer.edge(b, c, write_polyline(writer, (2, 2, 4), (0, 2, 0)))
    left = writer.edge(c, a, writer.line((0, 2, 0), (0, -1, 0)))
    loop = writer.loop(diagonal if is_forward else f"-{diagonal}", top, left)
    return writer.face(surface, writer.bound(loop))


@pytest.mark.parametrize("is_forward", [True, False])
@pytest.mark.parametrize("kind", ["SURFACE_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE"])
def test_pcurves_are_cut_to_their_edges_and_run_along_them(is_forward: bool, kind: str) -> None:
    writer = Writer()
    part = read_part(writer, write_triangle(writer, is_forward=is_forward, kind=kind))
    assert check_gaps(part) == 1
    ((_, _, coedge),) = pcurves_of(part)
    assert coedge.is_reversed != is_forward


def test_lines_in_parameters() -> None:
    writer = Writer()
    surface = write_surface(writer)
    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 4), (0, 2, 0)]
    places = [(0, 0), (2, 0), (2, 2), (0, 2)]
    vertices = [writer.vertex(*corner) for corner in corners]
    edges = []
    for first in range(4):
        last = (first + 1) % 4
        step = [b - a for a, b in zip(corners[first], corners[last], strict=True)]
        line = writer.line(corners[first], (step[0], step[1], step[2]), magnitude=3.0)
        length = float(np.linalg.norm(step))
        du, dv = (places[last][k] - places[first][k] for k in (0, 1))
        vector = writer(
            f"VECTOR('',{writer.direction(du, dv)},{3.0 * float(np.hypot(du, dv)) / length})"
        )
        flat = writer(f"LINE('',{writer.point(*places[first])},{vector})")
        curve = writer(
            f"SURFACE_CURVE('',{line},({write_pcurve(writer, surface, flat)}),.CURVE_3D.)"
        )
        edges.append(writer.edge(vertices[first], vertices[last], curve))
    part = read_part(writer, writer.face(surface, writer.bound(writer.loop(*edges))))
    assert check_gaps(part) == 4


def test_pcurves_on_other_surfaces_and_of_other_kinds_are_left_out() -> None:
    for record in ("PLANE('',#1)", "PCURVE('',#1,#2)", "PCURVE('',$,$)", "CIRCLE('',#1,1.)"):
        writer = Writer()
        other = writer(record)
        face = write_triangle(writer, pcurve=other)
        assert not list(pcurves_of(read_part(writer, face)))


@pytest.mark.parametrize("domain", ["0.5,3.", "-1.,1.", "-1.,-1.", "5.,7."])
def test_pcurves_that_do_not_reach_the_ends_of_their_edges_are_left_out(domain: str) -> None:
    writer = Writer()
    part = read_part(writer, write_triangle(writer, domain=domain))
    assert not list(pcurves_of(part))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("is_turned", [False, True])
def test_each_side_of_a_seam_has_its_own_pcurve(swapped: bool, is_turned: bool) -> None:
    """A prism over a triangle, closed in u (or, turned, in v), with one seam edge."""
    writer = Writer()
    corners = [(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)]
    ring = [*corners, corners[0]]
    net = [[(x, y, z) for z in (0.0, 1.0)] for x, y in ring]
    if is_turned:
        net = [[row[k] for row in net] for k in (1, 0)]  # upside down, so that the normal stays
    rows = ",".join(f"({','.join(writer.point(*point) for point in row)})" for row in net)
    around, up = "(2,1,1,2),(0.,4.,9.,12.)", "(2,2),(0.,1.)"
    first, second = (up, around) if is_turned else (around, up)
    multiplicities = f"{first.split(',(')[0]},{second.split(',(')[0]}"
    values = f"({first.split(',(')[1]},({second.split(',(')[1]}"
    surface = writer(
        f"B_SPLINE_SURFACE_WITH_KNOTS('',1,1,({rows}),.UNSPECIFIED.,.F.,.F.,.F.,{multiplicities},"
        f"{values},.UNSPECIFIED.)"
    )

    def place(u: float, v: float) -> tuple[float, float]:
        return (1.0 - v, u) if is_turned else (u, v)

    low, high = writer.vertex(0, 0, 0), writer.vertex(0, 0, 1)
    sides = [
        write_pcurve(writer, surface, write_polyline(writer, place(u, 0.0), place(u, 1.0)))
        for u in (0.0, 12.0)
    ]
    line = write_polyline(writer, (0, 0, 0), (0, 0, 1))
    pair = ",".join(reversed(sides) if swapped else sides)
    seam = writer.edge(low, high, writer(f"SEAM_CURVE('',{line},({pair}),.CURVE_3D.)"))
    bottom, top = (
        writer.edge(vertex, vertex, write_polyline(writer, *((x, y, z) for x, y in ring)))
        for vertex, z in ((low, 0.0), (high, 1.0))
    )
    face = writer.face(surface, writer.bound(writer.loop(bottom, seam, f"-{top}", f"-{seam}")))
    part = read_part(writer, face)
    assert check_gaps(part) == 2
    axis = 1 if is_turned else 0
    ends = {
        coedge.is_reversed: float(coedge.pcurve.points[0, axis])
        for _, _, coedge in pcurves_of(part)
        if coedge.pcurve is not None
    }
    assert ends == {False: 12.0, True: 0.0}
