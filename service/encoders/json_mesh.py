"""The mesh as one JSON object, for scripts and for people.

`vertices` are positions. They, the `uvs` and the `attributes`, which are named rows of numbers, are
float64 in the fewest digits that read back as the same number; `normals` and `colors` are float32.
A key whose value the mesh does not have is omitted. `faces` holds, part by part, the quads of that
part and then its triangles.

Welded positions are written once, so that a closed surface is closed by its indices. Row k of
`normals` and of every other list belongs to row k of `vertices`, unless some position has several
normals or the like (at creases, at the apex of a cone, along seams of uvs). Then these lists have
separate rows, and `attribute_faces`, of the same shape as `faces`, names the row for each corner of
each face.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import IndexArray
from service.encoders.content import (
    REPORT_PART,
    absolute,
    find_nonempty,
    find_shared_positions,
    keep_with_faces,
    rename_vertices,
    report_object,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import (
    FLOAT32_CHARS,
    FLOAT64_CHARS,
    LONGEST_ESCAPE,
    digits,
    json_document,
)
from service.engine.mesh.mesh_value import Mesh


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The JSON document, UTF-8."""
    positions, row = find_shared_positions(mesh)
    document: dict[str, object] = {
        "vertices": positions,
        "faces": _faces(mesh, row),
    }
    columns = (
        ("normals", mesh.normals, np.float32),
        ("uvs", mesh.uvs, np.float64),
        ("colors", mesh.colors, np.float32),
    )
    rows = {
        name: values.astype(dtype, copy=False)
        for name, values, dtype in columns
        if values is not None
    }
    document |= rows
    if mesh.attributes:
        document["attributes"] = dict(mesh.attributes)
    if mesh.welds is not None and (rows or mesh.attributes):
        document["attribute_faces"] = _faces(mesh, None)
    document["parts"] = list(_parts(mesh))
    if overlays := find_nonempty(mesh.overlays):
        document["lines"] = [
            {
                "name": overlay.name,
                "vertices": absolute(overlay.positions, mesh),
                "segments": overlay.segments,
            }
            for overlay in overlays
        ]
    document["report"] = report_object(mesh.report, mesh.parts)
    return json_document(document)


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Most bytes, with normals, uvs, both lists of faces and all digits."""
    dimensions = [dimension for _, dimension in size.attributes]
    index = digits(max(size.vertices, size.overlay_points)) + 1
    position = 3 * (FLOAT64_CHARS + 1) + 2
    vertex = position + (3 + size.colors) * (FLOAT32_CHARS + 1) + 2 * (FLOAT64_CHARS + 1) + 7
    vertex += sum(d * (FLOAT64_CHARS + 1) + 2 for d in dimensions)
    named = 100 + 2 * digits(size.triangles + size.quads) + 4 * FLOAT64_CHARS + REPORT_PART
    report = 612 + 13 * FLOAT64_CHARS
    return (
        size.vertices * vertex
        + size.triangles * 2 * (3 * index + 2)
        + size.quads * 2 * (4 * index + 2)
        + size.overlay_points * position
        + size.overlay_segments * (2 * index + 2)
        + size.named * named
        # The report repeats the names of parts.
        + 2 * size.name_bytes * LONGEST_ESCAPE
        + sum(len(name) + 8 for name, _ in size.attributes)
        + report
    )


def _faces(mesh: Mesh, row: IndexArray | None) -> bytes:
    """The JSON list of `_face_list`, cached with the faces."""
    runs = tuple((part.quads, part.triangles) for part in mesh.parts)
    return keep_with_faces(mesh, row, ("JSON", runs), lambda: _face_list(mesh, row))


def _face_list(mesh: Mesh, row: IndexArray | None) -> bytes:
    """JSON list of all faces, part by part; quads come before triangles within a part.

    `row`, shape (V,), maps vertices of the mesh to rows of the list.
    """
    triangles, quads = rename_vertices(mesh.triangles, row), rename_vertices(mesh.quads, row)
    if not len(quads):
        return json_document(triangles)
    runs = (
        json_document(faces[slice(*run)])[1:-1]
        for part in mesh.parts
        for faces, run in ((quads, part.quads), (triangles, part.triangles))
    )
    return b"[" + b",".join(run for run in runs if run) + b"]"


def _parts(mesh: Mesh) -> Iterator[dict[str, object]]:
    """The name of each part, its run of `faces`, [first, last), and its base colour, if present."""
    first = 0
    for part in mesh.parts:
        last = first + part.quads[1] - part.quads[0] + part.triangles[1] - part.triangles[0]
        color = {} if part.color is None else {"color": part.color}
        yield {"name": part.name, "faces": [first, last], **color}
        first = last
