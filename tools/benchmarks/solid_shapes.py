"""Steps from which `tools.benchmarks.solid_models` makes solids with Open CASCADE."""

from collections.abc import Callable, Sequence
from math import cos, hypot, pi, sin
from typing import Any, TypeAlias

from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepLib import BRepLib
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.collections import HArray1_gp_Pnt, IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
from OCP.Geom import Geom_CylindricalSurface
from OCP.Geom2d import Geom2d_Line
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

Point: TypeAlias = Sequence[float]

UP = gp_Dir(0, 0, 1)


def place(origin: Point, direction: Point = (0, 0, 1)) -> Any:
    return gp_Ax2(gp_Pnt(*origin), gp_Dir(*direction))


def cylinder(origin: Point, radius: float, height: float, direction: Point = (0, 0, 1)) -> Any:
    return BRepPrimAPI_MakeCylinder(place(origin, direction), radius, height).Shape()


def cone(
    origin: Point, low: float, high: float, height: float, direction: Point = (0, 0, 1)
) -> Any:
    return BRepPrimAPI_MakeCone(place(origin, direction), low, high, height).Shape()


def box(origin: Point, sizes: Point) -> Any:
    return BRepPrimAPI_MakeBox(gp_Pnt(*origin), *sizes).Shape()


def sphere(middle: Point, radius: float) -> Any:
    return BRepPrimAPI_MakeSphere(gp_Pnt(*middle), radius).Shape()


def torus(middle: Point, large: float, small: float) -> Any:
    return BRepPrimAPI_MakeTorus(place(middle), large, small).Shape()


def fuse(shape: Any, *others: Any) -> Any:
    for other in others:
        shape = BRepAlgoAPI_Fuse(shape, other).Shape()
    return shape


def cut(shape: Any, *others: Any) -> Any:
    for other in others:
        shape = BRepAlgoAPI_Cut(shape, other).Shape()
    return shape


def common(shape: Any, *others: Any) -> Any:
    for other in others:
        shape = BRepAlgoAPI_Common(shape, other).Shape()
    return shape


def list_edges(shape: Any) -> list[Any]:
    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, TopAbs_EDGE, found)
    return [TopoDS.Edge(found.FindKey(k + 1)) for k in range(found.Extent())]


def fillet(shape: Any, radius: float, selects: Callable[[Any], bool] = lambda _: True) -> Any:
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in filter(selects, list_edges(shape)):
        maker.Add(radius, edge)
    return maker.Shape()


def interpolate(points: Sequence[Point]) -> Any:
    """A cubic spline through points."""
    array = HArray1_gp_Pnt(1, len(points))
    for number, point in enumerate(points, 1):
        array.SetValue(number, gp_Pnt(*point))
    maker = GeomAPI_Interpolate(array, False, 1e-7)
    maker.Perform()
    return maker.Curve()


def edge(*arguments: Any) -> Any:
    """An edge on a curve, or the line between two points."""
    made = [gp_Pnt(*each) if isinstance(each, tuple) else each for each in arguments]
    return BRepBuilderAPI_MakeEdge(*made).Edge()


def wire(*edges: Any) -> Any:
    maker = BRepBuilderAPI_MakeWire()
    for each in edges:
        maker.Add(each)
    return maker.Wire()


def polygon(points: Sequence[Point]) -> Any:
    maker = BRepBuilderAPI_MakePolygon()
    for point in points:
        maker.Add(gp_Pnt(*point))
    maker.Close()
    return maker.Wire()


def hexagon(radius: float) -> Any:
    """A face at z = 0."""
    corners = [(radius * cos(k * pi / 3), radius * sin(k * pi / 3), 0.0) for k in range(6)]
    return fill(polygon(corners))


def fill(outline: Any) -> Any:
    """The face inside of a wire, or on a surface."""
    return BRepBuilderAPI_MakeFace(outline).Face()


def extrude(shape: Any, direction: Point) -> Any:
    return BRepPrimAPI_MakePrism(shape, gp_Vec(*direction)).Shape()


def revolve(shape: Any) -> Any:
    return BRepPrimAPI_MakeRevol(shape, gp_Ax1(gp_Pnt(0, 0, 0), UP)).Shape()


def loft(sections: Sequence[Sequence[Point]]) -> Any:
    """The smooth solid through polygons."""
    maker = BRepOffsetAPI_ThruSections(True, False)
    for points in sections:
        maker.AddWire(polygon(points))
    maker.Build()
    return maker.Shape()


def helix(radius: float, pitch: float, turns: float) -> Any:
    """A wire around z."""
    surface = Geom_CylindricalSurface(gp_Ax3(gp_Pnt(0, 0, 0), UP), radius)
    line = Geom2d_Line(gp_Pnt2d(0, 0), gp_Dir2d(2 * pi, pitch))
    made = BRepBuilderAPI_MakeEdge(line, surface, 0.0, hypot(2 * pi, pitch) * turns).Edge()
    BRepLib.BuildCurve3d_s(made)
    return wire(made)
