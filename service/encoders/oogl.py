"""OOGL, the Object Oriented Graphics Library format that Geomview reads, as text.

Three of its four forms are written from a mesh; the exact one, `bez`, from patches
(`service.encoders.oogl_patches`).

- `cquad`: every quad of every patch's grid with its four corners in full, as the programs of the
  nineteen-nineties wrote it: white, six significant digits, corners in the order (i, j) (i, j+1)
  (i+1, j+1) (i+1, j).
- `mesh`: one grid of vertices a patch; a third of the bytes, and the normals.
- `off`: shared vertices with normals, and faces: for meshes that are not grids.

Overlays follow in the same list: one SKEL for each cell of a control net in `cquad`, and one SKEL
of segments otherwise.

References
----------
Geomview manual, "OOGL File Formats": LIST, QUAD, MESH, OFF, SKEL.
"""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from service.encoders.content import absolute, drawn
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import CHUNK, digits, general_lines, general_rows, rows
from service.engine.mesh import IndexArray, Mesh, Overlay, RealArray
from service.errors import Issue, UnsupportedByFormat
from service.surface.lowered import FloatArray

SEED_NUMBER, SEED_CHARS = "%g", 13
"""Six significant digits; at their longest -1.23457e-308."""

FLOAT32_NUMBER, NUMBER_CHARS = "%.9g", 16
"""Nine digits: a reader that stores float32, as Geomview does, loses nothing."""


def encode(mesh: Mesh, options: EncodeOptions) -> bytes:
    """Return the OOGL file, ASCII.

    Raises
    ------
    UnsupportedByFormat
        If the form asked for cannot hold this mesh.
    """
    form = options.oogl or ("cquad" if mesh.grids else "off")
    if form == "bez":
        raise _unsupported(
            "oogl_needs_patches", "only surfaces that are Bézier patches have an exact form", form
        )
    if form != "off" and not mesh.grids:
        raise _unsupported(
            "oogl_needs_grids", f"{form} is made of grids, and this mesh is not one", form
        )
    if form == "off" and not len(mesh.triangles) + len(mesh.quads):
        raise _unsupported("mesh_is_empty", "OOGL cannot hold a mesh without faces", form)

    if form == "cquad":
        members = chain(_cquad(mesh), _seed_overlays(mesh))
    else:
        members = chain(_meshes(mesh) if form == "mesh" else _off(mesh), _overlays(mesh))
    return "".join(chain(("LIST\n",), members)).encode("ascii")


def byte_bound(size: MeshSize, options: EncodeOptions) -> int:
    """Bytes at most of the form asked for, normals counted; of the larger default where none is."""
    if options.oogl == "bez":
        points = MOST_CONTROL_POINTS * size.patches
        points = points if size.control_points is None else size.control_points
        return 64 + 64 * size.patches + points * 4 * (SHORTEST_CHARS + 1) + _overlay_bound(size)
    index = digits(size.vertices + size.triangles + size.quads) + 1
    vertex = 6 * (NUMBER_CHARS + 1)
    seed_vertex = 3 * (SEED_CHARS + 1) + 8
    bounds = {
        # A patch has fewer quads than samples.
        "cquad": 4 * size.vertices * seed_vertex,
        "mesh": size.vertices * vertex + size.patches * (2 * index + 16),
        "off": size.vertices * vertex
        + size.triangles * (2 + 3 * index)
        + size.quads * (2 + 4 * index),
    }
    form = max(bounds.values()) if options.oogl is None else bounds[options.oogl]
    return 64 + 3 * index + form + _overlay_bound(size)


MOST_CONTROL_POINTS = 13 * 13
"""Control points of the highest degree that the exact form can hold."""

SHORTEST_CHARS = 24
"""A float64 in the fewest digits that read back as the same number."""


def skeletons(overlays: tuple[Overlay, ...]) -> Iterator[bytes]:
    """Overlays in model coordinates as SKEL members with all their digits."""
    for overlay in drawn(overlays):
        yield f"{{ = SKEL {len(overlay.positions)} {len(overlay.segments)}\n".encode()
        yield rows(overlay.positions)
        yield rows(overlay.segments, b"2 ")
        yield b"}\n"


def _cquad(mesh: Mesh) -> Iterator[str]:
    """One CQUAD of the quads of all grids; a block of rows at a time bounds the memory."""
    positions = absolute(mesh.positions, mesh)
    template = " ".join((SEED_NUMBER,) * 3) + " 1 1 1 1"
    yield "{ = CQUAD\n"
    for grid in chain.from_iterable(mesh.grids):
        width = grid.shape[1]
        step = max(1, CHUNK // width)
        for first in range(0, len(grid) - 1, step):
            block = grid[first : first + step + 1]
            lines = general_lines(positions[block.ravel()], template)
            for start in range(0, len(lines) - width, width):
                near = lines[start : start + width]
                far = lines[start + width : start + 2 * width]
                quads = zip(near[:-1], near[1:], far[1:], far[:-1], strict=True)
                yield "\n".join(chain.from_iterable(quads)) + "\n"
    yield "}\n"


def _seed_overlays(mesh: Mesh) -> Iterator[str]:
    """One closed SKEL for each cell of a control net; overlays without cells as segments."""
    for overlay in drawn(mesh.overlays):
        positions = absolute(overlay.positions, mesh)
        if overlay.cells is None:
            yield _skeleton(positions, overlay.segments, SEED_NUMBER)
            continue
        lines = general_lines(positions, " ".join((SEED_NUMBER,) * 3))
        for cell in overlay.cells.tolist():
            corners = "\n".join(lines[corner] for corner in cell)
            yield f"{{ = SKEL 4 1\n{corners}\n5 0 1 2 3 0\n}}\n"


def _meshes(mesh: Mesh) -> Iterator[str]:
    """One NMESH (MESH without normals) a patch, in which u runs fastest."""
    vertices, prefix = _vertices(mesh)
    template = " ".join((FLOAT32_NUMBER,) * vertices.shape[1])
    for grid in chain.from_iterable(mesh.grids):
        yield f"{{ = {prefix}MESH {grid.shape[0]} {grid.shape[1]}\n"
        yield general_rows(vertices[grid.T.ravel()], template)
        yield "}\n"


def _off(mesh: Mesh) -> Iterator[str]:
    """One NOFF (OFF without normals): the number of edges must be there and is not used."""
    vertices, prefix = _vertices(mesh)
    yield f"{{ = {prefix}OFF {len(vertices)} {len(mesh.quads) + len(mesh.triangles)} 0\n"
    yield general_rows(vertices, " ".join((FLOAT32_NUMBER,) * vertices.shape[1]))
    yield rows(mesh.quads, b"4 ").decode()
    yield rows(mesh.triangles, b"3 ").decode()
    yield "}\n"


def _vertices(mesh: Mesh) -> tuple[FloatArray, str]:
    """Columns of every vertex, positions and then normals, and the letter that announces them."""
    positions = absolute(mesh.positions, mesh)
    if mesh.normals is None:
        return positions, ""
    return np.hstack((positions, mesh.normals)), "N"


def _overlays(mesh: Mesh) -> Iterator[str]:
    """Every overlay as one SKEL."""
    for overlay in drawn(mesh.overlays):
        yield _skeleton(absolute(overlay.positions, mesh), overlay.segments, FLOAT32_NUMBER)


def _skeleton(positions: RealArray, segments: IndexArray, number: str) -> str:
    """SKEL of segments; each line of indices must end in a newline."""
    points = general_rows(positions, " ".join((number,) * 3))
    lines = rows(segments, b"2 ").decode()
    return f"{{ = SKEL {len(positions)} {len(segments)}\n{points}{lines}}}\n"


def _overlay_bound(size: MeshSize) -> int:
    """Bytes at most of all overlays in any form."""
    index = digits(size.overlay_points + size.overlay_segments) + 1
    point = 3 * (SHORTEST_CHARS + 1)
    cell = 30 + 4 * 3 * (SEED_CHARS + 1)
    skeletons = size.nodes * (16 + 2 * index)
    segments = size.overlay_segments * (2 + 2 * index)
    return skeletons + size.overlay_points * point + segments + size.overlay_cells * cell


def _unsupported(code: str, message: str, form: str) -> UnsupportedByFormat:
    return UnsupportedByFormat(Issue(code=code, message=message, pointer="/oogl", got=form))
