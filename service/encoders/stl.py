"""Binary STL: triangles in float32, each with its normal.

Eighty bytes of header (zeros), the number of triangles, then for each triangle its normal and its
three corners as little-endian float32, and two zero bytes. The normal is that of the corners in the
right-hand order, or zero if they span no area.

Triangles are encoded in chunks: trimesh took seven times the memory of the file.
"""

import struct

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import row_runs
from service.encoders.content import absolute, refuse_quads
from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh.mesh_value import Mesh

HEADER_BYTES = 84
TRIANGLE_BYTES = 50

TRIANGLE = np.dtype([("numbers", "V48"), ("rest", "<u2")])
"""A normal and three corners, 12 float32, copied as one value."""

CHUNK = 1 << 14
"""Triangles in one chunk."""

NO_AREA = 1e-13
"""A product of two sides shorter than this has no reliable direction."""


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The binary STL file, in model coordinates.

    Raises
    ------
    UnsupportedByFormat
        The mesh has quads.
    """
    refuse_quads(mesh, "STL")
    count = len(mesh.triangles)
    positions = np.ascontiguousarray(absolute(mesh.positions, mesh).T)
    packed = np.zeros(count, dtype=TRIANGLE)
    for first, last in row_runs(count, CHUNK):
        corners = positions.take(mesh.triangles[first:last].T, axis=1)
        columns = np.empty((4, 3, last - first), dtype="<f4")
        columns[0] = _normals(corners)
        columns[1:] = corners.swapaxes(0, 1)
        numbers = np.ascontiguousarray(columns.reshape(12, -1).T)
        packed["numbers"][first:last] = numbers.view("V48")[:, 0]
    return b"".join((bytes(HEADER_BYTES - 4), struct.pack("<I", count), packed.data))


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The exact number of bytes; a quad counts as two triangles."""
    return HEADER_BYTES + TRIANGLE_BYTES * (size.triangles + 2 * size.quads)


def _normals(corners: FloatArray) -> FloatArray:
    """Unit normals (3, T) of triangles with corners (3, 3, T)."""
    ax, ay, az = corners[:, 1] - corners[:, 0]
    bx, by, bz = corners[:, 2] - corners[:, 1]
    x, y, z = normals = np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
    length = np.sqrt(x * x + y * y + z * z)
    flat = np.flatnonzero(~(length > NO_AREA))
    length[flat] = 1.0
    normals *= 1.0 / length
    normals[:, flat] = 0.0
    return normals
