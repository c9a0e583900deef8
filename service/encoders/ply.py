"""Binary PLY (Greg Turk, 1994): vertices with their normals and parameters, and faces.

The service does not use trimesh for this: it writes float32 positions and triangles only, which
loses half of the digits, and quads. The faces are the quads, then the triangles. Coordinates are
`double`, all other numbers `float`; parameters have the names `s` and `t`, as in Blender and
MeshLab. Colours are bytes of sRGB, `red`, `green`, `blue` and, if they have an opacity, `alpha`:
every reader supports these. The attribute `heat` is the property `_heat`, or `_heat_0`, `_heat_1`
and so on if it has several numbers. A comment contains the certified deviation.
"""

import numpy as np
from numpy.typing import DTypeLike, NDArray

from service.bases.arrays import IndexArray
from service.bases.cache import derive_once
from service.encoders.colors import to_bytes
from service.encoders.content import COMMENT_CHARS, absolute, bound_comment
from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh.mesh_value import Mesh

HEADER_BYTES = 512 + COMMENT_CHARS
"""An upper bound of the header without attributes: 19 lines and two counts."""

COLORS = ("red", "green", "blue", "alpha")

VERTEX_BYTES = 3 * 8 + 3 * 4 + 2 * 4


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The binary little-endian PLY file, in model coordinates."""
    fields: list[tuple[str, str, NDArray[np.generic]]] = [
        (axis, "<f8", column)
        for axis, column in zip("xyz", absolute(mesh.positions, mesh).T, strict=True)
    ]
    if mesh.normals is not None:
        fields += _columns(("nx", "ny", "nz"), mesh.normals)
    if mesh.uvs is not None:
        fields += _columns(("s", "t"), mesh.uvs)
    if mesh.colors is not None:
        columns = to_bytes(mesh.colors).T
        fields += [(n, "u1", c) for n, c in zip(COLORS[: len(columns)], columns, strict=True)]
    for name, values in mesh.attributes:
        fields += _columns(_properties(name, values.shape[1]), values)

    vertices = np.empty(len(mesh.positions), dtype=[(name, kind) for name, kind, _ in fields])
    for name, _, column in fields:
        vertices[name] = column

    scalar = {"<f8": "double", "<f4": "float", "u1": "uchar"}
    comment = bound_comment(mesh.report)
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *([f"comment {comment}"] if comment else ()),
        f"element vertex {len(vertices)}",
        *(f"property {scalar[kind]} {name}" for name, kind, _ in fields),
        f"element face {len(mesh.quads) + len(mesh.triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
        "",
    ]
    parts = ("\n".join(header).encode(), vertices.data, _faces(mesh.quads), _faces(mesh.triangles))
    return b"".join(parts)


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Most bytes, with normals and parameters."""
    named = [property_ for name, d in size.attributes for property_ in _properties(name, d)]
    return (
        HEADER_BYTES
        + sum(len("property float \n") + len(property_) for property_ in named)
        + size.vertices * (VERTEX_BYTES + size.colors + 4 * len(named))
        + size.triangles * (1 + 3 * 4)
        + size.quads * (1 + 4 * 4)
    )


def _properties(name: str, dimension: int) -> tuple[str, ...]:
    """Names of the columns of an attribute; the underscore makes them differ from PLY's own."""
    if dimension == 1:
        return (f"_{name}",)
    return tuple(f"_{name}_{k}" for k in range(dimension))


def _columns(
    names: tuple[str, ...], array: NDArray[np.floating]
) -> list[tuple[str, str, NDArray[np.generic]]]:
    """Fields of float32, one for each column."""
    return [(name, "<f4", column) for name, column in zip(names, array.T, strict=True)]


def _faces(faces: IndexArray) -> memoryview:
    """The records of the faces, cached with them."""
    return derive_once((faces,), "PLY", lambda: _records(faces)).data


def _records(faces: IndexArray) -> NDArray[np.void]:
    """Each face as its number of corners and their indices."""
    corners = faces.shape[1]
    layout: DTypeLike = [("corners", "u1"), ("vertices", "<i4", (corners,))]
    packed = np.empty(len(faces), dtype=layout)
    packed["corners"] = corners
    packed["vertices"] = faces
    return packed
