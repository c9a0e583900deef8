"""Makes the files of the built-in parts from the solids of the tests.

    python -m tools.part_examples

Walls of round holes get a colour, so that a mesh shows where holes are.
"""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from oracles.solids import read_solid
from service.schemas.surfaces import SurfaceDefinition
from service.surface.brep import BrepSurface
from service.surface.examples import parts

FOLDER = Path(parts.__file__).parent / "data"

SOLIDS = {
    "plate": "plate-with-holes",
    "tee": "pipe-tee",
    "gear": "gear",
    "impeller": "impeller",
    "thread": "screw-thread",
    "crossholes": "crossed-holes",
}
"""The solids, and the ids of the examples."""

HOLE_COLOR = [0.85, 0.45, 0.15]


def main() -> None:
    """Write one file for each part."""
    for solid, name in SOLIDS.items():
        document = read_solid(solid)
        for face in document["faces"]:
            if face["name"].startswith("cylindrical") and is_hole(face):
                face["color"] = HOLE_COLOR
            face["name"] = face["name"].replace("ofrevolution", "revolved")
        surface = TypeAdapter(SurfaceDefinition).validate_python(document, context={}).to_surface()
        assert isinstance(surface, BrepSurface)
        np.savez_compressed(FOLDER / f"{name}.npz", **list_columns(surface))


def is_hole(face: dict[str, Any]) -> bool:
    """Whether a face is a whole cylinder whose normal points to its axis."""
    edges = [edge for loop in face["loops"] for edge in loop["edges"]]
    if len(set(edges)) == len(edges):  # no seam: only a part of a cylinder, a fillet
        return False
    net = np.array(face["surface"]["control_net"])
    across = np.cross(net[1, 0] - net[0, 0], net[0, 1] - net[0, 0])
    # One of the directions of the net is a closed circle; its middle is on the axis.
    circle = net[:, 0] if np.allclose(net[0, 0], net[-1, 0]) else net[0]
    inward = np.dot(across, circle[:-1].mean(axis=0) - circle[0]) > 0
    return bool(inward != face.get("reversed", False))


def list_columns(surface: BrepSurface) -> dict[str, Any]:
    """The arrays of a brep by name; those of a table of splines as `table.array`."""
    columns: dict[str, Any] = {"face_names": np.array(surface.face_names)}
    for field in fields(surface):
        value: Any = getattr(surface, field.name, None)
        if field.name in parts.TABLES:
            for column in fields(value):
                columns[f"{field.name}.{column.name}"] = getattr(value, column.name)
        elif isinstance(value, np.ndarray):
            columns[field.name] = value
    return columns


if __name__ == "__main__":
    main()
