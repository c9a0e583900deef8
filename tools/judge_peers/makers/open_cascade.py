"""Open CASCADE: `BRepMesh_IncrementalMesh` with a linear deflection.

The linear deflection is a target for chords: the distance of a triangle's middle, and of the
middles of its sides, from the surface. The angular deflection has its default, 0.5 rad.
"""

from importlib.metadata import version
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from tools.judge_peers.makers.protocol import Fields, Mesher, serve

ANGLE = 0.5
"""The angular deflection in radians: the default of the constructor."""


def load(request: Fields) -> Mesher:
    """Reads the STEP file."""
    reader = STEPControl_Reader()
    if reader.ReadFile(request["file"]) != IFSelect_RetDone:
        raise ValueError("the file is not read")
    reader.TransferRoots()
    shape = reader.OneShape()

    def mesh() -> tuple[Any, Any]:
        # Not relative to the sizes of edges, and on one thread.
        BRepMesh_IncrementalMesh(shape, request["tolerance"], False, ANGLE, False)
        return _collect(shape)

    return mesh


def _collect(shape: Any) -> tuple[Any, Any]:
    """The triangles of all faces; each face has vertices of its own."""
    vertices: list[Any] = []
    faces: list[Any] = []
    count = missing = 0
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face(explorer.Current())
        place = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face, place)
        explorer.Next()
        if mesh is None:
            missing += 1
            continue
        placement = place.Transformation()
        nodes = [mesh.Node(k).Transformed(placement) for k in range(1, mesh.NbNodes() + 1)]
        rows = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)])
        rows = rows.reshape(-1, 3) - 1 + count
        vertices += [(p.X(), p.Y(), p.Z()) for p in nodes]
        faces.append(rows[:, ::-1] if face.Orientation() == TopAbs_REVERSED else rows)
        count += len(nodes)
    if missing:
        raise ValueError(f"{missing} faces without triangles")
    return np.array(vertices), np.concatenate(faces)


if __name__ == "__main__":
    serve(f"cadquery-ocp {version('cadquery-ocp')}", load)
