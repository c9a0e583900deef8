"""Wavefront OBJ: positions, normals, faces, groups and lines.

The service does not use trimesh, because trimesh writes only triangles, without quads, lines and
groups. OBJ indexes positions and normals separately. So vertices that differ only in their normal
share a position: the surface stays closed, and its creases stay sharp. Indices start at 1. A colour
follows the position, `v x y z r g b`, in sRGB from 0 to 1. The original description of the format
has no colours, but Blender, MeshLab and trimesh read them. OBJ cannot store opacity. A comment
contains the deviation bound.
"""

import numpy as np

from service.bases.arrays import IndexArray
from service.encoders.content import (
    COMMENT_CHARS,
    absolute,
    bound_comment,
    find_colored_positions,
    find_nonempty,
    keep_with_faces,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import (
    FLOAT32_CHARS,
    FLOAT64_CHARS,
    digits,
    join_rows,
    row_chunks,
    rows,
)
from service.engine.mesh.mesh import Mesh


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The OBJ file, UTF-8: one object, a group for each part, an object for each overlay."""
    # Vertex k of the mesh has the position row[k] of the file.
    positions, colors, row = find_colored_positions(mesh)
    comment = bound_comment(mesh.report)
    head = f"# {comment}\n" if comment else ""
    chunks = [
        head.encode() + b"o " + identifier(mesh.name) + b"\n",
        # Lines `v x y z`, or `v x y z r g b` with colours.
        rows(positions, b"v ")
        if colors is None
        else join_rows(positions, colors[:, :3].astype(np.float32, copy=False), start=b"v "),
    ]
    if mesh.uvs is not None:
        chunks.append(rows(mesh.uvs.astype(np.float32, copy=False), b"vt "))
    if mesh.normals is not None:
        chunks.append(rows(mesh.normals.astype(np.float32, copy=False), b"vn "))
    groups = tuple((identifier(part.name), part.quads, part.triangles) for part in mesh.parts)
    has_values = mesh.uvs is not None, mesh.normals is not None
    # The text of the faces is cached: many meshes have the same faces.
    key = ("OBJ", groups, has_values)
    chunks.append(keep_with_faces(mesh, row, key, lambda: _groups(mesh, row)))
    first = len(positions) + 1
    for overlay in find_nonempty(mesh.overlays):
        chunks += (
            b"o " + identifier(overlay.name) + b"\n",
            rows(absolute(overlay.positions, mesh), b"v "),
            rows(overlay.segments.astype(np.int64) + first, b"l "),
        )
        first += len(overlay.positions)
    return b"".join(chunks)


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The most bytes of the file, with normals and parameters."""
    color = 3 * (FLOAT32_CHARS + 1) if size.colors else 0
    index = digits(size.vertices + size.overlay_points) + 1
    position = len("v ") + 3 * (FLOAT64_CHARS + 1)
    normal = len("vn ") + 3 * (FLOAT32_CHARS + 1)
    uv = len("vt ") + 2 * (FLOAT32_CHARS + 1)
    return (
        size.vertices * (position + color + normal + uv)
        + size.triangles * (2 + 3 * 3 * index)
        + size.quads * (2 + 4 * 3 * index)
        + size.overlay_points * position
        + size.overlay_segments * (2 + 2 * index)
        + COMMENT_CHARS
        + (size.drawables + size.faces + 1) * len("o _\n")
        + size.name_bytes
        + size.face_name_bytes
    )


def _groups(mesh: Mesh, row: IndexArray | None) -> bytes:
    """The text of all parts: for each part a line `g name`, and then its faces.

    `row`, shape (V,), has for each vertex the row of its position in the file; None if this is the
    number of the vertex.
    """
    numbers = np.arange(1, len(mesh.positions) + 1, dtype=np.uint32)
    # Every vertex has its own (u, v) and normal: their numbers are the number of the vertex.
    value_numbers = [numbers for values in (mesh.uvs, mesh.normals) if values is not None]
    corners = np.stack([numbers if row is None else row + np.uint32(1), *value_numbers], axis=1)
    separator = b"//" if mesh.uvs is None else b"/"
    lines: list[bytes] = []
    for part in mesh.parts:
        lines.append(b"g " + identifier(part.name) + b"\n")
        for faces in (mesh.quads[slice(*part.quads)], mesh.triangles[slice(*part.triangles)]):
            lines += (_faces(corners[faces[chunk]], separator) for chunk in row_chunks(faces))
    return b"".join(lines)


def _faces(corners: IndexArray, separator: bytes) -> bytes:
    """Lines such as `f a//n b//n c//n`, from the indices of each corner, shape (F, 3…4, 1…3)."""
    count, _, numbers = corners.shape
    # `rows` writes separators of one character, but a corner without (u, v) is `a//n`.
    text = rows(corners.reshape(count, -1), b"f ", b"/" * (numbers - 1) + b" ")
    return text.replace(b"/", separator)


def identifier(name: str) -> bytes:
    """A name as OBJ can store it, in UTF-8; `_` if no character can be stored.

    Underscores replace white space and control characters, which would end the name.
    """
    words = "".join(c if c.isprintable() else " " for c in name).split()
    return ("_".join(words) or "_").encode()
