"""The mesh as one JSON object, for scripts and for people.

`vertices` are positions, and `attributes` are lists of rows by name. The numbers of `vertices`,
`uvs` and `attributes` are float64, those of `normals` and `colors` float32; all have the fewest
digits that read back as the same number. If the mesh has no values for a key, the key is omitted.
`faces` has, part by part, the quads of the part and then its triangles.

A position where patches are welded is written once, so that the faces of a closed surface share all
their edges. Usually row k of `normals`, and of every other list, belongs to row k of `vertices`.
But if a position has several normals, uvs or the like (at creases, at the apex of a cone, along
seams of uvs), these lists have rows of their own. Then `attribute_faces`, which has the shape of
`faces`, has the row of these lists for each corner of each face.
"""

import numpy as np

from service.bases.arrays import IndexArray
from service.encoders.content import (
    absolute,
    bound_report_chars,
    find_nonempty,
    find_shared_positions,
    keep_with_faces,
    list_parts,
    lists_parts,
    rename_vertices,
    report_object,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import (
    FLOAT32_CHARS,
    FLOAT64_CHARS,
    digits,
    json_document,
)
from service.engine.mesh.mesh import Mesh
from service.engine.points.evaluate import COLUMNS


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
    document["parts"] = list(list_parts(mesh)) if lists_parts(mesh.report, mesh.parts) else []
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
    """The most bytes of the document, with normals, uvs, both lists of faces and all digits."""
    dimensions = [dimension for _, dimension in size.attributes]
    # Each number is followed by a comma or a bracket, and a row has two characters more.
    index = digits(max(size.vertices, size.overlay_points)) + 1
    position = 3 * (FLOAT64_CHARS + 1) + 2
    # Rows of normals, of uvs and of colours need 6 of the 7 characters at the end.
    vertex = position + (3 + size.colors) * (FLOAT32_CHARS + 1) + 2 * (FLOAT64_CHARS + 1) + 7
    vertex += sum(d * (FLOAT64_CHARS + 1) + 2 for d in dimensions)
    return (
        size.vertices * vertex
        + size.triangles * 2 * (3 * index + 2)
        + size.quads * 2 * (4 * index + 2)
        + size.overlay_points * position
        + size.overlay_segments * (2 * index + 2)
        + sum(len(name) + 8 for name, _ in size.attributes)
        + bound_report_chars(size)
    )


def points_bound(count: int, order: int) -> int:
    """The most bytes of the JSON of a query of `count` points, with derivatives of this order.

    A brep has the column `inside`, too.
    """
    widths = [0] + [width for names in COLUMNS[: order + 1] for _, width in names]
    # Columns of the width 0 are booleans.
    row_bytes = sum(width * (FLOAT64_CHARS + 1) + 2 if width else len("false,") for width in widths)
    # Each column has its name and the brackets of its list.
    return count * row_bytes + 32 * len(widths)


def _faces(mesh: Mesh, row: IndexArray | None) -> bytes:
    """The JSON list of all faces, from the cache if possible; `row` as in `_write_faces`."""
    runs = tuple((part.quads, part.triangles) for part in mesh.parts)
    return keep_with_faces(mesh, row, ("JSON", runs), lambda: _write_faces(mesh, row))


def _write_faces(mesh: Mesh, row: IndexArray | None) -> bytes:
    """Write the JSON list of all faces, part by part; a part has its quads, then its triangles.

    `row`, shape (V,), has the row of each vertex of the mesh; None if this is the vertex number.
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
