"""Open CASCADE's mesher, in a Python of its own, without the service.

The program reads names of .npz files, one in each line. For each it writes the file
`<name>.out.npz`, and then prints the name. An input file has the number `deflection`. The names of
the arrays of face k begin with `k `: `net` (n, m, 3); for a rational face `weights`; for a B-spline
`degree`, the distinct knots `knots_u`, `knots_v` and their multiplicities `times_u`, `times_v`. An
output file has `corners` (T, 3, 3), `seconds`, the CPU time of the mesher alone, and `peak`, the
bytes by which the memory of the process grew.
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
"""The angular deflection in radians."""

DEGENERATE = 1e-7
"""The tolerance within which Open CASCADE treats a side as a pole: its usual precision."""


def to_grid(values: Any, kind: Any) -> Any:
    """Open CASCADE's two-dimensional array of points or weights, whose indices begin at 1."""
    rows, columns = values.shape[:2]
    array = kind(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            value = values[i, j].tolist()
            array.SetValue(i + 1, j + 1, gp_Pnt(*value) if isinstance(value, list) else value)
    return array


def to_numbers(values: Any, kind: Any) -> Any:
    """Open CASCADE's array of numbers, whose indices begin at 1."""
    array = kind(1, len(values))
    for k, value in enumerate(values.tolist()):
        array.SetValue(k + 1, value)
    return array


def build_surface(fields: Any) -> Any:
    """A Bézier surface, or a B-spline surface if the face has knots."""
    grids = [to_grid(fields["net"], Array2_gp_Pnt)]
    if "weights" in fields:
        grids.append(to_grid(fields["weights"], Array2_double))
    if "degree" not in fields:
        return Geom_BezierSurface(*grids)
    p, q = fields["degree"].tolist()
    knots = [to_numbers(fields[f"knots_{axis}"], Array1_double) for axis in "uv"]
    times = [to_numbers(fields[f"times_{axis}"].astype(int), Array1_int) for axis in "uv"]
    return Geom_BSplineSurface(*grids, *knots, *times, p, q)


def read_bytes(field: str) -> int:
    """The bytes of a field of /proc/self/status, which is in KiB there."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(field))


def read_corners(face: Any) -> Any:
    """Corners of the triangles of a meshed face, (T, 3, 3)."""
    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    nodes = [mesh.Node(k) for k in range(1, mesh.NbNodes() + 1)]
    table = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
    rows = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)])
    return table[rows.reshape(-1, 3) - 1]


def main() -> None:
    """Meshes the faces of each file whose name is read, until the input ends."""
    for line in sys.stdin:
        name = line.rstrip("\n")
        fields: dict[str, dict[str, Any]] = {}
        for key, value in np.load(name).items():
            face, _, field = key.rpartition(" ")
            fields.setdefault(face, {})[field] = value
        deflection = float(fields.pop("")["deflection"])
        surfaces = map(build_surface, fields.values())
        faces = [BRepBuilderAPI_MakeFace(surface, DEGENERATE).Face() for surface in surfaces]
        compound, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(compound)
        for face in faces:
            builder.Add(compound, face)
        # Resets the peak VmHWM to the present memory: proc_pid_clear_refs(5).
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        bytes_before, start = read_bytes("VmRSS"), time.process_time()
        # Not relative to the sizes of edges, and on one thread.
        BRepMesh_IncrementalMesh(compound, deflection, False, ANGLE, False)
        seconds, peak = time.process_time() - start, read_bytes("VmHWM") - bytes_before
        corners = np.concatenate([read_corners(face) for face in faces])
        np.savez(f"{name}.out.npz", corners=corners, seconds=seconds, peak=peak)
        print(name, flush=True)


if __name__ == "__main__":
    main()
