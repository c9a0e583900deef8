"""Binary PLY (Greg Turk, 1994): vertices with their normals and parameters, and faces.

The service does not use trimesh, because trimesh writes only float32 positions, which loses half of
the digits, and only triangles. The faces are the quads, then the triangles. Coordinates are
`double`; normals, parameters and attributes are `float`. Parameters have the names `s` and `t`, as
in Blender and MeshLab. Colours are bytes (`uchar`) of sRGB, because every reader supports these:
`red`, `green`, `blue` and, if they have an opacity, `alpha`. An attribute `heat` is the property
`_heat`; if it has several numbers, they are `_heat_0`, `_heat_1` and so on. A comment contains the
deviation bound.
"""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import IndexArray
from service.bases.cache import derive_once
from service.encoders.content import COMMENT_CHARS, absolute, bound_comment, to_bytes
from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh.mesh import Mesh

HEADER_BYTES = 512 + COMMENT_CHARS
"""An upper bound of the bytes of the header without attributes: 19 lines and two counts."""

COLORS = ("red", "green", "blue", "alpha")
"""The names of the properties of a colour."""

VERTEX_BYTES = 3 * 8 + 3 * 4 + 2 * 4
"""Bytes of a vertex: position, normal and parameters."""


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
    return b"".join(
        ("\n".join(header).encode(), vertices.data, _faces(mesh.quads), _faces(mesh.triangles))
    )


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The most bytes of the file, with normals and parameters."""
    properties = [key for name, d in size.attributes for key in _properties(name, d)]
    # A colour has one byte for each of its components.
    return (
        HEADER_BYTES
        + sum(len("property float \n") + len(key) for key in properties)
        + size.vertices * (VERTEX_BYTES + size.colors + 4 * len(properties))
        + size.triangles * (1 + 3 * 4)
        + size.quads * (1 + 4 * 4)
    )


def _properties(name: str, dimension: int) -> tuple[str, ...]:
    """The names of the properties of an attribute.

    They begin with an underscore, so that they differ from the names that PLY uses.
    """
    if dimension == 1:
        return (f"_{name}",)
    return tuple(f"_{name}_{k}" for k in range(dimension))


def _columns(
    names: tuple[str, ...], array: NDArray[np.floating]
) -> list[tuple[str, str, NDArray[np.generic]]]:
    """The fields (name, type, values) of the columns of an array, as float32."""
    return [(name, "<f4", column) for name, column in zip(names, array.T, strict=True)]


def _faces(faces: IndexArray) -> memoryview:
    """The bytes of the faces, from the cache if possible."""
    return derive_once((faces,), "PLY", lambda: _build_records(faces)).data


def _build_records(faces: IndexArray) -> NDArray[np.void]:
    """For each face a record of the number of corners and their indices."""
    corners = faces.shape[1]
    records = np.empty(len(faces), [("corners", "u1"), ("vertices", "<i4", (corners,))])
    records["corners"] = corners
    records["vertices"] = faces
    return records
