"""STL: triangles in float32, each with its normal; binary, or as text with the same numbers.

A binary file is a header of 80 zero bytes, the number of triangles, and the triangles. A triangle
is its normal and its three corners as little-endian float32, and two zero bytes. The normal follows
from the corners by the right-hand rule; it is zero if the triangle has no area.

Triangles are encoded in chunks to save memory: an earlier encoder, by trimesh, needed seven times
the memory of the file.
"""

import struct
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.bases.row_batches import row_runs
from service.encoders.content import absolute, refuse_quads
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import FLOAT32_CHARS, rows
from service.engine.mesh.mesh import Mesh

HEADER_BYTES = 84
"""Bytes of the header and of the number of triangles."""

TRIANGLE_BYTES = 50
"""Bytes of one triangle."""

TRIANGLE = np.dtype([("numbers", "V48"), ("zero", "<u2")])
"""One triangle: `numbers` are its normal and three corners, 12 float32, copied as one value."""

CHUNK = 1 << 14
"""How many triangles are encoded at once."""

NO_AREA = 1e-13
"""A triangle whose cross product of two sides is at most this long gets the normal 0. This is the
limit of trimesh, an absolute number, so that files have the bytes that trimesh writes."""


BETWEEN = b"  |  /  /  "
"""The separators of the 12 numbers of a triangle in a text; two of them become words."""

WORDS = ((b"\n", b"\nendloop\nendfacet\n"), (b"|", b"\nouter loop\nvertex "), (b"/", b"\nvertex "))
"""The words of a text in place of separators; each triangle also begins with `FACET`."""

FACET, HEAD, END = b"facet normal ", b"solid surface\n", b"endsolid surface\n"

TEXT_BYTES = 96 + 12 * (FLOAT32_CHARS + 1)
"""The most bytes of one triangle in a text."""


def encode(mesh: Mesh, options: EncodeOptions) -> bytes:
    """The STL file, in model coordinates.

    Raises
    ------
    UnsupportedByFormat
        The mesh has quads.
    """
    refuse_quads(mesh, "STL")
    count = len(mesh.triangles)
    if options.stl == "ascii":
        return b"".join((HEAD, *(_write_text(numbers) for _, numbers in _numbers(mesh)), END))
    records = np.zeros(count, dtype=TRIANGLE)
    for chunk, numbers in _numbers(mesh):
        records["numbers"][chunk] = numbers.view("V48")[:, 0]
    return b"".join((bytes(HEADER_BYTES - 4), struct.pack("<I", count), records.data))


def byte_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The number of bytes of a binary file, which is exact, or the most bytes of a text.

    A quad counts as two triangles.
    """
    count = size.triangles + 2 * size.quads
    if options.stl == "ascii":
        return len(HEAD) + len(END) + TEXT_BYTES * count
    return HEADER_BYTES + TRIANGLE_BYTES * count


def _numbers(mesh: Mesh) -> Iterator[tuple[slice, NDArray[np.float32]]]:
    """Yields the 12 numbers of triangles, (n, 12), and which rows of `mesh.triangles` they are."""
    positions = np.ascontiguousarray(absolute(mesh.positions, mesh).T)
    for begin, end in row_runs(len(mesh.triangles), CHUNK):
        corners = positions.take(mesh.triangles[begin:end].T, axis=1)
        columns = np.empty((4, 3, end - begin), dtype="<f4")
        columns[0] = _normals(corners)
        columns[1:] = corners.swapaxes(0, 1)
        yield slice(begin, end), np.ascontiguousarray(columns.reshape(12, -1).T)


def _write_text(numbers: NDArray[np.float32]) -> bytes:
    """The facets of triangles, of which `numbers` (n, 12) are the normals and the corners."""
    # Adding 0 turns −0 into 0, which is easier to read.
    text = rows(numbers + np.float32(0), between=BETWEEN)
    for separator, words in WORDS:
        text = text.replace(separator, words + FACET if separator == b"\n" else words)
    return FACET + text[: -len(FACET)]


def _normals(corners: FloatArray) -> FloatArray:
    """Unit normals of triangles, shape (3, T); zero for triangles without area.

    `corners` has shape (3, 3, T): coordinate, corner, triangle.
    """
    ax, ay, az = corners[:, 1] - corners[:, 0]
    bx, by, bz = corners[:, 2] - corners[:, 1]
    x, y, z = normals = np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
    length = np.sqrt(x * x + y * y + z * z)
    # Not `length <= NO_AREA`, which is false for NaN.
    without_area = np.flatnonzero(~(length > NO_AREA))
    length[without_area] = 1.0
    normals *= 1.0 / length
    normals[:, without_area] = 0.0
    return normals
