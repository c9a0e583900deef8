"""Open CASCADE's mesher for the solids of `solid_models`, in a Python of its own.

The program reads lines `name deflection`. For each it meshes the solid on one thread, where only
the deviation counts, and prints the triangles and the seconds of CPU time of the mesher alone.
"""

import sys
import time

from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from tools.benchmarks.solid_models import MODELS

ANGLE = 10.0
"""The angular deflection in radians: so large that it has no effect."""


def main() -> None:
    """Meshes the solids whose names are read, until the input ends."""
    shapes = {name: make() for name, make in MODELS.items()}
    print("ready", flush=True)
    for line in sys.stdin:
        name, deflection = line.split()
        shape = shapes[name]
        BRepTools.Clean_s(shape)
        start = time.process_time()
        BRepMesh_IncrementalMesh(shape, float(deflection), False, ANGLE, False)
        seconds = time.process_time() - start
        triangles, faces = 0, TopExp_Explorer(shape, TopAbs_FACE)
        while faces.More():
            mesh = BRep_Tool.Triangulation_s(TopoDS.Face(faces.Current()), TopLoc_Location())
            triangles += mesh.NbTriangles()
            faces.Next()
        print(triangles, seconds, flush=True)


if __name__ == "__main__":
    main()
