"""Shapes of Open CASCADE, by name: every kind of surface and curve that it can write to a file.

Only a Python in which cadquery-ocp is installed can import this module.
"""

from collections.abc import Callable, Mapping, Sequence
from math import cos, pi, radians, sin, tau
from typing import Any, TypeAlias

from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe, BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
    BRepPrimAPI_MakeWedge,
)
from OCP.collections import Array1_gp_Pnt, Array2_gp_Pnt
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BezierSurface,
    Geom_CylindricalSurface,
    Geom_Hyperbola,
    Geom_OffsetSurface,
    Geom_Parabola,
)
from OCP.GeomAPI import GeomAPI_PointsToBSpline, GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Elips, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_EDGE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

Point: TypeAlias = Sequence[float]

UP = gp_Dir(0, 0, 1)


def frame(x: float, y: float, z: float, direction: Point = (0, 0, 1)) -> Any:
    """A coordinate system at a point, with this z axis."""
    return gp_Ax2(gp_Pnt(x, y, z), gp_Dir(*direction))


def cut(shape: Any, *tools: Any) -> Any:
    """The shape without the tools."""
    for tool in tools:
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return shape


def first_solid(shape: Any) -> Any:
    """The first solid of a shape."""
    return TopExp_Explorer(shape, TopAbs_SOLID).Current()


def edges_of(shape: Any) -> list[Any]:
    """The edges of a shape."""
    explorer = TopExp_Explorer(shape, TopAbs_EDGE)
    seen: list[Any] = []
    while explorer.More():
        edge = TopoDS.Edge(explorer.Current())
        if not any(edge.IsSame(other) for other in seen):
            seen.append(edge)
        explorer.Next()
    return seen


def polygon(*points: Point) -> Any:
    """A closed wire of lines."""
    maker = BRepBuilderAPI_MakePolygon()
    for point in points:
        maker.Add(gp_Pnt(*point))
    maker.Close()
    return maker.Wire()


def spline(*points: Point) -> Any:
    """An interpolating spline, as an edge."""
    array = Array1_gp_Pnt(1, len(points))
    for number, point in enumerate(points, 1):
        array.SetValue(number, gp_Pnt(*point))
    return BRepBuilderAPI_MakeEdge(GeomAPI_PointsToBSpline(array).Curve()).Edge()


def wire(*edges: Any) -> Any:
    """A wire of edges."""
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges:
        maker.Add(edge)
    return maker.Wire()


def prism(closed_wire: Any, height: float) -> Any:
    """The solid above a planar wire."""
    face = BRepBuilderAPI_MakeFace(closed_wire).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, height)).Shape()


def line(a: Point, b: Point) -> Any:
    """A line, as an edge."""
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*a), gp_Pnt(*b)).Edge()


def box() -> Any:
    return BRepPrimAPI_MakeBox(30, 20, 10).Shape()


def plate() -> Any:
    holes = [
        BRepPrimAPI_MakeCylinder(frame(x, y, -1), 3, 7).Shape() for x in (8, 32) for y in (8, 22)
    ]
    return cut(BRepPrimAPI_MakeBox(40, 30, 5).Shape(), *holes)


def bolt() -> Any:
    shank = BRepPrimAPI_MakeCylinder(2.8, 12).Shape()
    head = BRepPrimAPI_MakeCone(frame(0, 0, 12), 5, 4, 3).Shape()
    return first_solid(BRepAlgoAPI_Fuse(shank, head).Shape())


def fillets() -> Any:
    shape = box()
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in edges_of(shape):
        maker.Add(2.0, edge)
    return first_solid(maker.Shape())


def chamfers() -> Any:
    shape = box()
    maker = BRepFilletAPI_MakeChamfer(shape)
    for edge in edges_of(shape)[:4]:
        maker.Add(1.5, edge)
    return first_solid(maker.Shape())


def revolved_spline() -> Any:
    profile = wire(
        spline((4, 0, 0), (7, 0, 4), (3, 0, 9), (5, 0, 14)),
        line((5, 0, 14), (0, 0, 14)),
        line((0, 0, 14), (0, 0, 0)),
        line((0, 0, 0), (4, 0, 0)),
    )
    face = BRepBuilderAPI_MakeFace(profile).Face()
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), UP)).Shape()


def revolved_part() -> Any:
    face = BRepBuilderAPI_MakeFace(polygon((5, 0, 0), (9, 0, 1), (8, 0, 6), (5, 0, 5))).Face()
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), UP), radians(250)).Shape()


def extruded_spline() -> Any:
    points = ((0, 0, 0), (6, 5, 0), (12, -3, 0), (18, 4, 0))
    outline = wire(
        spline(*points),
        line(points[-1], (18, 14, 0)),
        line((18, 14, 0), (0, 14, 0)),
        line((0, 14, 0), points[0]),
    )
    return prism(outline, 7)


def extruded_ellipse() -> Any:
    ellipse = BRepBuilderAPI_MakeEdge(gp_Elips(frame(0, 0, 0), 9, 5)).Edge()
    return prism(wire(ellipse), 8)


def extruded_parabola() -> Any:
    curve = Geom_Parabola(frame(0, 0, 0), 2.0)
    edge = BRepBuilderAPI_MakeEdge(curve, -6.0, 6.0).Edge()
    ends = [curve.Value(t) for t in (-6.0, 6.0)]
    chord = BRepBuilderAPI_MakeEdge(ends[1], ends[0]).Edge()
    return prism(wire(edge, chord), 5)


def extruded_hyperbola() -> Any:
    curve = Geom_Hyperbola(frame(0, 0, 0), 4.0, 3.0)
    edge = BRepBuilderAPI_MakeEdge(curve, -1.2, 1.2).Edge()
    ends = [curve.Value(t) for t in (-1.2, 1.2)]
    chord = BRepBuilderAPI_MakeEdge(ends[1], ends[0]).Edge()
    return prism(wire(edge, chord), 5)


def extruded_bezier() -> Any:
    array = Array1_gp_Pnt(1, 4)
    for number, point in enumerate(((0, 0, 0), (3, 9, 0), (9, -6, 0), (12, 3, 0)), 1):
        array.SetValue(number, gp_Pnt(*point))
    edge = BRepBuilderAPI_MakeEdge(Geom_BezierCurve(array)).Edge()
    outline = wire(
        edge,
        line((12, 3, 0), (12, 12, 0)),
        line((12, 12, 0), (0, 12, 0)),
        line((0, 12, 0), (0, 0, 0)),
    )
    return prism(outline, 4)


def loft() -> Any:
    maker = BRepOffsetAPI_ThruSections(True, False)
    for z, radius in ((0, 10), (10, 6), (20, 9)):
        ellipse = gp_Elips(frame(0, 0, z), radius, 0.6 * radius)
        maker.AddWire(wire(BRepBuilderAPI_MakeEdge(ellipse).Edge()))
    maker.Build()
    return maker.Shape()


def ruled_loft() -> Any:
    maker = BRepOffsetAPI_ThruSections(True, True)
    maker.AddWire(polygon((0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)))
    maker.AddWire(polygon((3, -2, 8), (12, 3, 8), (7, 12, 8), (-2, 7, 8)))
    maker.Build()
    return maker.Shape()


def pipe() -> Any:
    spine = wire(spline((0, 0, 0), (0, 0, 10), (6, 4, 18), (16, 4, 20)))
    ellipse = BRepBuilderAPI_MakeEdge(gp_Elips(frame(0, 0, 0), 3, 2)).Edge()
    profile = BRepBuilderAPI_MakeFace(wire(ellipse)).Face()
    return first_solid(BRepOffsetAPI_MakePipe(spine, profile).Shape())


def hollow() -> Any:
    return first_solid(
        cut(
            BRepPrimAPI_MakeBox(20, 20, 20).Shape(),
            BRepPrimAPI_MakeSphere(gp_Pnt(6, 6, 6), 4).Shape(),
            BRepPrimAPI_MakeTorus(frame(13, 13, 13), 4, 1).Shape(),
        )
    )


def crossed_cylinders() -> Any:
    first = BRepPrimAPI_MakeCylinder(frame(0, 0, -10), 5, 20).Shape()
    second = BRepPrimAPI_MakeCylinder(frame(-10, 0, 0, (1, 0, 0)), 3, 20).Shape()
    return first_solid(BRepAlgoAPI_Fuse(first, second).Shape())


def drilled_sphere() -> Any:
    ball = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, 0), 8).Shape()
    drill = BRepPrimAPI_MakeCylinder(frame(2, 1, -10), 2, 20).Shape()
    return first_solid(cut(ball, drill))


def cut_torus() -> Any:
    ring = BRepPrimAPI_MakeTorus(frame(0, 0, 0), 10, 3).Shape()
    corner = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, -5), gp_Pnt(20, 20, 5)).Shape()
    return first_solid(cut(ring, corner))


def cut_cone() -> Any:
    cone = BRepPrimAPI_MakeCone(8, 0, 16).Shape()
    side = BRepPrimAPI_MakeBox(gp_Pnt(2, -20, -1), gp_Pnt(20, 20, 20)).Shape()
    return first_solid(cut(cone, side))


def cone_and_cylinder() -> Any:
    cone = BRepPrimAPI_MakeCone(8, 3, 14).Shape()
    drill = BRepPrimAPI_MakeCylinder(frame(-20, 0, 5, (1, 0, 0.2)), 2, 40).Shape()
    return first_solid(cut(cone, drill))


def spline_bowl() -> Any:
    array = Array2_gp_Pnt(1, 6, 1, 6)
    for row in range(6):
        for column in range(6):
            height = 8 + 2 * sin(row) * cos(column)
            array.SetValue(row + 1, column + 1, gp_Pnt(4 * row, 4 * column, height))
    surface = GeomAPI_PointsToBSplineSurface(array).Surface()
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(1, 0.5, 6)).Shape()


def bezier_block() -> Any:
    array = Array2_gp_Pnt(1, 4, 1, 3)
    for row in range(4):
        for column in range(3):
            array.SetValue(
                row + 1, column + 1, gp_Pnt(5 * row, 6 * column, (row - 1.5) ** 2 * (column - 1))
            )
    face = BRepBuilderAPI_MakeFace(Geom_BezierSurface(array), 1e-6).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, 12)).Shape()


def offset_face() -> Any:
    array = Array2_gp_Pnt(1, 4, 1, 4)
    for row in range(4):
        for column in range(4):
            array.SetValue(row + 1, column + 1, gp_Pnt(5 * row, 5 * column, row * column % 3))
    surface = Geom_OffsetSurface(GeomAPI_PointsToBSplineSurface(array).Surface(), 1.0)
    return BRepBuilderAPI_MakeFace(surface, 1e-6).Face()


def cylinder_face() -> Any:
    surface = Geom_CylindricalSurface(gp_Ax3(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 1)), 10)
    return BRepBuilderAPI_MakeFace(surface, 0, 4, 0, 20, 1e-6).Face()


def gear() -> Any:
    teeth = 12
    corners = []
    for tooth in range(teeth):
        for share, radius in ((0.0, 8), (0.3, 8), (0.4, 10), (0.9, 10)):
            angle = tau * (tooth + share) / teeth
            corners.append((radius * cos(angle), radius * sin(angle), 0))
    bore = BRepPrimAPI_MakeCylinder(frame(0, 0, -1), 3, 10).Shape()
    return first_solid(cut(prism(polygon(*corners), 5), bore))


def panel() -> Any:
    """A rounded panel of 314 faces: countersunk holes, dimples and hexagonal pockets."""
    block = BRepPrimAPI_MakeBox(120, 90, 8).Shape()
    rounding = BRepFilletAPI_MakeFillet(block)
    for edge in edges_of(block):
        rounding.Add(2.0, edge)
    shape = rounding.Shape()
    for row in range(8):
        for column in range(12):
            x, y = 10 + 9.1 * column, 10 + 10 * row
            if column % 2 == 0:
                shape = cut(
                    shape,
                    BRepPrimAPI_MakeCylinder(frame(x, y, -1), 1.5, 10).Shape(),
                    BRepPrimAPI_MakeCone(frame(x, y, 6.5), 1.5, 3.5, 2).Shape(),
                )
            elif column % 4 == 1:
                shape = cut(shape, BRepPrimAPI_MakeSphere(gp_Pnt(x, y, 9), 2.5).Shape())
            else:
                hexagon = polygon(
                    *((x + 3 * cos(k * pi / 3), y + 3 * sin(k * pi / 3), 5) for k in range(6))
                )
                shape = cut(shape, prism(hexagon, 5))
    return first_solid(shape)


def moved(shape: Any, offset: Point, factor: float = 1.0, mirrored: bool = False) -> Any:
    """The shape, scaled, mirrored if that is asked for, turned and moved."""
    scale, mirror, turn, move = (gp_Trsf() for _ in range(4))
    scale.SetScale(gp_Pnt(0, 0, 0), factor)
    if mirrored:
        mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 2, 3)))
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 1, 0)), 0.7)
    move.SetTranslation(gp_Vec(*offset))
    for step in (scale, mirror, turn, move):
        shape = BRepBuilderAPI_Transform(shape, step, True).Shape()
    return shape


SHAPES: Mapping[str, Callable[[], Any]] = {
    "box": box,
    "cylinder": lambda: BRepPrimAPI_MakeCylinder(5, 12).Shape(),
    "cylinder_part": lambda: BRepPrimAPI_MakeCylinder(5, 12, 4.0).Shape(),
    "cone": lambda: BRepPrimAPI_MakeCone(6, 0, 9).Shape(),
    "frustum": lambda: BRepPrimAPI_MakeCone(frame(1, 2, 3, (1, 1, 1)), 6, 2, 9, 4.5).Shape(),
    "sphere": lambda: BRepPrimAPI_MakeSphere(gp_Pnt(1, 2, 3), 7).Shape(),
    "sphere_part": lambda: BRepPrimAPI_MakeSphere(frame(0, 0, 0), 7, -0.5, 1.0, 4.0).Shape(),
    "torus": lambda: BRepPrimAPI_MakeTorus(frame(0, 0, 0, (1, 0, 1)), 9, 3).Shape(),
    "torus_part": lambda: BRepPrimAPI_MakeTorus(frame(0, 0, 0), 9, 3, 0.3, 2.0, 3.0).Shape(),
    "wedge": lambda: BRepPrimAPI_MakeWedge(10, 8, 6, 3).Shape(),
    "plate": plate,
    "bolt": bolt,
    "fillets": fillets,
    "chamfers": chamfers,
    "revolved_spline": revolved_spline,
    "revolved_part": revolved_part,
    "extruded_spline": extruded_spline,
    "extruded_ellipse": extruded_ellipse,
    "extruded_parabola": extruded_parabola,
    "extruded_hyperbola": extruded_hyperbola,
    "extruded_bezier": extruded_bezier,
    "loft": loft,
    "ruled_loft": ruled_loft,
    "pipe": pipe,
    "hollow": hollow,
    "crossed_cylinders": crossed_cylinders,
    "drilled_sphere": drilled_sphere,
    "cut_torus": cut_torus,
    "cut_cone": cut_cone,
    "cone_and_cylinder": cone_and_cylinder,
    "spline_bowl": spline_bowl,
    "bezier_block": bezier_block,
    "offset_face": offset_face,
    "cylinder_face": cylinder_face,
    "gear": gear,
    "panel": panel,
    "common": lambda: first_solid(
        BRepAlgoAPI_Common(
            BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, 0), 7).Shape(),
            BRepPrimAPI_MakeBox(gp_Pnt(-5, -5, -5), gp_Pnt(5, 5, 5)).Shape(),
        ).Shape()
    ),
    "far_away": lambda: moved(plate(), (1e5, -2e5, 3e4)),
    "mirrored": lambda: moved(bolt(), (3, 4, 5), mirrored=True),
    "tiny": lambda: moved(drilled_sphere(), (0, 0, 0), 1e-3),
    "huge": lambda: moved(cut_torus(), (0, 0, 0), 1e4),
    "half_turn": lambda: BRepPrimAPI_MakeRevol(
        BRepBuilderAPI_MakeFace(polygon((0, 0, 0), (6, 0, 0), (6, 0, 4), (0, 0, 8))).Face(),
        gp_Ax1(gp_Pnt(0, 0, 0), UP),
        pi,
    ).Shape(),
}
"""For each name, a function that makes the shape."""
