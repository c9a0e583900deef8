"""gmsh: its default mesher of surfaces, with sizes from curvature.

gmsh has no tolerance of distances. It takes the number of elements for a full turn of the normal.
"""

from typing import Any

import gmsh
import numpy as np

from tools.judge_peers.makers.protocol import Fields, Mesher, serve


def load(request: Fields) -> Mesher:
    """Reads the STEP file by gmsh's Open CASCADE kernel."""
    gmsh.clear()
    gmsh.model.occ.importShapes(request["file"])
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", request["elements"])

    def mesh() -> tuple[Any, Any]:
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        row = np.zeros(int(tags.max()) + 1, dtype=np.int64)
        row[tags] = np.arange(len(tags))
        _, corners = gmsh.model.mesh.getElementsByType(2)
        return np.array(coordinates).reshape(-1, 3), row[corners].reshape(-1, 3)

    return mesh


if __name__ == "__main__":
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    # The file's unit is a millimetre, and so is that of the mesh: coordinates are kept.
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    serve(f"gmsh {gmsh.__version__}", load)
