"""Binary STL, through trimesh, which loses nothing here: STL is triangles and float32.

Eighty bytes of header (zeros), the number of triangles, then for each triangle its normal and its
three corners as little-endian float32, and two bytes of nothing.
"""

from trimesh import Trimesh
from trimesh.exchange.stl import export_stl

from service.encoders.content import absolute, refuse_quads
from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh import Mesh

HEADER_BYTES = 84
TRIANGLE_BYTES = 50


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The binary STL file, in model coordinates.

    Raises
    ------
    UnsupportedByFormat
        If the mesh holds quads.
    """
    refuse_quads(mesh, "STL")
    # `process` would merge vertices and drop faces.
    return export_stl(Trimesh(absolute(mesh.positions, mesh), mesh.triangles, process=False))


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Bytes exactly: quads would be two triangles."""
    return HEADER_BYTES + TRIANGLE_BYTES * (size.triangles + 2 * size.quads)
