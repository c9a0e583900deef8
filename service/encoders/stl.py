"""Binary STL: triangles in float32, each with its normal.

Eighty bytes of header (zeros), the number of triangles, then for each triangle its normal and its
three corners as little-endian float32, and two bytes of nothing. The normal is that of the corners
in the right-hand order, zero where they span no area.

Written by us, some triangles at a time: through trimesh it took seven times the memory of the file.
"""

import struct

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.chunks import runs
from service.encoders.content import absolute, refuse_quads
from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh.mesh import Mesh
from service.engine.vectors import cross

HEADER_BYTES = 84
TRIANGLE_BYTES = 50

TRIANGLE = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("rest", "<u2")])

CHUNK = 1 << 14
"""Triangles whose normals are computed at a time."""

NO_AREA = 1e-13
"""A product of two sides that is no longer says nothing of a direction."""


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The binary STL file, in model coordinates.

    Raises
    ------
    UnsupportedByFormat
        If the mesh holds quads.
    """
    refuse_quads(mesh, "STL")
    count = len(mesh.triangles)
    positions = absolute(mesh.positions, mesh)
    packed = np.zeros(count, dtype=TRIANGLE)
    for first, last in runs(count, CHUNK):
        corners = positions[mesh.triangles[first:last]]
        packed["normal"][first:last] = _normals(corners)
        packed["corners"][first:last] = corners
    return b"".join((bytes(HEADER_BYTES - 4), struct.pack("<I", count), packed.data))


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Bytes exactly: quads would be two triangles."""
    return HEADER_BYTES + TRIANGLE_BYTES * (size.triangles + 2 * size.quads)


def _normals(corners: FloatArray) -> FloatArray:
    """Unit normals (T, 3) of triangles (T, 3, 3)."""
    normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    x, y, z = normals.T
    length = np.sqrt(x * x + y * y + z * z)
    flat = ~(length > NO_AREA)
    length[flat] = 1.0
    normals *= (1.0 / length)[:, np.newaxis]
    normals[flat] = 0.0
    return normals
