"""Meshes as arrays, from the format NPZ (`docs/formats.md`)."""

import json
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Self, TypeAlias, Unpack

import numpy as np
from numpy.typing import NDArray

from service.client.answers import MeshReport
from service.client.fields import ViewFields
from service.client.npz import read_arrays
from service.client.picture import Picture
from service.client.records import Floats

if TYPE_CHECKING:
    import trimesh

Singles: TypeAlias = NDArray[np.float32]
Indices: TypeAlias = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class MeshPart:
    """A named part of the surface: the rows [first, last) of the faces, and its base colour."""

    name: str
    faces: tuple[int, int]
    color: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Lines beside the faces: points (K, 3), and pairs of their rows (L, 2)."""

    name: str
    vertices: Floats
    segments: Indices


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Vertices and faces.

    Attributes
    ----------
    vertices : ndarray of float64, shape (V, 3)
    faces : ndarray of uint32, shape (F, 3), or (F, 4) with quads
        Counter-clockwise seen from the tip of the normal. Among quads, a triangle repeats its last
        corner.
    normals : ndarray of float32, shape (V, 3), or None
        Unit normals of the surface.
    uvs, colors : ndarray, or None
        Texture coordinates, float64 (V, 2); sRGB, float32 (V, 3) or with opacity (V, 4).
    attributes : dict of ndarray, shape (V, d)
    welds : ndarray of uint32, shape (V,), or None
        The first vertex at the same position, because normals at a crease need several vertices at
        one position; None if all positions differ. `welded_faces` share their edges.
    parts : tuple of MeshPart
    lines : tuple of Lines
    report : MeshReport
    """

    vertices: Floats
    faces: Indices
    normals: Singles | None
    uvs: Floats | None
    colors: Singles | None
    attributes: dict[str, Floats]
    welds: Indices | None
    parts: tuple[MeshPart, ...]
    lines: tuple[Lines, ...]
    report: MeshReport
    content: bytes
    """The file, as the service wrote it: `numpy.load` reads it again."""

    @classmethod
    def read(cls, content: bytes) -> Self:
        """The mesh in a file of the format NPZ."""
        arrays = read_arrays(content)
        texts = {
            name: json.loads(arrays.pop(name).tobytes())
            for name in ("parts", "lines", "report")
            if name in arrays
        }
        attributes = {name.partition("/")[2]: rows for name, rows in arrays.items() if "/" in name}
        line_arrays = (arrays.get(f"line_{name}") for name in ("vertices", "segments"))
        return cls(
            vertices=arrays["vertices"],
            faces=arrays["faces"],
            normals=arrays.get("normals"),
            uvs=arrays.get("uvs"),
            colors=arrays.get("colors"),
            attributes=attributes,
            welds=arrays.get("welds"),
            parts=tuple(map(_read_part, texts["parts"])),
            lines=_read_lines(texts.get("lines", []), *line_arrays),
            report=MeshReport(texts["report"]),
            content=content,
        )

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"

    @cached_property
    def welded_faces(self) -> Indices:
        """The faces with one vertex at each position, so that a closed mesh has no open edge."""
        return self.faces if self.welds is None else self.welds[self.faces]

    def draw(self, *, up: Literal["y", "z"] = "z", **view: Unpack[ViewFields]) -> Picture:
        """A picture of these faces and lines, drawn in this process.

        `Client.image` asks the service for a picture of the surface. A mesh does not know which of
        its axes is vertical, so `up` has to be given if it is not z.

        Raises
        ------
        ImportError
            Pillow is missing: `pip install surface-service` installs it.
        """
        from service.client.drawing import Faces, draw_faces  # noqa: PLC0415

        faces = Faces(
            self.vertices,
            self.faces,
            self.normals,
            self.colors,
            [(part.faces, part.color) for part in self.parts],
            [(line.name, line.vertices, line.segments) for line in self.lines],
        )
        return Picture(draw_faces(faces, up, view))

    def _repr_png_(self) -> bytes | None:
        """The picture, for IPython; None if it cannot be drawn here."""
        try:
            return self.draw(width=480, height=360)
        except ImportError:
            return None

    def to_trimesh(self) -> "trimesh.Trimesh":
        """The mesh for trimesh, with its vertices merged and its colours.

        Normals of vertices are kept if every position has one; quads become two triangles.
        """
        import trimesh  # noqa: PLC0415  (it takes longer than all else that the client imports)

        used, faces = np.unique(_divide_quads(self.welded_faces), return_inverse=True)
        normals = self.normals if self.welds is None else None
        return trimesh.Trimesh(
            self.vertices[used],
            faces.reshape(-1, 3),
            vertex_normals=None if normals is None else normals[used],
            vertex_colors=None if self.colors is None else self.colors[used],
            process=False,
        )


def _read_part(part: dict[str, Any]) -> MeshPart:
    color = part.get("color")
    return MeshPart(part["name"], tuple(part["faces"]), None if color is None else tuple(color))


def _read_lines(lines: list[dict[str, Any]], vertices: Any, segments: Any) -> tuple[Lines, ...]:
    """The lines of each overlay, with the points that its segments use."""
    result = []
    for line in lines:
        used, rows = np.unique(segments[slice(*line["segments"])], return_inverse=True)
        result.append(Lines(line["name"], vertices[used], rows.reshape(-1, 2).astype(np.uint32)))
    return tuple(result)


def _divide_quads(faces: Indices) -> Indices:
    """The faces as triangles: a quad becomes two, and a triangle among quads stays one."""
    if faces.shape[1] == 3:
        return faces
    second = faces[:, [0, 2, 3]]
    return np.concatenate([faces[:, :3], second[second[:, 1] != second[:, 2]]])
