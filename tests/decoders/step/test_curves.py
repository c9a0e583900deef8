"""Curves of STEP files: their pieces, senses and parameters."""

from math import pi, sqrt

import numpy as np
import pytest

from service.decoders.cad.conics import Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.splines import evaluate, find_ends
from service.decoders.step.curves import CurveReader, Directed
from service.errors import InvalidRequest
from tests.decoders.step.written import Writer, find_entities


def directed(writer: Writer, curve: str) -> Directed:
    return CurveReader(find_entities(writer.data), 1.0).read(int(curve[1:]))


def piece(writer: Writer, curve: str, radians: float = 1.0) -> Curve:
    found = CurveReader(find_entities(writer.data), radians).read_piece(int(curve[1:]))
    assert isinstance(found, Curve)
    return found


def ends(curve: Curve) -> list[list[float]]:
    found: list[list[float]] = np.round(find_ends(curve), 12).tolist()
    return found


def trim(writer: Writer, basis: str, first: str, last: str, sense: str = ".T.") -> str:
    return writer(f"TRIMMED_CURVE('',{basis},({first}),({last}),{sense},.PARAMETER.)")


def spline(writer: Writer, keyword: str, points: int, more: str = "", degree: int = 3) -> str:
    names = ",".join(writer.point(k, k * k, 0) for k in range(points))
    return writer(f"{keyword}('',{degree},({names}),.UNSPECIFIED.,.F.,.F.{more})")


def test_lines_have_the_length_of_their_vector() -> None:
    writer = Writer()
    curve = writer.line((1, 0, 0), (0, 3, 4), magnitude=10)
    assert directed(writer, curve).curve == Line((1, 0, 0), (0, 6, 8))


def test_conics() -> None:
    writer = Writer()
    frame = writer.frame((1, 2, 3))
    circle, ellipse, parabola, hyperbola = (
        writer(record)
        for record in (
            f"CIRCLE('',{frame},2.)",
            f"ELLIPSE('',{frame},2.,3.)",
            f"PARABOLA('',{frame},2.)",
            f"HYPERBOLA('',{frame},2.,3.)",
        )
    )
    found = directed(writer, circle).curve
    assert isinstance(found, Ellipse)
    assert (found.a, found.b, found.frame.origin) == (2, 2, (1, 2, 3))
    for name, kind in ((ellipse, Ellipse), (parabola, Parabola), (hyperbola, Hyperbola)):
        assert isinstance(directed(writer, name).curve, kind)
    assert directed(writer, ellipse).curve == Ellipse(found.frame, 2, 3)


def test_splines_with_knots() -> None:
    writer = Writer()
    curve = piece(
        writer,
        spline(writer, "B_SPLINE_CURVE_WITH_KNOTS", 5, ",(4,1,4),(0.,.5,2.),.UNSPECIFIED."),
    )
    assert curve.knots.tolist() == [0, 0, 0, 0, 0.5, 2, 2, 2, 2]
    assert curve.points[:, :3].tolist() == [[k, k * k, 0] for k in range(5)]


def test_rational_splines_are_complex_in_any_order() -> None:
    writer = Writer()
    points = ",".join(writer.point(*each) for each in ((1, 0, 0), (1, 1, 0), (0, 1, 0)))
    curve = writer(
        f"(RATIONAL_B_SPLINE_CURVE((1.,{sqrt(0.5)},1.))BOUNDED_CURVE()REPRESENTATION_ITEM('')"
        "B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.)CURVE()"
        f"GEOMETRIC_REPRESENTATION_ITEM()B_SPLINE_CURVE(2,({points}),.CIRCULAR_ARC.,.F.,.F.))"
    )
    found = piece(writer, curve)
    radii = np.linalg.norm(evaluate(found, np.linspace(0, 1, 9)), axis=1)
    np.testing.assert_allclose(radii, 1, rtol=1e-14)


@pytest.mark.parametrize(
    ("keyword", "points", "last", "spans"),
    [("BEZIER_CURVE", 7, 2.0, 2), ("QUASI_UNIFORM_CURVE", 6, 3.0, 3), ("UNIFORM_CURVE", 6, 3.0, 3)],
)
def test_implied_knots(keyword: str, points: int, last: float, spans: int) -> None:
    writer = Writer()
    found = piece(writer, spline(writer, keyword, points))
    assert (found.knots[0], found.knots[-1]) == (0.0, last)
    assert len(np.unique(found.knots)) == spans + 1
    assert found.degree == 3


def test_implied_knots_of_rational_complex_splines() -> None:
    writer = Writer()
    points = ",".join(writer.point(*each) for each in ((1, 0, 0), (1, 1, 0), (0, 1, 0)))
    curve = writer(
        f"(BEZIER_CURVE()B_SPLINE_CURVE(2,({points}),.UNSPECIFIED.,.F.,.F.)"
        "RATIONAL_B_SPLINE_CURVE((1.,2.,1.))REPRESENTATION_ITEM(''))"
    )
    found = piece(writer, curve)
    assert (found.points[:, 3] / found.points[0, 3]).tolist() == [1, 2, 1]


def test_polylines() -> None:
    writer = Writer()
    points = ",".join(writer.point(*each) for each in ((0, 0, 0), (3, 0, 0), (3, 4, 0)))
    found = piece(writer, writer(f"POLYLINE('',({points}))"))
    assert found.knots.tolist() == [0, 0, 3, 7, 7]


@pytest.mark.parametrize(("sense", "start"), [(".T.", [1, 0, 0]), (".F.", [1, 0, 0])])
def test_trimmed_circles_by_parameters(sense: str, start: list[float]) -> None:
    writer = Writer()
    ends_of = "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(90.)"
    found = piece(writer, trim(writer, writer.circle(1), *ends_of, sense), radians=pi / 180)
    assert ends(found) == [start, [0, 1, 0]]
    # With the sense of the circle it is a quarter, against it three quarters.
    middle = evaluate(found, [(found.knots[0] + found.knots[-1]) / 2])[0]
    assert middle @ [1, 1, 0] == pytest.approx(sqrt(2) if sense == ".T." else -sqrt(2))


def test_trimmed_curves_by_points() -> None:
    writer = Writer()
    basis = writer.line((0, 0, 0), (1, 0, 0), magnitude=2)
    first, last = writer.point(5, 0, 0), writer.point(1, 0, 0)
    curve = writer(
        f"TRIMMED_CURVE('',{basis},({first},PARAMETER_VALUE(7.)),(PARAMETER_VALUE(9.),{last}),.F.,"
        ".CARTESIAN.)"
    )
    assert ends(piece(writer, curve)) == [[5, 0, 0], [1, 0, 0]]
    only_points = trim(writer, basis, first, last, ".F.")
    assert ends(piece(writer, only_points)) == [[5, 0, 0], [1, 0, 0]]


def test_trimmed_lines_run_in_units_of_their_vector() -> None:
    writer = Writer()
    basis = writer.line((0, 0, 0), (1, 0, 0), magnitude=2)
    curve = trim(writer, basis, "PARAMETER_VALUE(1.)", "PARAMETER_VALUE(3.)")
    assert ends(piece(writer, curve)) == [[2, 0, 0], [6, 0, 0]]


def test_trimmed_splines() -> None:
    writer = Writer()
    basis = spline(writer, "BEZIER_CURVE", 2, degree=1)
    forward = trim(writer, basis, "PARAMETER_VALUE(0.25)", "PARAMETER_VALUE(0.5)")
    backward = trim(writer, basis, "PARAMETER_VALUE(0.5)", "PARAMETER_VALUE(0.25)", ".F.")
    assert ends(piece(writer, forward)) == [[0.25, 0.25, 0], [0.5, 0.5, 0]]
    assert ends(piece(writer, backward)) == [[0.5, 0.5, 0], [0.25, 0.25, 0]]
    wrong = trim(writer, basis, "PARAMETER_VALUE(0.5)", "PARAMETER_VALUE(0.25)")
    with pytest.raises(InvalidGeometry, match="wrong order"):
        piece(writer, wrong)


def test_closed_splines_are_trimmed_over_their_seam() -> None:
    writer = Writer()
    corners = [writer.point(*each) for each in ((0, 0, 0), (2, 0, 0), (2, 2, 0))]
    basis = writer(f"POLYLINE('',({','.join([*corners, corners[0]])}))")
    curve = trim(writer, basis, "PARAMETER_VALUE(3.)", "PARAMETER_VALUE(1.)")
    found = piece(writer, curve)
    assert ends(found) == [[2, 1, 0], [1, 0, 0]]
    assert found.knots[-1] - found.knots[0] == pytest.approx(2 + 2 * sqrt(2))


def test_edges_on_trimmed_curves_lie_on_the_basis() -> None:
    writer = Writer()
    curve = trim(writer, writer.circle(1), "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(1.)", ".F.")
    again = trim(writer, curve, "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(1.)", ".F.")
    found, same_sense = directed(writer, curve)
    assert isinstance(found, Ellipse)
    assert not same_sense
    assert directed(writer, again).same_sense


def test_composite_curves() -> None:
    writer = Writer()
    arc = trim(writer, writer.circle(1), "PARAMETER_VALUE(0.)", f"PARAMETER_VALUE({pi / 2})")
    points = writer.point(2, 0, 0), writer.point(1, 0, 0)
    line = writer(f"POLYLINE('',({points[1]},{points[0]}))")
    segments = [
        writer(f"COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{sense},{curve})")
        for sense, curve in ((".F.", line), (".T.", arc))
    ]
    curve = writer(f"COMPOSITE_CURVE('',({','.join(segments)}),.F.)")
    found = piece(writer, curve)
    assert ends(found) == [[2, 0, 0], [0, 1, 0]]
    assert found.degree == 2
    writer.lines[int(segments[0][1:]) - 1] = (
        f"{segments[0]}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,{line});"
    )
    with pytest.raises(InvalidGeometry, match="do not meet"):
        piece(writer, curve)


def test_curves_on_surfaces_are_their_curves_of_space() -> None:
    writer = Writer()
    circle = writer.circle(2)
    for keyword in ("SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE"):
        curve = writer(f"{keyword}('',{circle},(),.CURVE_3D.)")
        assert isinstance(directed(writer, curve).curve, Ellipse)
    complex_ = writer(f"(CURVE()SURFACE_CURVE({circle},(),.CURVE_3D.)REPRESENTATION_ITEM(''))")
    assert isinstance(directed(writer, complex_).curve, Ellipse)


def test_replicas() -> None:
    writer = Writer()
    line = writer(f"POLYLINE('',({writer.point(0, 0, 0)},{writer.point(1, 0, 0)}))")
    moved = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,{writer.point(0, 5, 0)},2.,$)")
    assert ends(piece(writer, writer(f"CURVE_REPLICA('',{line},{moved})"))) == [
        [0, 5, 0],
        [2, 5, 0],
    ]


@pytest.mark.parametrize(
    "record",
    [
        "TRIMMED_CURVE('',#1,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.)",
        "COMPOSITE_CURVE('',(#2),.F.)",
        "SURFACE_CURVE('',#1,(),.CURVE_3D.)",
        "CURVE_REPLICA('',#1,#2)",
    ],
)
def test_curves_that_refer_to_themselves(record: str) -> None:
    writer = Writer()
    writer(record)
    writer("COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#1)")
    for read in (directed, piece):
        with pytest.raises(InvalidGeometry):
            read(writer, "#1")


@pytest.mark.parametrize(
    "record",
    [
        "CIRCLE('',#1,0.)",
        "CIRCLE('',#1,'x')",
        "CIRCLE('',#1)",
        "CIRCLE('',#9,1.)",
        "LINE('',#1,#2)",
        "OFFSET_CURVE_3D('',#1,1.,.F.,#2)",
        "PLANE('',#1)",
        "POLYLINE('',())",
        "POLYLINE('',(#3,#3))",
        "B_SPLINE_CURVE('',1,(#3,#4),.UNSPECIFIED.,.F.,.F.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',2,(#3,#4),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#3,#4),.U.,.F.,.F.,(2,1.5),(0.,1.),.UNSPECIFIED.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#3,#4),.U.,.F.,.F.,(2,1000000000),(0.,1.),.U.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#3,#4),.U.,.F.,.F.,(2,2),(1.,0.),.UNSPECIFIED.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#3,#3),.U.,.F.,.F.,(2,2),(0.,1.),.UNSPECIFIED.)",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#3,#4),.U.,.F.)",
        "BEZIER_CURVE('',1000000000,(#3,#4),.UNSPECIFIED.,.F.,.F.)",
        "(B_SPLINE_CURVE_WITH_KNOTS((2,2),(0.,1.),.UNSPECIFIED.)RATIONAL_B_SPLINE_CURVE((1.,1.)))",
        "(B_SPLINE_CURVE(1,(#3,#4),.U.,.F.,.F.)RATIONAL_B_SPLINE_CURVE())",
        "(B_SPLINE_CURVE(1,(#3,#4),.U.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((2,2)))",
        "TRIMMED_CURVE('',#6,(),(),.T.,.PARAMETER.)",
    ],
)
def test_malformed_curves(record: str) -> None:
    writer = Writer()
    writer("AXIS2_PLACEMENT_3D('',#3,$,$)")
    writer("VECTOR('',#5,1.)")
    writer.point(0, 0, 0)
    writer.point(1, 0, 0)
    writer.direction(0, 0, 0)
    writer("CIRCLE('',#1,1.)")
    curve = writer(record)
    with pytest.raises(InvalidGeometry):
        piece(writer, curve)


def test_composite_curves_of_composite_curves_do_not_explode() -> None:
    writer = Writer()
    line = writer(f"POLYLINE('',({writer.point(0, 0, 0)},{writer.point(0, 0, 1)}))")
    for _ in range(30):
        halves = [
            writer(f"COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{sense},{line})")
            for sense in (".T.", ".F.")
        ]
        line = writer(f"COMPOSITE_CURVE('',({','.join(halves)}),.F.)")
    with pytest.raises(InvalidRequest) as error:
        piece(writer, line)
    assert error.value.issues[0].code == "too_costly"
