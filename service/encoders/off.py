"""OFF: shared positions and faces, for geometry libraries.

The service does not use trimesh, because trimesh writes only triangles, and a fixed number of
decimals, which loses digits of small or large models. Normals are not written, because few readers
support NOFF. So vertices that differ only in their normal become one vertex, and a closed surface
stays closed. With colours the file is a COFF: red, green, blue and opacity, from 0 to 1, follow
every position. The faces are the quads, then the triangles.
"""

from service.encoders.content import add_opacity, find_colored_positions, write_counted_faces
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import FLOAT32_CHARS, FLOAT64_CHARS, digits, join_rows, rows
from service.engine.mesh.mesh import Mesh


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The OFF file, ASCII: header, counts (the number of edges is always 0), vertices, faces."""
    # Vertex k of the mesh is vertex row[k] of the file.
    positions, colors, row = find_colored_positions(mesh)
    counts = f"{len(positions)} {len(mesh.quads) + len(mesh.triangles)} 0\n".encode()
    return b"".join(
        (
            b"OFF\n" if colors is None else b"COFF\n",
            counts,
            rows(positions) if colors is None else join_rows(positions, add_opacity(colors)),
            write_counted_faces(mesh, row),
        )
    )


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The most bytes of the file: every number has the most characters."""
    index = digits(size.vertices) + 1
    color = 4 * (FLOAT32_CHARS + 1) if size.colors else 0
    header = 16 + 2 * digits(size.vertices + size.triangles + size.quads)
    return (
        header
        + size.vertices * (3 * (FLOAT64_CHARS + 1) + color)
        + size.triangles * (2 + 3 * index)
        + size.quads * (2 + 4 * index)
    )
