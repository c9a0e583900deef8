"""Reads the mesh of a file: JSON, or binary glTF."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.gltf import Gltf, read_glb

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Written:
    """The mesh of a file: vertices (V, 3), faces (T, 3), its report, and further data.

    `places` (T, 3, 2) are the parameters at the corners of the faces. `parts` are the ranges of the
    faces of each part (begin, end), by name, and `part_bounds` the reported bounds of parts; only
    JSON files have both. `steps` (V, 3) are half the distance of neighbouring float32 numbers at
    each coordinate, for GLB files only, whose vertices are rounded to float32.
    """

    vertices: Array
    faces: Rows
    report: Mapping[str, Any]
    places: Array | None = None
    parts: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    part_bounds: Mapping[str, float] = field(default_factory=dict)
    steps: Array | None = None

    @property
    def corners(self) -> Array:
        """Corners of the faces, (T, 3, 3)."""
        return self.vertices[self.faces]


def read_file(name: str, content: bytes, diagonal: int = 0) -> Written:
    """The mesh of a file; `name` is `glb` or `json`.

    Quads of a JSON file are split from corner 0 to 2 (`diagonal` = 0), or from 1 to 3 (1).
    """
    return _read_glb(content) if name == "glb" else _read_json(content, diagonal)


def _read_json(content: bytes, diagonal: int) -> Written:
    """The mesh of a JSON file, with its quads split."""
    document = json.loads(content)
    faces = _split_polygons(document["faces"], diagonal)
    places = None
    if "uvs" in document:
        rows = _split_polygons(document.get("attribute_faces", document["faces"]), diagonal)
        places = np.array(document["uvs"], dtype=float)[rows]
    parts = {part["name"]: (part["faces"][0], part["faces"][1]) for part in document["parts"]}
    part_reports = document["report"].get("parts", [])
    bounds = {
        part["name"]: part["deviation_bound"] for part in part_reports if "deviation_bound" in part
    }
    vertices = np.array(document["vertices"], dtype=float).reshape(-1, 3)
    return Written(vertices, faces, document["report"], places, parts, bounds)


def _split_polygons(faces: list[list[int]], diagonal: int) -> Rows:
    """Triangles (T, 3) of triangles and quads; quads are split from corner `diagonal` on."""
    triangles: list[list[int]] = []
    for face in faces:
        rotated = face[diagonal:] + face[:diagonal]
        triangles += [face] if len(face) == 3 else [rotated[:3], [rotated[0], *rotated[2:]]]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _read_glb(content: bytes) -> Written:
    """All meshes in coordinates of the scene, in float64; nodes may have translations only."""
    gltf = read_glb(content)
    points: list[Array] = [np.empty((0, 3))]
    faces: list[Rows] = [np.empty((0, 3), dtype=np.int64)]
    uvs: list[Array] = []
    steps: list[Array] = [np.empty((0, 3))]
    (root,) = gltf.document["scenes"][0]["nodes"]
    nodes = [(root, np.zeros(3))]
    while nodes:
        number, shift = nodes.pop()
        node = gltf.document["nodes"][number]
        assert not {"rotation", "scale", "matrix"} & set(node)
        shift = shift + np.array(node.get("translation", [0.0, 0.0, 0.0]))
        nodes += [(child, shift) for child in node.get("children", [])]
        for primitive in _list_primitives(gltf, node):
            rows = gltf.array(primitive["indices"]).astype(np.int64).reshape(-1, 3)
            float32_points = gltf.array(primitive["attributes"]["POSITION"])
            faces.append(rows + sum(map(len, points)))
            points.append(float32_points.astype(np.float64) + shift)
            steps.append(np.spacing(np.abs(float32_points)).astype(np.float64) / 2)
            if "TEXCOORD_0" in primitive["attributes"]:
                places = gltf.array(primitive["attributes"]["TEXCOORD_0"])
                uvs.append(places.astype(np.float64)[rows])
    return Written(
        np.concatenate(points),
        np.concatenate(faces),
        gltf.document["asset"]["extras"]["report"],
        np.concatenate(uvs) if uvs else None,
        steps=np.concatenate(steps),
    )


def _list_primitives(gltf: Gltf, node: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The primitives of the mesh of a node that consist of triangles."""
    if "mesh" not in node:
        return []
    primitives = gltf.document["meshes"][node["mesh"]]["primitives"]
    return [primitive for primitive in primitives if primitive.get("mode", 4) == 4]


def list_edges(faces: Rows) -> Rows:
    """The edges (E, 2) of triangles, in the direction of each triangle."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
