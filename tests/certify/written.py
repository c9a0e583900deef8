"""Meshes as they were written: the bytes of a file, read back."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tests.encoders.gltf.reader import Gltf, read_glb

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Written:
    """Vertices (V, 3), faces (T, 3), the report, and what else there is.

    Places (T, 3, 2) are the parameters at the corners of the faces, `parts` the runs of faces by
    name, `part_bounds` what is promised of them.
    """

    vertices: Array
    faces: Rows
    report: Mapping[str, Any]
    places: Array | None = None
    parts: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    part_bounds: Mapping[str, float] = field(default_factory=dict)

    @property
    def corners(self) -> Array:
        """Corners of the faces, (T, 3, 3)."""
        return self.vertices[self.faces]


def read(name: str, content: bytes, diagonal: int = 0) -> Written:
    """A file of this format; quads are split along one of their two diagonals."""
    return _glb(content) if name == "glb" else _json(content, diagonal)


def _json(content: bytes, diagonal: int) -> Written:
    document = json.loads(content)
    faces = _triangles(document["faces"], diagonal)
    places = None
    if "uvs" in document:
        rows = _triangles(document.get("attribute_faces", document["faces"]), diagonal)
        places = np.array(document["uvs"], dtype=float)[rows]
    parts = {part["name"]: (part["faces"][0], part["faces"][1]) for part in document["parts"]}
    stated = document["report"].get("parts", [])
    bounds = {part["name"]: part["deviation_bound"] for part in stated}
    vertices = np.array(document["vertices"], dtype=float).reshape(-1, 3)
    return Written(vertices, faces, document["report"], places, parts, bounds)


def _triangles(faces: list[list[int]], diagonal: int) -> Rows:
    """Polygons of three or four corners as triangles."""
    found: list[list[int]] = []
    for face in faces:
        turned = face[diagonal:] + face[:diagonal]
        found += [face] if len(face) == 3 else [turned[:3], [turned[0], *turned[2:]]]
    return np.array(found, dtype=np.int64).reshape(-1, 3)


def _glb(content: bytes) -> Written:
    """All meshes where their nodes place them, in float64: nodes that move and do not turn."""
    gltf = read_glb(content)
    points: list[Array] = [np.empty((0, 3))]
    faces: list[Rows] = [np.empty((0, 3), dtype=np.int64)]
    (root,) = gltf.document["scenes"][0]["nodes"]
    waiting = [(root, np.zeros(3))]
    while waiting:
        number, shift = waiting.pop()
        node = gltf.document["nodes"][number]
        assert not {"rotation", "scale", "matrix"} & set(node)
        shift = shift + np.array(node.get("translation", [0.0, 0.0, 0.0]))
        waiting += [(child, shift) for child in node.get("children", [])]
        if "mesh" in node:
            for rows, places in _primitives(gltf, node["mesh"]):
                faces.append(rows + sum(map(len, points)))
                points.append(places.astype(np.float64) + shift)
    report = gltf.document["asset"]["extras"]["report"]
    return Written(np.concatenate(points), np.concatenate(faces), report)


def _primitives(gltf: Gltf, mesh: int) -> list[tuple[Rows, NDArray[np.float32]]]:
    """Triangles of a mesh: indices and positions."""
    return [
        (
            gltf.array(primitive["indices"]).astype(np.int64).reshape(-1, 3),
            gltf.array(primitive["attributes"]["POSITION"]),
        )
        for primitive in gltf.document["meshes"][mesh]["primitives"]
        if primitive.get("mode", 4) == 4
    ]
