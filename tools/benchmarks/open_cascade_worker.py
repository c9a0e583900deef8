"""Open CASCADE's mesher, in a Python of its own: knows nothing of the service.

Reads names of .npz files, one a line, and answers each with a line once the file `<name>.out.npz`
is written. A file holds `deflection`, and of face k, the names all beginning with `k `, `net`
(n, m, 3), maybe `weights`, and for a B-spline `degree`, and the distinct knots and their
multiplicities, `knots_u`, `times_u`, `knots_v`, `times_v`. The answer holds `corners` (T, 3, 3),
`seconds`, the CPU time of the mesher alone, and `peak`, the bytes that it took beyond what the
process had before.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import Array1_double, Array1_int, Array2_double, Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound

ANGLE = 0.5


def grid(values: Any, kind: Any) -> Any:
    """Its array of points or of weights, counted from 1."""
    rows, columns = values.shape[:2]
    array = kind(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            value = values[i, j].tolist()
            array.SetValue(i + 1, j + 1, gp_Pnt(*value) if isinstance(value, list) else value)
    return array


def numbers(values: Any, kind: Any) -> Any:
    """Its array of numbers, counted from 1."""
    array = kind(1, len(values))
    for k, value in enumerate(values.tolist()):
        array.SetValue(k + 1, value)
    return array


def surface_of(stated: Any) -> Any:
    """A Bézier surface, or a B-spline surface where there are knots."""
    grids = [grid(stated["net"], Array2_gp_Pnt)]
    if "weights" in stated:
        grids.append(grid(stated["weights"], Array2_double))
    if "degree" not in stated:
        return Geom_BezierSurface(*grids)
    p, q = stated["degree"].tolist()
    knots = [numbers(stated[f"knots_{axis}"], Array1_double) for axis in "uv"]
    times = [numbers(stated[f"times_{axis}"].astype(int), Array1_int) for axis in "uv"]
    return Geom_BSplineSurface(*grids, *knots, *times, p, q)


def bytes_of(field: str) -> int:
    """A size of this process."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(field))


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
        stated: dict[str, dict[str, Any]] = {}
        for key, value in np.load(name).items():
            face, _, field = key.rpartition(" ")
            stated.setdefault(face, {})[field] = value
        deflection = float(stated.pop("")["deflection"])
        surfaces = map(surface_of, stated.values())
        faces = [BRepBuilderAPI_MakeFace(surface, 1e-7).Face() for surface in surfaces]
        whole, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(whole)
        for face in faces:
            builder.Add(whole, face)
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        before, start = bytes_of("VmRSS"), time.process_time()
        BRepMesh_IncrementalMesh(whole, deflection, False, ANGLE, False)
        seconds, peak = time.process_time() - start, bytes_of("VmHWM") - before
        corners = np.concatenate([corners_of(face) for face in faces])
        np.savez(f"{name}.out.npz", corners=corners, seconds=seconds, peak=peak)
        print(name, flush=True)


if __name__ == "__main__":
    main()
