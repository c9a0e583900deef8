"""NPZ: the mesh as NumPy's archive of arrays, for programs in Python.

`numpy.load(file)` reads it, without pickle. The archive is not compressed, so that arrays are
copied, not computed; over HTTP a `Content-Encoding` may compress it. The times of its files are
those of `numpy.savez`, which are fixed, so the same mesh is the same bytes.

Row k of every array of the vertices (`normals`, `uvs`, `colors`, `attributes/NAME`) belongs to row
k of `vertices`. Positions with several normals, as at creases, have several rows; then `welds` has
for each vertex the first vertex at its position, and `welds[faces]` are faces that share their
edges. `faces` has the order of the JSON form: part by part, quads before triangles. If there are
quads, each row has four corners, and a triangle repeats its last. `parts`, `lines` and `report` are
the texts of the same keys of the JSON form, as bytes of UTF-8; but `lines` says which rows of
`line_segments` each has, whose numbers are those of the rows of `line_vertices`.
"""

from collections.abc import Iterator
from io import BytesIO
from typing import TypeAlias
from zipfile import ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.lib.format import write_array
from numpy.typing import NDArray

from service.bases.arrays import Bytes, IndexArray
from service.cancellation import checkpoint
from service.encoders.content import (
    absolute,
    bound_report_chars,
    find_nonempty,
    keep_with_faces,
    list_parts,
    lists_parts,
    report_object,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import json_text
from service.engine.mesh.mesh import Mesh

_Array: TypeAlias = NDArray[np.generic]

MEMBER_BYTES = 400
"""The most bytes of an array in the archive without its numbers: the header of NumPy (128), two
headers of ZIP (124), and twice its name."""

MEMBERS = 11
"""The most arrays without attributes."""


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The archive, in model coordinates."""
    checkpoint()
    file = BytesIO()
    with ZipFile(file, "w", ZIP_STORED) as archive:
        for name, array in _arrays(mesh):
            entry = ZipInfo(f"{name}.npy")
            entry.file_size = array.nbytes  # from 2 GiB on, the sizes need more bytes
            with archive.open(entry, "w") as stream:
                write_array(stream, array, allow_pickle=False)
    return file.getvalue()


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The most bytes of the archive, with normals, uvs and welds."""
    # A position and uvs are float64, a normal and a colour float32, a weld is a whole number.
    vertex = 3 * 8 + 2 * 8 + 3 * 4 + 4 * size.colors + 4
    vertex += 8 * sum(dimension for _, dimension in size.attributes)
    return (
        (MEMBERS + len(size.attributes)) * MEMBER_BYTES
        + size.vertices * vertex
        + (size.triangles + size.quads) * 4 * (4 if size.quads else 3)
        + size.overlay_points * 3 * 8
        + size.overlay_segments * 2 * 4
        + bound_report_chars(size)
    )


def _arrays(mesh: Mesh) -> Iterator[tuple[str, _Array]]:
    """The arrays of the archive, by name, in C order and with the least byte first."""
    yield "vertices", _write(absolute(mesh.positions, mesh), "<f8")
    yield "faces", keep_with_faces(mesh, None, ("NPZ", _runs(mesh)), lambda: _write_faces(mesh))
    columns = (
        ("normals", mesh.normals, "<f4"),
        ("uvs", mesh.uvs, "<f8"),
        ("colors", mesh.colors, "<f4"),
        *((f"attributes/{name}", values, "<f8") for name, values in mesh.attributes),
        ("welds", mesh.welds, "<u4"),
    )
    for name, values, kind in columns:
        if values is not None:
            yield name, _write(values, kind)
    parts = list(list_parts(mesh)) if lists_parts(mesh.report, mesh.parts) else []
    yield "parts", _write_text(parts)
    yield from _line_arrays(mesh)
    yield "report", _write_text(report_object(mesh.report, mesh.parts))


def _line_arrays(mesh: Mesh) -> Iterator[tuple[str, _Array]]:
    """The arrays of all overlays together, and the run of segments [first, last) of each."""
    overlays = find_nonempty(mesh.overlays)
    if not overlays:
        return
    positions = np.concatenate([absolute(overlay.positions, mesh) for overlay in overlays])
    first_points = np.cumsum([0, *(len(overlay.positions) for overlay in overlays)])
    first_segments = np.cumsum([0, *(len(overlay.segments) for overlay in overlays)]).tolist()
    segments = [
        overlay.segments + np.uint32(first)
        for overlay, first in zip(overlays, first_points[:-1], strict=True)
    ]
    yield "line_vertices", _write(positions, "<f8")
    yield "line_segments", _write(np.concatenate(segments), "<u4")
    lines = [
        {"name": overlay.name, "segments": [first, last]}
        for overlay, first, last in zip(
            overlays, first_segments[:-1], first_segments[1:], strict=True
        )
    ]
    yield "lines", _write_text(lines)


def _runs(mesh: Mesh) -> tuple[tuple[tuple[int, int], tuple[int, int]], ...]:
    """The rows of quads and of triangles of each part."""
    return tuple((part.quads, part.triangles) for part in mesh.parts)


def _write_faces(mesh: Mesh) -> IndexArray:
    """All faces, part by part; a part has its quads, then its triangles."""
    if not len(mesh.quads):
        return np.asarray(mesh.triangles, "<u4", "C")
    triangles = mesh.triangles.take([0, 1, 2, 2], axis=1)
    pieces = [
        faces[slice(*run)]
        for runs in _runs(mesh)
        for faces, run in zip((mesh.quads, triangles), runs, strict=True)
    ]
    return np.concatenate(pieces).astype("<u4", copy=False)


def _write(values: _Array, kind: str) -> _Array:
    """The array in C order with this type of number, copied only if it must be."""
    return np.asarray(values, kind, "C")


def _write_text(value: object) -> Bytes:
    """A value as JSON, one number for each byte: strings of NumPy take four bytes a character."""
    return np.frombuffer(json_text(value), np.uint8)
