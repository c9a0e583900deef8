"""Shapes of Open CASCADE, by name: every kind of surface and curve that it can write to a file.

Only a Python in which cadquery-ocp is installed can import this module.
"""

from collections.abc import Callable, Mapping
from math import cos, pi, radians, sin, tau
from typing import Any

from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Transform
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe, BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
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
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Elips, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer

from tools.benchmarks.solid_shapes import (
    UP,
    Point,
    box,
    common,
    cone,
    cut,
    cylinder,
    edge,
    extrude,
    fill,
    fillet,
    fuse,
    interpolate,
    list_edges,
    place,
    polygon,
    revolve,
    sphere,
    torus,
    wire,
)

ORIGIN = (0, 0, 0)


def first_solid(shape: Any) -> Any:
    """The first solid of a shape."""
    return TopExp_Explorer(shape, TopAbs_SOLID).Current()


def plate() -> Any:
    holes = [cylinder((x, y, -1), 3, 7) for x in (8, 32) for y in (8, 22)]
    return cut(box(ORIGIN, (40, 30, 5)), *holes)


def bolt() -> Any:
    shank = cylinder(ORIGIN, 2.8, 12)
    head = cone((0, 0, 12), 5, 4, 3)
    return first_solid(fuse(shank, head))


def chamfers() -> Any:
    shape = box(ORIGIN, (30, 20, 10))
    maker = BRepFilletAPI_MakeChamfer(shape)
    for each in list_edges(shape)[:4]:
        maker.Add(1.5, each)
    return first_solid(maker.Shape())


def revolved_spline() -> Any:
    profile = wire(
        edge(interpolate([(4, 0, 0), (7, 0, 4), (3, 0, 9), (5, 0, 14)])),
        edge((5, 0, 14), (0, 0, 14)),
        edge((0, 0, 14), (0, 0, 0)),
        edge((0, 0, 0), (4, 0, 0)),
    )
    face = fill(profile)
    return revolve(face)


def revolved_part() -> Any:
    face = fill(polygon([(5, 0, 0), (9, 0, 1), (8, 0, 6), (5, 0, 5)]))
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), UP), radians(250)).Shape()


def extruded_spline() -> Any:
    points = ((0, 0, 0), (6, 5, 0), (12, -3, 0), (18, 4, 0))
    outline = wire(
        edge(interpolate(points)),
        edge(points[-1], (18, 14, 0)),
        edge((18, 14, 0), (0, 14, 0)),
        edge((0, 14, 0), points[0]),
    )
    return extrude(fill(outline), (0, 0, 7))


def extruded_ellipse() -> Any:
    ellipse = edge(gp_Elips(place((0, 0, 0)), 9, 5))
    return extrude(fill(wire(ellipse)), (0, 0, 8))


def extruded_parabola() -> Any:
    curve = Geom_Parabola(place((0, 0, 0)), 2.0)
    arc = edge(curve, -6.0, 6.0)
    ends = [curve.Value(t) for t in (-6.0, 6.0)]
    chord = edge(ends[1], ends[0])
    return extrude(fill(wire(arc, chord)), (0, 0, 5))


def extruded_hyperbola() -> Any:
    curve = Geom_Hyperbola(place((0, 0, 0)), 4.0, 3.0)
    arc = edge(curve, -1.2, 1.2)
    ends = [curve.Value(t) for t in (-1.2, 1.2)]
    chord = edge(ends[1], ends[0])
    return extrude(fill(wire(arc, chord)), (0, 0, 5))


def extruded_bezier() -> Any:
    array = Array1_gp_Pnt(1, 4)
    for number, point in enumerate(((0, 0, 0), (3, 9, 0), (9, -6, 0), (12, 3, 0)), 1):
        array.SetValue(number, gp_Pnt(*point))
    arc = edge(Geom_BezierCurve(array))
    outline = wire(
        arc,
        edge((12, 3, 0), (12, 12, 0)),
        edge((12, 12, 0), (0, 12, 0)),
        edge((0, 12, 0), (0, 0, 0)),
    )
    return extrude(fill(outline), (0, 0, 4))


def loft() -> Any:
    maker = BRepOffsetAPI_ThruSections(True, False)
    for z, radius in ((0, 10), (10, 6), (20, 9)):
        ellipse = gp_Elips(place((0, 0, z)), radius, 0.6 * radius)
        maker.AddWire(wire(edge(ellipse)))
    maker.Build()
    return maker.Shape()


def ruled_loft() -> Any:
    maker = BRepOffsetAPI_ThruSections(True, True)
    maker.AddWire(polygon([(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)]))
    maker.AddWire(polygon([(3, -2, 8), (12, 3, 8), (7, 12, 8), (-2, 7, 8)]))
    maker.Build()
    return maker.Shape()


def pipe() -> Any:
    spine = wire(edge(interpolate([(0, 0, 0), (0, 0, 10), (6, 4, 18), (16, 4, 20)])))
    ellipse = edge(gp_Elips(place((0, 0, 0)), 3, 2))
    profile = fill(wire(ellipse))
    return first_solid(BRepOffsetAPI_MakePipe(spine, profile).Shape())


def hollow() -> Any:
    return first_solid(
        cut(
            box(ORIGIN, (20, 20, 20)),
            sphere((6, 6, 6), 4),
            torus((13, 13, 13), 4, 1),
        )
    )


def crossed_cylinders() -> Any:
    first = cylinder((0, 0, -10), 5, 20)
    second = cylinder((-10, 0, 0), 3, 20, (1, 0, 0))
    return first_solid(fuse(first, second))


def drilled_sphere() -> Any:
    ball = sphere((0, 0, 0), 8)
    drill = cylinder((2, 1, -10), 2, 20)
    return first_solid(cut(ball, drill))


def cut_torus() -> Any:
    ring = torus((0, 0, 0), 10, 3)
    corner = box((0, 0, -5), (20, 20, 10))
    return first_solid(cut(ring, corner))


def cut_cone() -> Any:
    body = cone(ORIGIN, 8, 0, 16)
    side = box((2, -20, -1), (18, 40, 21))
    return first_solid(cut(body, side))


def cone_and_cylinder() -> Any:
    body = cone(ORIGIN, 8, 3, 14)
    drill = cylinder((-20, 0, 5), 2, 40, (1, 0, 0.2))
    return first_solid(cut(body, drill))


def spline_bowl() -> Any:
    array = Array2_gp_Pnt(1, 6, 1, 6)
    for row in range(6):
        for column in range(6):
            height = 8 + 2 * sin(row) * cos(column)
            array.SetValue(row + 1, column + 1, gp_Pnt(4 * row, 4 * column, height))
    surface = GeomAPI_PointsToBSplineSurface(array).Surface()
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    return extrude(face, (1, 0.5, 6))


def bezier_block() -> Any:
    array = Array2_gp_Pnt(1, 4, 1, 3)
    for row in range(4):
        for column in range(3):
            array.SetValue(
                row + 1, column + 1, gp_Pnt(5 * row, 6 * column, (row - 1.5) ** 2 * (column - 1))
            )
    face = BRepBuilderAPI_MakeFace(Geom_BezierSurface(array), 1e-6).Face()
    return extrude(face, (0, 0, 12))


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
    bore = cylinder((0, 0, -1), 3, 10)
    return first_solid(cut(extrude(fill(polygon(corners)), (0, 0, 5)), bore))


def panel() -> Any:
    """A rounded panel of 314 faces: countersunk holes, dimples and hexagonal pockets."""
    block = box(ORIGIN, (120, 90, 8))
    shape = fillet(block, 2)
    for row in range(8):
        for column in range(12):
            x, y = 10 + 9.1 * column, 10 + 10 * row
            if column % 2 == 0:
                shape = cut(
                    shape,
                    cylinder((x, y, -1), 1.5, 10),
                    cone((x, y, 6.5), 1.5, 3.5, 2),
                )
            elif column % 4 == 1:
                shape = cut(shape, sphere((x, y, 9), 2.5))
            else:
                hexagon = polygon(
                    [(x + 3 * cos(k * pi / 3), y + 3 * sin(k * pi / 3), 5) for k in range(6)]
                )
                shape = cut(shape, extrude(fill(hexagon), (0, 0, 5)))
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
    "box": lambda: box(ORIGIN, (30, 20, 10)),
    "cylinder": lambda: cylinder(ORIGIN, 5, 12),
    "cylinder_part": lambda: BRepPrimAPI_MakeCylinder(5, 12, 4.0).Shape(),
    "cone": lambda: cone(ORIGIN, 6, 0, 9),
    "frustum": lambda: BRepPrimAPI_MakeCone(place((1, 2, 3), (1, 1, 1)), 6, 2, 9, 4.5).Shape(),
    "sphere": lambda: sphere((1, 2, 3), 7),
    "sphere_part": lambda: BRepPrimAPI_MakeSphere(place((0, 0, 0)), 7, -0.5, 1.0, 4.0).Shape(),
    "torus": lambda: BRepPrimAPI_MakeTorus(place((0, 0, 0), (1, 0, 1)), 9, 3).Shape(),
    "torus_part": lambda: BRepPrimAPI_MakeTorus(place((0, 0, 0)), 9, 3, 0.3, 2.0, 3.0).Shape(),
    "wedge": lambda: BRepPrimAPI_MakeWedge(10, 8, 6, 3).Shape(),
    "plate": plate,
    "bolt": bolt,
    "fillets": lambda: first_solid(fillet(box(ORIGIN, (30, 20, 10)), 2)),
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
    "common": lambda: first_solid(common(sphere(ORIGIN, 7), box((-5, -5, -5), (10, 10, 10)))),
    "far_away": lambda: moved(plate(), (1e5, -2e5, 3e4)),
    "mirrored": lambda: moved(bolt(), (3, 4, 5), mirrored=True),
    "tiny": lambda: moved(drilled_sphere(), (0, 0, 0), 1e-3),
    "huge": lambda: moved(cut_torus(), (0, 0, 0), 1e4),
    "half_turn": lambda: BRepPrimAPI_MakeRevol(
        fill(polygon([(0, 0, 0), (6, 0, 0), (6, 0, 4), (0, 0, 8)])),
        gp_Ax1(gp_Pnt(0, 0, 0), UP),
        pi,
    ).Shape(),
}
"""For each name, a function that makes the shape."""
