"""The ways to say which mesh is judged: arrays, a mesh of this client or of trimesh, or a file."""

import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol, TypeAlias

import numpy as np

from service.client.fields import Numbers
from service.client.mesh import Mesh


class MeshLike(Protocol):
    """An object with vertices (V, 3) and faces (F, 3), such as a mesh of trimesh."""

    @property
    def vertices(self) -> Any:
        """Positions."""

    @property
    def faces(self) -> Any:
        """Rows of `vertices`."""


GivenMesh: TypeAlias = Mesh | MeshLike | Path | tuple[Numbers, Numbers] | Mapping[str, Any]
"""A mesh of a client; an object with vertices and faces; a file; vertices and faces; or the object
that a request has, in which arrays may stand for lists, and bytes for a file."""

MEDIA_TYPES: Mapping[str, str] = MappingProxyType(
    {
        "glb": "model/gltf-binary",
        "gltf": "model/gltf+json",
        "obj": "model/obj",
        "ply": "model/x-ply",
        "stl": "model/stl",
        "off": "model/x-off",
    }
)
"""The media types of files with meshes, by the name of the format, which is the usual suffix."""

MAX_LISTS = 1 << 15
"""The most vertices and faces that are sent as lists. More are sent as a file, in double precision,
which takes a third of the bytes and is not read number by number."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshFile:
    """A file with a mesh: its bytes, and the name of its format."""

    content: bytes
    format: str

    def to_document(self) -> dict[str, Any]:
        """The file as a field of a request."""
        return {"file": b64encode(self.content).decode(), "format": self.format}


def read_mesh(mesh: GivenMesh) -> MeshFile | dict[str, Any]:
    """A file, or the vertices and faces as a request has them, with arrays.

    Raises
    ------
    ValueError
        The format of a file is not known.
    """
    if isinstance(mesh, Path):
        return _read_path(mesh)
    if isinstance(mesh, Mapping):
        if isinstance(mesh.get("file"), bytes):
            return MeshFile(mesh["file"], _check_format(mesh.get("format"), "the format"))
        return dict(mesh)
    if isinstance(mesh, tuple):
        vertices, faces = mesh
        return {"vertices": vertices, "faces": faces}
    if isinstance(mesh, Mesh):
        normals = {} if mesh.normals is None else {"normals": np.asarray(mesh.normals, np.float64)}
        return {"vertices": mesh.vertices, "faces": _list_quads(mesh.faces), **normals}
    return {"vertices": np.asarray(mesh.vertices), "faces": np.asarray(mesh.faces)}


def write_file(mesh: Mapping[str, Any]) -> MeshFile | None:
    """Vertices and triangles as a PLY file in double precision; None if they are none, or wrong.

    The service says what is wrong with them.
    """
    try:
        columns = [np.asarray(mesh[key], "<f8") for key in ("vertices", "normals") if key in mesh]
        faces = np.asarray(mesh["faces"])
        rows = np.concatenate(columns, axis=1)
    except (LookupError, TypeError, ValueError):
        return None
    if (
        mesh.keys() - {"vertices", "normals", "faces"}
        or any(column.shape[1] != 3 for column in columns)
        or faces.dtype.kind not in "iu"
        or faces.shape[1:] != (3,)
        or not faces.size
        or not 0 <= faces.min() <= faces.max() < len(rows)
    ):
        return None
    names = ["x", "y", "z", "nx", "ny", "nz"][: rows.shape[1]]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(rows)}",
        *(f"property double {name}" for name in names),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    table = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    table["count"], table["corners"] = 3, faces
    return MeshFile("\n".join(header).encode() + rows.tobytes() + table.tobytes(), "ply")


def is_large(mesh: Mapping[str, Any]) -> bool:
    """Whether a mesh has more rows than are sent as lists."""
    return sum(len(mesh.get(name, ())) for name in ("vertices", "faces")) > MAX_LISTS


def _read_path(path: Path) -> MeshFile | dict[str, Any]:
    suffix = path.suffix.removeprefix(".").lower()
    if suffix == "json":
        document: dict[str, Any] = json.loads(path.read_bytes())
        return document
    name = _check_format(suffix, f"the suffix of {path}")
    return MeshFile(path.read_bytes(), name)


def _check_format(name: Any, noun: str) -> str:
    if name not in MEDIA_TYPES:
        raise ValueError(f"{noun} is not known; needed one of {', '.join(MEDIA_TYPES)}")
    return str(name)


def _list_quads(faces: Any) -> Any:
    """Faces as a request has them: among quads, a triangle has three corners."""
    if faces.shape[1] == 3:
        return faces
    return [row[:3] if row[2] == row[3] else row for row in faces.tolist()]
