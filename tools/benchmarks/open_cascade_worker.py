"""Open CASCADE's mesher, in a Python of its own: knows nothing of the service.

Reads names of .npz files, one a line, and answers each with a line once the file `<name>.out.npz`
is written. A file holds `net` (n, m, 3) and `deflection`, and for a B-spline `degree`, and the
distinct knots and their multiplicities, `knots_u`, `times_u`, `knots_v`, `times_v`. The answer
holds `corners` (T, 3, 3) and `seconds`, the CPU time of the mesher alone.
"""

import sys
import time
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.TopLoc import TopLoc_Location

ANGLE = 0.5


def points_of(net: Any) -> Any:
    """Its array of points, counted from 1."""
    rows, columns, _ = net.shape
    points = Array2_gp_Pnt(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            points.SetValue(i + 1, j + 1, gp_Pnt(*net[i, j].tolist()))
    return points


def numbers(values: Any, kind: Any) -> Any:
    """Its array of numbers, counted from 1."""
    array = kind(1, len(values))
    for k, value in enumerate(values.tolist()):
        array.SetValue(k + 1, value)
    return array


def surface_of(stated: Any) -> Any:
    """A Bézier surface, or a B-spline surface where there are knots."""
    points = points_of(stated["net"])
    if "degree" not in stated:
        return Geom_BezierSurface(points)
    p, q = stated["degree"].tolist()
    knots = [numbers(stated[f"knots_{axis}"], Array1_double) for axis in "uv"]
    times = [numbers(stated[f"times_{axis}"], Array1_int) for axis in "uv"]
    return Geom_BSplineSurface(points, *knots, *times, p, q)


def corners_of(face: Any) -> Any:
    """Corners of the triangles of a meshed face, (T, 3, 3)."""
    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    nodes = [mesh.Node(k) for k in range(1, mesh.NbNodes() + 1)]
    table = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
    rows = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)])
    return table[rows.reshape(-1, 3) - 1]


def main() -> None:
    """Answers until there is nothing more to read."""
    for line in sys.stdin:
        name = line.rstrip("\n")
        stated = np.load(name)
        face = BRepBuilderAPI_MakeFace(surface_of(stated), 1e-7).Face()
        start = time.process_time()
        BRepMesh_IncrementalMesh(face, float(stated["deflection"]), False, ANGLE, False)
        seconds = time.process_time() - start
        np.savez(f"{name}.out.npz", corners=corners_of(face), seconds=seconds)
        print(name, flush=True)


if __name__ == "__main__":
    main()
