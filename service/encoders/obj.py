"""Wavefront OBJ: positions, normals and faces indexed separately, groups, lines.

Written by us: trimesh writes triangles only, and would lose quads, lines and groups. OBJ indexes
positions and normals separately, so vertices that differ in their normal alone share a position:
the surface stays closed, and its creases sharp. Indices start at 1. Colours stand behind the
position, `v x y z r g b`, sRGB from 0 to 1: not in the format's first description, but Blender,
MeshLab and trimesh read them. There is no place for opacity. A comment tells the certified
deviation.
"""

from itertools import chain

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.encoders.content import (
    COMMENT_CHARS,
    absolute,
    bound_comment,
    colored_positions,
    drawn,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import (
    FLOAT32_CHARS,
    FLOAT64_CHARS,
    digits,
    joined_rows,
    json_array,
    row_chunks,
    rows,
)
from service.engine.mesh.mesh import Mesh


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The OBJ file, UTF-8: one object, a group for each part, an object for each overlay."""
    positions, colors, row = colored_positions(mesh)
    own = np.arange(len(row), dtype=np.uint32)
    comment = bound_comment(mesh.report)
    head = f"# {comment}\n" if comment else ""
    chunks = [
        head.encode() + b"o " + identifier(mesh.name) + b"\n",
        _vertices(positions, colors),
    ]
    indices, separator = [row], b"/"
    if mesh.uvs is not None:
        chunks.append(rows(mesh.uvs.astype(np.float32, copy=False), b"vt "))
        indices.append(own)
    if mesh.normals is not None:
        chunks.append(rows(mesh.normals.astype(np.float32, copy=False), b"vn "))
        indices.append(own)
        separator = b"/" if mesh.uvs is not None else b"//"
    corners = np.stack(indices, axis=1) + np.uint32(1)
    chunks += chain.from_iterable(
        (
            b"g " + identifier(part.name) + b"\n",
            _faces(corners, mesh.quads[slice(*part.quads)], separator),
            _faces(corners, mesh.triangles[slice(*part.triangles)], separator),
        )
        for part in mesh.parts
    )
    first = len(positions) + 1
    for overlay in drawn(mesh.overlays):
        chunks += (
            b"o " + identifier(overlay.name) + b"\n",
            rows(absolute(overlay.positions, mesh), b"v "),
            rows(overlay.segments.astype(np.int64) + first, b"l "),
        )
        first += len(overlay.positions)
    return b"".join(chunks)


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Bytes at most: normals and parameters counted."""
    color = 3 * (FLOAT32_CHARS + 1) if size.colors else 0
    index = digits(size.vertices + size.overlay_points) + 1
    position = 2 + 3 * (FLOAT64_CHARS + 1)
    vertex = position + 3 + 3 * (FLOAT32_CHARS + 1) + 3 + 2 * (FLOAT32_CHARS + 1)
    return (
        size.vertices * (vertex + color)
        + size.triangles * (2 + 3 * 3 * index)
        + size.quads * (2 + 4 * 3 * index)
        + size.overlay_points * position
        + size.overlay_segments * (2 + 2 * index)
        + COMMENT_CHARS
        + (size.named + 1) * len("o _\n")
        + size.name_bytes
    )


def _vertices(positions: FloatArray, colors: RealArray | None) -> bytes:
    """Lines `v x y z`, or `v x y z r g b`."""
    if colors is None:
        return rows(positions, b"v ")
    return joined_rows(positions, colors[:, :3].astype(np.float32, copy=False), start=b"v ")


def _faces(corners: IndexArray, faces: IndexArray, separator: bytes) -> bytes:
    """Lines `f a//n b//n c//n`; `corners`, shape (V, 1…3), holds the numbers of each vertex."""
    return b"".join(_lines(corners[faces[chunk]], separator) for chunk in row_chunks(faces))


def _lines(corners: IndexArray, separator: bytes) -> bytes:
    """The lines of few faces, one at least, from the numbers of each corner, (n, 3, k)."""
    inside = json_array(corners)[3:-3]
    lines = inside.replace(b"]],[[", b"\nf ").replace(b"],[", b" ").replace(b",", separator)
    return b"f " + lines + b"\n"


def identifier(name: str) -> bytes:
    """A name without white space and control characters, which would end it; `_` if none."""
    kept = "_".join("".join(c if c.isprintable() else " " for c in name).split())
    return (kept or "_").encode()
