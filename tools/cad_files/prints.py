"""Reads 3MF files by lib3mf in its strict mode: JSON lines.

    python -m tools.cad_files.prints FILE …

A line has the warnings, the number of build items, and for each mesh its name, its counts, and
whether it is a manifold. Only a Python in which lib3mf is installed can run this program.
"""

import json
import sys
from typing import Any

import lib3mf


def read(path: str) -> dict[str, Any]:
    """The warnings and the meshes of one file."""
    library = lib3mf.get_wrapper()
    model = library.CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(path)
    meshes = []
    objects = model.GetMeshObjects()
    while objects.MoveNext():
        mesh = objects.GetCurrentMeshObject()
        meshes.append(
            {
                "name": mesh.GetName(),
                "vertices": mesh.GetVertexCount(),
                "triangles": mesh.GetTriangleCount(),
                "is_manifold": bool(mesh.IsManifoldAndOriented()),
                "is_valid": bool(mesh.IsValid()),
            }
        )
    warnings = [str(reader.GetWarning(number)) for number in range(reader.GetWarningCount())]
    return {"warnings": warnings, "items": model.GetBuildItems().Count(), "meshes": meshes}


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(json.dumps({"file": each, **read(each)}), flush=True)
