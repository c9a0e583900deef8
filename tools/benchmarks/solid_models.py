"""The solids of `oracles.solids`, made with Open CASCADE.

`make bench-occ` meshes them as Open CASCADE has them, with its own cylinders, cones and spheres.
The JSON documents of `tests/solids` are the same solids after conversion to B-splines, where the
parameter curves kept the parameters of the original surfaces. Many are therefore wrong by up to a
hundredth of the diagonal, as they are in files from elsewhere.
"""

from collections.abc import Callable
from itertools import pairwise
from math import cos, pi, sin
from typing import Any

from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe, BRepOffsetAPI_MakePipeShell
from OCP.collections import Array2_gp_Pnt
from OCP.GeomAbs import GeomAbs_BSplineCurve, GeomAbs_Circle, GeomAbs_OtherCurve
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Pnt, gp_Vec

from tools.benchmarks.solid_shapes import (
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
    helix,
    hexagon,
    interpolate,
    list_edges,
    loft,
    place,
    polygon,
    revolve,
    sphere,
    torus,
    wire,
)

X, Y = (1, 0, 0), (0, 1, 0)


def make_plate() -> Any:
    plate = fillet(box((0, 0, 0), (60, 40, 8)), 3)
    holes = [cylinder((x, y, -1), r, 20) for x, y, r in ((12, 10, 3), (48, 10, 3), (30, 28, 7))]
    return cut(plate, *holes, cone((12, 10, 5), 3, 6, 3))


def make_tee() -> Any:
    def is_intersection(each: Any) -> bool:
        kinds = GeomAbs_BSplineCurve, GeomAbs_OtherCurve
        return bool(BRepAdaptor_Curve(each).GetType() in kinds)

    pipes = fuse(cylinder((0, 0, -30), 10, 60), cylinder((0, 0, 0), 7, 28, X))
    outside = fillet(pipes, 1.5, is_intersection)
    return cut(outside, cylinder((0, 0, -31), 8, 62), cylinder((0, 0, 0), 5.5, 40, X))


def make_torus_cut() -> Any:
    cutters = box((-3, -20, -20), (30, 20, 40)), cylinder((-8, 6, -20), 2.5, 40)
    return cut(torus((0, 0, 0), 10, 4), *cutters)


def make_steinmetz() -> Any:
    cylinders = cylinder((-20, 0, 0), 8, 40, X), cylinder((0, -20, 0), 8, 40, Y)
    return common(cylinder((0, 0, -20), 8, 40), *cylinders)


def make_loft() -> Any:
    first = [(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)]
    second = [(-3, -4, 8), (4, -3, 8), (3, 4, 8), (-4, 3, 8)]
    third = [(-6, -2, 16), (6, -2, 16), (6, 2, 16), (-6, 2, 16)]
    fourth = [(-2, -2, 24), (2, -2, 24), (2, 2, 24), (-2, 2, 24)]
    return loft([first, second, third, fourth])


def make_pipe() -> Any:
    curve = interpolate([(0, 0, 0), (10, 5, 4), (18, -4, 12), (30, 3, 16), (34, 14, 10)])
    start, along = gp_Pnt(), gp_Vec()
    curve.D1(curve.FirstParameter(), start, along)
    circle = gp_Circ(gp_Ax2(start, gp_Dir(along)), 2.0)
    return BRepOffsetAPI_MakePipe(wire(edge(curve)), fill(wire(edge(circle)))).Shape()


def make_spring() -> Any:
    circle = gp_Circ(place((10, 0, 0), (0, 1, 0.1)), 1.5)
    return BRepOffsetAPI_MakePipe(helix(10, 6, 3), fill(wire(edge(circle)))).Shape()


def make_thread() -> Any:
    maker = BRepOffsetAPI_MakePipeShell(helix(5, 3, 4))
    maker.SetMode(True)
    maker.Add(polygon([(4.8, 0, -0.8), (4.8, 0, 0.8), (6.2, 0, 0.0)]))
    maker.Build()
    maker.MakeSolid()
    return fuse(cylinder((0, 0, -4), 5, 24), maker.Shape())


def make_bolt() -> Any:
    def is_lowest(each: Any) -> bool:
        curve = BRepAdaptor_Curve(each)
        height = curve.Value(curve.FirstParameter()).Z()
        return bool(curve.GetType() == GeomAbs_Circle and abs(height + 30) < 1e-6)

    head = common(extrude(hexagon(9), (0, 0, 6)), cone((0, 0, -4), 14, 4, 10.5))
    bolt = fuse(head, cylinder((0, 0, -30), 4, 30))
    maker = BRepFilletAPI_MakeChamfer(bolt)
    for each in filter(is_lowest, list_edges(bolt)):
        maker.Add(0.8, each)
    return maker.Shape()


def make_impeller() -> Any:
    outline = [(3, 0, 12), (4, 0, 9), (7, 0, 5), (13, 0, 2), (20, 0, 0.5)]
    corners = [(20, 0, 0.5), (20, 0, -2), (0, 0, -2), (0, 0, 12), (3, 0, 12)]
    lines = [edge(a, b) for a, b in pairwise(corners)]
    hub = revolve(fill(wire(edge(interpolate(outline)), *lines)))
    blades = [loft(list_blade_sections(2 * pi * k / 6)) for k in range(6)]
    return cut(fuse(hub, *blades), cylinder((0, 0, -5), 1.5, 30))


def list_blade_sections(turn: float) -> list[list[tuple[float, float, float]]]:
    sections = []
    heights = (6.0, 13.0), (3.0, 11.0), (1.0, 9.0), (0.0, 7.0), (-0.5, 6.0)
    for k, (low, high) in enumerate(heights):
        radius, angle = 3.2 + 4 * k, turn + 0.9 * (k / 4) ** 1.5
        corners = ((-0.55, low), (0.55, low), (1.5 + 0.33, high), (1.5 - 0.33, high))
        sections.append(
            [
                (radius * cos(angle) - t * sin(angle), radius * sin(angle) + t * cos(angle), z)
                for t, z in corners
            ]
        )
    return sections


def make_gear() -> Any:
    teeth = [
        (radius * cos(2 * pi * (k + share) / 20), radius * sin(2 * pi * (k + share) / 20), 0.0)
        for k in range(20)
        for share, radius in ((-0.30, 9), (-0.14, 11), (0.14, 11), (0.30, 9))
    ]
    gear = extrude(fill(polygon(teeth)), (0, 0, 4))
    return cut(gear, cylinder((0, 0, -1), 3, 10), box((-0.8, 0, -1), (1.6, 4, 10)))


def make_wavy() -> Any:
    points = Array2_gp_Pnt(1, 9, 1, 9)
    for i in range(9):
        for j in range(9):
            x, y = 5.0 * i, 5.0 * j
            points.SetValue(i + 1, j + 1, gp_Pnt(x, y, 2 * sin(x / 7) * cos(y / 6)))
    surface = GeomAPI_PointsToBSplineSurface(points, 3, 8).Surface()
    solid = extrude(BRepBuilderAPI_MakeFace(surface, 1e-6).Face(), (0, 0, -8))
    slanted = cylinder((28, 25, -20), 6, 40, (0.3, 0.2, 1))
    return cut(solid, cylinder((12, 12, -20), 5, 40), slanted, sphere((28, 8, 2), 6))


def make_tray() -> Any:
    outside = fillet(box((0, 0, 0), (40, 30, 20)), 4)
    return cut(outside, fillet(box((2, 2, 2), (36, 26, 40)), 2))


def make_nut() -> Any:
    low, high = cone((0, 0, -3), 14.5, 4.5, 10.5), cone((0, 0, 10), 14.5, 4.5, 10.5, (0, 0, -1))
    nut = common(extrude(hexagon(9), (0, 0, 7)), common(low, high))
    return cut(nut, cylinder((0, 0, -1), 4.2, 10), cone((0, 0, -0.01), 5.2, 4.0, 1.2))


def make_crossholes() -> Any:
    holes = cylinder((-20, 0, 0), 5, 40, X), cylinder((0, -20, 0), 4, 40, Y)
    block = fillet(box((-15, -15, -15), (30, 30, 30)), 5)
    return cut(block, cylinder((0, 0, -20), 6, 40), *holes)


def make_sliver() -> Any:
    holes = cylinder((10, 10, -1), 4, 20), cylinder((10, 10.01, -1), 3.995, 20)
    return cut(box((0, 0, 0), (20, 20, 10)), *holes, box((13.99, 0, -1), (20, 20, 20)))


def make_ellip() -> Any:
    ellipse = gp_Elips(place((0, 0, 0)), 10, 4)
    prism = extrude(fill(wire(edge(ellipse))), (3, 1, 9))
    return cut(prism, torus((4, 0, 5), 6, 1.5))


def make_revolve() -> Any:
    outline = interpolate([(4, 0, 0), (7, 0, 3), (3, 0, 8), (5, 0, 14), (0, 0, 17)])
    lines = edge((0, 0, 17), (0, 0, 0)), edge((0, 0, 0), (4, 0, 0))
    body = revolve(fill(wire(edge(outline), *lines)))
    return cut(body, cylinder((-10, 0, 4), 1.5, 20, X))


MODELS: dict[str, Callable[[], Any]] = {
    "bolt": make_bolt,
    "box": lambda: box((0, 0, 0), (10, 20, 30)),
    "cone": lambda: cone((0, 0, 0), 6, 0, 10),
    "crossholes": make_crossholes,
    "cylinder": lambda: cylinder((0, 0, 0), 5, 12),
    "ellip": make_ellip,
    "frustum": lambda: cone((0, 0, 0), 6, 2.5, 10),
    "gear": make_gear,
    "impeller": make_impeller,
    "loft": make_loft,
    "nut": make_nut,
    "pipe": make_pipe,
    "plate": make_plate,
    "revolve": make_revolve,
    "sliver": make_sliver,
    "sphere": lambda: sphere((1, 2, 3), 7),
    "sphere_hole": lambda: cut(sphere((0, 0, 0), 10), cylinder((3, 1, -20), 4, 40)),
    "spring": make_spring,
    "steinmetz": make_steinmetz,
    "tee": make_tee,
    "thread": make_thread,
    "torus": lambda: torus((0, 0, 0), 10, 3),
    "torus_cut": make_torus_cut,
    "tray": make_tray,
    # The cylinder touches the sphere from inside: the curve crosses itself.
    "viviani": lambda: common(sphere((0, 0, 0), 10), cylinder((5, 0, -20), 5, 40)),
    "wavy": make_wavy,
}
"""The 26 valid solids by name."""
