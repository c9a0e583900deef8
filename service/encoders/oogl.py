"""OOGL, the Object Oriented Graphics Library format that Geomview reads, as text.

This module writes three of the four forms, from a mesh. The fourth form, `bez`, is exact and is
written from patches (`service.encoders.oogl_patches`).

- `cquad`: every quad of the grid of each patch, with the coordinates of its four corners. Programs
  of the 1990s wrote this form: white, six significant digits, corners in the order (i, j) (i, j+1)
  (i+1, j+1) (i+1, j).
- `mesh`: one grid of vertices for each patch, with normals and all digits. It needs fewer bytes.
- `off`: a list of vertices, with normals and all digits, and a list of faces. It can store meshes
  that are not grids.

Vertices have colours as red, green, blue and opacity. `mesh` and `off` can store texture
coordinates. A line of a vertex has its position, normal, colour and texture coordinates in this
order, although in the keyword the letters for texture coordinates (U of a MESH, ST of an OFF) come
first, then C and N.

Overlays follow in the same list. In `cquad`, each cell (quad) of a control net is one SKEL;
otherwise all segments of an overlay are one SKEL.

References
----------
Geomview manual, "OOGL File Formats": LIST, QUAD, MESH, OFF, SKEL.
"""

from collections.abc import Iterator
from decimal import Decimal
from itertools import pairwise
from math import hypot

import numpy as np

from service.bases.arrays import IndexArray, RealArray
from service.bases.row_batches import row_slices
from service.encoders.content import absolute, add_opacity, find_nonempty, write_counted_faces
from service.encoders.format import EncodeOptions, MeshSize, OoglForm
from service.encoders.text import (
    FLOAT32_CHARS,
    FLOAT64_CHARS,
    digits,
    general_lines,
    join_rows,
    rows,
)
from service.engine.mesh.mesh import Mesh, Overlay
from service.errors import Issue, UnsupportedByFormat

CQUAD_CHARS = 13
"""The most characters of a number with six significant digits: -1.23457e-308."""

CQUAD_CELL = b"{ = SKEL 4 1\n%b\n%b\n%b\n%b\n5 0 1 2 3 0\n}\n"
"""A SKEL with the outline of one cell of a control net; %b stands for the line of a corner."""

BLOCK = 1 << 14
"""The number of samples or cells whose text is written at once, to bound the memory."""


def encode(mesh: Mesh, options: EncodeOptions) -> bytes:
    """The OOGL file, ASCII.

    Raises
    ------
    UnsupportedByFormat
        The form cannot store this mesh.
    """
    form = _choose_form(mesh, options)
    if form == "bez":
        raise _build_unsupported_error(
            "The exact form is made of Bézier patches, not of a mesh.", form
        )
    if form != "off" and not mesh.grids:
        raise _build_unsupported_error(
            "This form needs a mesh of one grid for each patch.", form, "off"
        )
    members = {"cquad": _cquad, "mesh": _meshes, "off": _off}[form](mesh)
    chunks = [b"LIST\n", *members, *_overlays(mesh, in_cells=form == "cquad")]
    if len(chunks) == 1:
        raise _build_unsupported_error("OOGL cannot store a mesh without faces.", "no faces")
    return b"".join(chunks)


def byte_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The most bytes of a file of this form, with normals and parameters.

    If the options name no form, this is the larger bound of the default forms, `cquad` and `off`.
    """
    index = digits(size.vertices + size.triangles + size.quads) + 1
    # Position; normal and texture coordinates, of which MESH has a third, 0.
    vertex = 3 * (FLOAT64_CHARS + 1) + 5 * (FLOAT32_CHARS + 1) + len(" 0.0")
    # BEZ: texture coordinates, and then colours, at the four corners of a patch.
    corners = 4 * 2 * (FLOAT64_CHARS + 1)
    color = len(" 1 1 1 1")
    if size.colors:
        vertex += 4 * (FLOAT32_CHARS + 1)
        corners += 4 * 4 * (FLOAT64_CHARS + 1)
        color = 4 * (CQUAD_CHARS + 1)
    bounds = {
        # A patch has fewer quads than samples.
        "cquad": size.vertices * 4 * (3 * (CQUAD_CHARS + 1) + color),
        "mesh": size.vertices * vertex + size.patches * (2 * index + 16),
        "off": size.vertices * vertex
        + size.triangles * (2 + 3 * index)
        + size.quads * (2 + 4 * index),
        "bez": size.control_points * 4 * (FLOAT64_CHARS + 1) + size.patches * (32 + corners),
    }
    form_bytes = bounds[options.oogl] if options.oogl else max(bounds["cquad"], bounds["off"])
    return 64 + 3 * index + form_bytes + _overlay_bound(size)


def coarseness(mesh: Mesh, options: EncodeOptions) -> float:
    """A bound of the distance by which rounding to six significant digits moves a vertex.

    Only `cquad` rounds. A coordinate of at least 10^e and less than 10^(e+1) is rounded by at most
    10^(e−5) / 2.
    """
    if _choose_form(mesh, options) != "cquad":
        return 0.0
    bounds = zip(mesh.report.bounds_min, mesh.report.bounds_max, strict=True)
    # `Decimal.adjusted` is the exponent e; log10 could round up to the next integer.
    largest = [Decimal(max(-low, high)) for low, high in bounds]
    return hypot(*(5.0 * 10.0 ** (x.adjusted() - 6) if x > 0 else 0.0 for x in largest))


def _choose_form(mesh: Mesh, options: EncodeOptions) -> OoglForm:
    """The form in the options, or the default form for this mesh."""
    return options.oogl or ("cquad" if mesh.grids else "off")


def skeleton(overlay: Overlay, mesh: Mesh | None = None) -> bytes:
    """A SKEL with the segments of an overlay, with all digits, in model coordinates.

    The overlay's positions are relative to the origin of `mesh`, if `mesh` is given.
    """
    positions = overlay.positions if mesh is None else absolute(overlay.positions, mesh)
    head = f"{{ = SKEL {len(positions)} {len(overlay.segments)}\n".encode()
    return head + rows(positions) + rows(overlay.segments, b"2 ") + b"}\n"


def _cquad(mesh: Mesh) -> Iterator[bytes]:
    """The text of one CQUAD with the quads of all grids, in chunks, to bound the memory."""
    vertices, end = absolute(mesh.positions, mesh), b" 1 1 1 1\n"
    if mesh.colors is not None:
        vertices, end = np.hstack((vertices, add_opacity(mesh.colors))), b"\n"
    vertex_texts = np.array(general_lines(vertices), dtype=object)
    yield b"{ = CQUAD\n"
    for grids in mesh.grids:
        width = grids.shape[2]
        # Each line of samples i = constant, and the line i + 1 beside it.
        lines_u, next_lines_u = grids[:, :-1].reshape(-1, width), grids[:, 1:].reshape(-1, width)
        for chunk in row_slices(len(lines_u), width, BLOCK):
            a, b = lines_u[chunk], next_lines_u[chunk]
            corners = np.stack((a[:, :-1], a[:, 1:], b[:, 1:], b[:, :-1]), axis=-1)
            yield end.join((*vertex_texts.take(corners.ravel()), b""))
    yield b"}\n"


def _overlays(mesh: Mesh, *, in_cells: bool) -> Iterator[bytes]:
    """One SKEL for each overlay; if `in_cells`, one closed SKEL for each cell of a control net."""
    for overlay in find_nonempty(mesh.overlays):
        if overlay.cells is None or not in_cells:
            yield skeleton(overlay, mesh)
            continue
        points = np.array(general_lines(absolute(overlay.positions, mesh)), dtype=object)
        for chunk in row_slices(len(overlay.cells), 4, BLOCK):
            corners = points.take(overlay.cells[chunk].ravel())
            yield CQUAD_CELL * (len(corners) // 4) % tuple(corners)


def _meshes(mesh: Mesh) -> Iterator[bytes | memoryview]:
    """One NMESH for each patch (MESH if there are no normals), in which u varies fastest."""
    for grids in mesh.grids:
        _, row_count, column_count = grids.shape
        point_count = row_count * column_count
        for chunk in row_slices(len(grids), point_count, BLOCK):
            prefix, text = _vertices(mesh, grids[chunk].swapaxes(1, 2).ravel(), "U")
            head = f"{{ = {prefix}MESH {row_count} {column_count}\n".encode()
            ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n")) + 1
            # Every `point_count` lines, the text of a patch ends.
            for begin, end in pairwise((0, *ends[point_count - 1 :: point_count].tolist())):
                yield from (head, memoryview(text)[begin:end], b"}\n")


def _off(mesh: Mesh) -> Iterator[bytes]:
    """One NOFF (OFF if there are no normals) of the faces, if there are any.

    Readers ignore its number of edges, 0.
    """
    if faces := len(mesh.quads) + len(mesh.triangles):
        prefix, vertices = _vertices(mesh, slice(None), "ST")
        yield f"{{ = {prefix}OFF {len(mesh.positions)} {faces} 0\n".encode()
        yield vertices
        # None: the vertices of the file are those of the mesh, in this order.
        yield write_counted_faces(mesh, None)
        yield b"}\n"


def _vertices(mesh: Mesh, selection: IndexArray | slice, texture: str) -> tuple[str, bytes]:
    """The prefix of the keyword, and the lines of the vertices that `selection` names.

    The prefix has a letter for each value after the positions. `texture` is the prefix for texture
    coordinates: `ST` if a vertex has two of them, `U` if it has three.
    """
    columns: list[RealArray] = []
    prefix = ""
    if mesh.normals is not None:
        prefix = "N"
        columns.append(mesh.normals[selection])
    if mesh.colors is not None:
        prefix = "C" + prefix
        columns.append(add_opacity(mesh.colors[selection]))
    if mesh.uvs is not None:
        prefix = texture + prefix
        uvs = mesh.uvs[selection]
        columns.append(np.pad(uvs, ((0, 0), (0, 1))) if texture == "U" else uvs)
    positions = absolute(mesh.positions[selection], mesh)
    if not columns:
        return prefix, rows(positions)
    return prefix, join_rows(positions, np.hstack(columns, dtype=np.float32, casting="same_kind"))


def _overlay_bound(size: MeshSize) -> int:
    """The most bytes of all overlays, in any form."""
    index = digits(size.overlay_points + size.overlay_segments) + 1
    point = 3 * (FLOAT64_CHARS + 1)
    cell = 30 + 4 * 3 * (CQUAD_CHARS + 1)
    skeletons = size.drawables * (16 + 2 * index)
    segments = size.overlay_segments * (2 + 2 * index)
    return skeletons + size.overlay_points * point + segments + size.overlay_cells * cell


def _build_unsupported_error(message: str, got: str, needed: str = "") -> UnsupportedByFormat:
    return UnsupportedByFormat(Issue("unsupported_by_format", message, "/oogl", got, needed))
