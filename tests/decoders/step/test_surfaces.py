"""Surfaces of STEP files, and how faces with trimmed or oriented ones are turned."""

from math import pi

import numpy as np
import pytest

from service.decoders.cad.content import Surface
from service.decoders.cad.elementary import Cone, Cylinder, Plane, Sphere, Torus
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.outline import NO_OUTLINE
from service.decoders.cad.splines import evaluate_surface
from service.decoders.cad.swept import Extrusion, Revolution
from service.decoders.step.curves import CurveReader
from service.decoders.step.surfaces import Oriented, SurfaceReader
from tests.decoders.step.written import Writer, find_entities


def read(writer: Writer, surface: str, radians: float = 1.0) -> Oriented:
    entities = find_entities(writer.data)
    reader = SurfaceReader(entities, radians, CurveReader(entities, radians))
    return reader.read(int(surface[1:]))


def test_elementary_surfaces() -> None:
    writer = Writer()
    frame = writer.frame((1, 2, 3))
    shapes = {
        keyword: read(writer, writer(f"{keyword}('',{frame}{more})"), pi / 180).shape
        for keyword, more in (
            ("PLANE", ""),
            ("CYLINDRICAL_SURFACE", ",2."),
            ("CONICAL_SURFACE", ",2.,45."),
            ("SPHERICAL_SURFACE", ",2."),
            ("TOROIDAL_SURFACE", ",3.,2."),
            ("DEGENERATE_TOROIDAL_SURFACE", ",2.,3.,.F."),
        )
    }
    plane = shapes["PLANE"]
    assert isinstance(plane, Plane)
    where = plane.frame
    assert where.origin == (1.0, 2.0, 3.0)
    assert shapes["CYLINDRICAL_SURFACE"] == Cylinder(where, 2)
    assert shapes["CONICAL_SURFACE"] == Cone(where, 2, pi / 4)
    assert shapes["SPHERICAL_SURFACE"] == Sphere(where, 2)
    assert shapes["TOROIDAL_SURFACE"] == Torus(where, 3, 2)
    assert shapes["DEGENERATE_TOROIDAL_SURFACE"] == Torus(where, 2, 3, is_outer=False)


def test_a_cone_without_an_angle_is_a_cylinder() -> None:
    writer = Writer()
    cone = writer(f"CONICAL_SURFACE('',{writer.frame()},2.,0.)")
    assert isinstance(read(writer, cone).shape, Cylinder)


def test_complex_records_of_elementary_surfaces() -> None:
    writer = Writer()
    frame = writer.frame()
    cylinder = writer(
        f"(CYLINDRICAL_SURFACE(2.)ELEMENTARY_SURFACE({frame})GEOMETRIC_REPRESENTATION_ITEM()"
        "REPRESENTATION_ITEM('')SURFACE())"
    )
    found = read(writer, cylinder).shape
    assert isinstance(found, Cylinder)
    assert found.radius == 2


def test_swept_surfaces() -> None:
    writer = Writer()
    line = writer.line((1, 0, 0), (0, 0, 1))
    extrusion = writer(
        f"SURFACE_OF_LINEAR_EXTRUSION('',{line},{writer.vector(0, 1, 0, magnitude=3)})"
    )
    axis = writer(f"AXIS1_PLACEMENT('',{writer.point(0, 0, 0)},{writer.direction(0, 0, 1)})")
    revolution = writer(f"SURFACE_OF_REVOLUTION('',{line},{axis})")
    found = read(writer, extrusion).shape
    assert isinstance(found, Extrusion)
    assert found.vector == (0.0, 3.0, 0.0)
    turned = read(writer, revolution).shape
    assert isinstance(turned, Revolution)
    assert (turned.origin, turned.axis) == ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def net(writer: Writer, n: int, m: int) -> str:
    rows = ("(" + ",".join(writer.point(k, j, k * j) for j in range(m)) + ")" for k in range(n))
    return f"({','.join(rows)})"


def test_splines_with_knots() -> None:
    writer = Writer()
    surface = writer(
        f"B_SPLINE_SURFACE_WITH_KNOTS('',1,2,{net(writer, 2, 4)},.UNSPECIFIED.,.F.,.F.,.F.,"
        "(2,2),(3,1,3),(0.,1.),(0.,.5,2.),.UNSPECIFIED.)"
    )
    found = read(writer, surface).cut(NO_OUTLINE)
    assert found.degrees == (1, 2)
    assert [knots.tolist() for knots in found.knots] == [[0, 0, 1, 1], [0, 0, 0, 0.5, 2, 2, 2]]
    assert found.points[1, 3].tolist() == [1, 3, 3, 1]


def test_rational_splines() -> None:
    writer = Writer()
    surface = writer(
        f"(BOUNDED_SURFACE()B_SPLINE_SURFACE(1,1,{net(writer, 2, 2)},.UNSPECIFIED.,.F.,.F.,.F.)"
        "B_SPLINE_SURFACE_WITH_KNOTS((2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)"
        "RATIONAL_B_SPLINE_SURFACE(((1.,2.),(1.,1.)))REPRESENTATION_ITEM('')SURFACE())"
    )
    found = read(writer, surface).cut(NO_OUTLINE)
    weights = found.points[..., 3] / found.points[0, 0, 3]
    assert weights.tolist() == [[1, 2], [1, 1]]
    assert (found.points[0, 1, :3] / found.points[0, 1, 3]).tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("keyword", "expected"),
    [("BEZIER", [0, 1, 2]), ("QUASI_UNIFORM", [0, 1, 2, 3, 4]), ("UNIFORM", [0, 1, 2, 3, 4])],
)
def test_implied_knots(keyword: str, expected: list[float]) -> None:
    writer = Writer()
    points = net(writer, 7, 4)
    surface = writer(f"{keyword}_SURFACE('',3,3,{points},.UNSPECIFIED.,.F.,.F.,.F.)")
    found = read(writer, surface).cut(NO_OUTLINE)
    np.testing.assert_allclose(np.unique(found.knots[0]), expected)
    np.testing.assert_allclose(np.unique(found.knots[1]), [0, 1])


@pytest.mark.parametrize(
    ("senses", "same_sense"), [(".T.,.T.", True), (".F.,.T.", False), (".F.,.F.", True)]
)
def test_trimmed_surfaces_may_be_turned(senses: str, same_sense: bool) -> None:
    writer = Writer()
    cylinder = writer(f"CYLINDRICAL_SURFACE('',{writer.frame()},2.)")
    trimmed = writer(f"RECTANGULAR_TRIMMED_SURFACE('',{cylinder},0.,1.,0.,1.,{senses})")
    bounded = writer(f"CURVE_BOUNDED_SURFACE('',{trimmed},(),.F.)")
    found = read(writer, bounded)
    assert isinstance(found.shape, Cylinder)
    assert found.same_sense == same_sense


def test_offsets_of_elementary_surfaces_are_exact() -> None:
    writer = Writer()
    frame = writer.frame()
    shapes = [
        read(writer, writer(f"OFFSET_SURFACE('',{writer(record)},0.5,.F.)")).shape
        for record in (
            f"PLANE('',{frame})",
            f"CYLINDRICAL_SURFACE('',{frame},2.)",
            f"SPHERICAL_SURFACE('',{frame},2.)",
            f"TOROIDAL_SURFACE('',{frame},3.,2.)",
        )
    ]
    assert isinstance(shapes[0], Plane)
    assert shapes[0].frame.origin == (0.0, 0.0, 0.5)
    assert [getattr(shape, "radius", None) for shape in shapes[1:3]] == [2.5, 2.5]
    assert isinstance(shapes[3], Torus)
    assert shapes[3].minor == 2.5
    turned = writer(
        f"RECTANGULAR_TRIMMED_SURFACE('',{writer(f'SPHERICAL_SURFACE({chr(39) * 2},{frame},2.)')},"
        "0.,1.,0.,1.,.F.,.T.)"
    )
    inwards = read(writer, writer(f"OFFSET_SURFACE('',{turned},0.5,.F.)"))
    assert inwards == Oriented(Sphere(shapes[0].frame.move((0, 0, 0)), 1.5), same_sense=False)


def test_other_offsets_are_named() -> None:
    writer = Writer()
    spline = writer(f"BEZIER_SURFACE('',1,1,{net(writer, 2, 2)},.UNSPECIFIED.,.F.,.F.,.F.)")
    with pytest.raises(InvalidGeometry, match="an offset of a spline surface"):
        read(writer, writer(f"OFFSET_SURFACE('',{spline},0.5,.F.)"))


def test_replicas() -> None:
    writer = Writer()
    origin = writer.point(0, 0, 5)
    moved = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,{origin},$,$)")
    scaled = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,{origin},2.,$)")
    sphere = writer(f"SPHERICAL_SURFACE('',{writer.frame()},2.)")
    spline = writer(f"BEZIER_SURFACE('',1,1,{net(writer, 2, 2)},.UNSPECIFIED.,.F.,.F.,.F.)")
    found = read(writer, writer(f"SURFACE_REPLICA('',{sphere},{moved})")).shape
    assert isinstance(found, Sphere)
    assert found.frame.origin == (0.0, 0.0, 5.0)
    other = read(writer, writer(f"SURFACE_REPLICA('',{spline},{scaled})")).shape
    assert isinstance(other, Surface)
    np.testing.assert_allclose(evaluate_surface(other, [1], [1]), [[2, 2, 7]])
    with pytest.raises(InvalidGeometry, match="scaled or mirrored"):
        read(writer, writer(f"SURFACE_REPLICA('',{sphere},{scaled})"))


@pytest.mark.parametrize(
    "record",
    [
        "CYLINDRICAL_SURFACE('',#1,0.)",
        "CYLINDRICAL_SURFACE('',#1)",
        "SPHERICAL_SURFACE('',#9,1.)",
        "CONICAL_SURFACE('',#1,1.,2.)",
        "TOROIDAL_SURFACE('',#1,-3.,1.)",
        "OFFSET_SURFACE('',#4,1.,.F.)",  # of itself
        "RECTANGULAR_TRIMMED_SURFACE('',#4,0.,1.,0.,1.,.T.,.T.)",
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#2,#3),(#2)),.U.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.U.)",
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,(),.U.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.U.)",
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#2,#3),(#3,#2)),.U.,.F.,.F.,.F.,(2,2),(2,2))",
        "SURFACE_OF_REVOLUTION('',#2,#1)",
        "LINE('',#1,#2)",
    ],
)
def test_malformed_surfaces(record: str) -> None:
    writer = Writer()
    writer("AXIS2_PLACEMENT_3D('',#2,$,$)")
    writer.point(0, 0, 0)
    writer.point(1, 0, 0)
    surface = writer(record)
    with pytest.raises(InvalidGeometry):
        read(writer, surface)
