"""Converts parts and overlays of a mesh to primitives of glTF meshes, with their materials.

The faces of a brep become one glTF mesh, with a primitive for each colour: with a node for each of
its faces, a brep of a thousand faces would be drawn in a thousand steps. The `extras` of such a
primitive tell its faces apart, so that a click finds its face: `faces.first_triangle[k]` is the
first of the triangles, in the order of the indices, that belong to the face with the number
`faces.face[k]` in the brep.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2 meshes, 3.9 materials. KHR_materials_unlit.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from service.bases.arrays import Bools, IndexArray, Ints
from service.bases.cache import derive_once
from service.cancellation import checkpoint
from service.encoders.content import find_nonempty, is_translucent, refuse_quads
from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.gltf.buffer import BufferBuilder, JsonObject, index_rows
from service.encoders.gltf.columns import (
    Column,
    Columns,
    build_plain_columns,
    build_quantized_columns,
    grid_positions,
    to_single,
)
from service.engine.mesh.mesh import Mesh, MeshPart
from service.engine.scenes.colors import to_linear
from service.surface.lowered import Color

UNLIT = "KHR_materials_unlit"
"""The extension for materials without shading."""

SURFACE_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.6, 0.62, 0.66, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.5,
    },
}
"""The grey material of faces without colours."""

COLORED_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
}
"""The material of faces with vertex colours. Its base colour is white, the default, which does not
change the colours of the vertices."""

LINE_MATERIAL: JsonObject = {
    "name": "lines",
    "extensions": {UNLIT: {}},
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.85, 0.25, 0.05, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.9,
    },
}
"""The orange material of lines."""

LINES, TRIANGLES = 1, 4
"""The modes of primitives (3.7.2.1)."""


@dataclass(frozen=True, slots=True)
class Drawable:
    """A part or an overlay of a mesh, or all faces of a brep; it becomes one glTF mesh.

    `primitives` are the primitives, each with its base colour or None. `mesh` is the mesh that a
    part belongs to, None for an overlay.
    """

    name: str
    primitives: tuple[tuple[JsonObject, Color | None], ...]
    mesh: Mesh | None = None

    @property
    def is_repainted(self) -> bool:
        """Whether a member's colour changes it: any part has no colour of its own."""
        return self.mesh is not None and any(color is None for _, color in self.primitives)

    def paint(self, color: Color | None = None) -> Iterator[tuple[JsonObject, JsonObject]]:
        """Each primitive with its material; `color` is used for parts without a base colour."""
        for primitive, own_color in self.primitives:
            yield primitive, self.material(own_color or color)

    def material(self, color: Color | None) -> JsonObject:
        """The material for a base colour.

        The colours of vertices are multiplied by the base colour. The name of the material contains
        it. Without it, faces are grey, or white if vertices have colours.
        """
        if self.mesh is None:
            return LINE_MATERIAL
        colors = self.mesh.colors
        is_blended = colors is not None and is_translucent(colors)
        material = SURFACE_MATERIAL if colors is None else COLORED_MATERIAL
        if color is not None:
            is_opaque = color[3] >= 1
            code = "".join(f"{round(255 * value):02x}" for value in color[: 3 if is_opaque else 4])
            (factor,) = to_linear(np.array([color])).tolist()
            shade = material["pbrMetallicRoughness"] | {"baseColorFactor": factor}
            name = f"{material['name']} #{code}"
            material = material | {"name": name, "pbrMetallicRoughness": shade}
            is_blended = is_blended or not is_opaque
        return material | ({"alphaMode": "BLEND"} if is_blended else {})


def build_drawables(
    mesh: Mesh, buffer: BufferBuilder, options: EncodeOptions
) -> Iterator[Drawable]:
    """The parts with faces and the overlays with lines; their arrays are added to the buffer."""
    refuse_quads(mesh, "glTF")
    columns = build_quantized_columns(mesh) if mesh.step else build_plain_columns(mesh)
    if mesh.report.brep is not None:
        primitives = tuple(_join_faces(mesh, columns, buffer, options))
        if primitives:
            yield Drawable(mesh.name, primitives, mesh)
    else:
        for part, rows, triangles in split_parts(mesh):
            checkpoint()
            part_columns = {name: column.take(rows) for name, column in columns.items()}
            primitive = _build_primitive(part_columns, triangles, buffer, options)
            yield Drawable(part.name, ((primitive, part.color),), mesh)
    for overlay in find_nonempty(mesh.overlays):
        points = overlay.positions
        column = grid_positions(points, mesh) if mesh.step else Column(to_single(points))
        primitive = _build_primitive({"POSITION": column}, overlay.segments, buffer, options)
        yield Drawable(overlay.name, ((primitive, None),))


def _join_faces(
    mesh: Mesh, columns: Columns, buffer: BufferBuilder, options: EncodeOptions
) -> Iterator[tuple[JsonObject, Color | None]]:
    """A primitive for each colour of the faces of a brep, in the order of their first faces."""
    faces_by_color: dict[Color | None, list[int]] = defaultdict(list)
    for number, part in enumerate(mesh.parts):
        if part.triangles[0] < part.triangles[1]:
            faces_by_color[part.color].append(number)
    vertices = len(mesh.positions)
    is_used, lookup = np.zeros(vertices, dtype=np.bool_), np.empty(vertices, dtype=np.uint32)
    for color, faces in faces_by_color.items():
        checkpoint()
        runs = [mesh.triangles[slice(*mesh.parts[number].triangles)] for number in faces]
        if options.compression == "meshopt":
            runs = [_order_run(run, is_used, lookup) for run in runs]
        rows, triangles = _split_run(np.concatenate(runs), is_used, lookup)
        primitive = _store_primitive(
            {name: column.take(rows) for name, column in columns.items()}, triangles, buffer
        )
        first_triangles = [0, *accumulate(map(len, runs[:-1]))]
        extras = {"faces": {"first_triangle": first_triangles, "face": faces}}
        yield primitive | {"extras": extras}, color


def _order_run(triangles: IndexArray, is_used: Bools, lookup: IndexArray) -> IndexArray:
    """The triangles in an order that compresses well; their vertices keep their numbers."""
    rows, local_triangles = _split_run(triangles, is_used, lookup)
    vertices = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
    ordered, order = meshopt.order_faces(local_triangles, len(vertices))
    return vertices[order][ordered].astype(np.uint32)


def _build_primitive(
    columns: Columns, faces: IndexArray, buffer: BufferBuilder, options: EncodeOptions
) -> JsonObject:
    """The primitive of triangles or lines with these vertices; its arrays are added to the buffer.

    If the file is compressed, vertices and triangles get an order that compresses well.
    """
    if options.compression == "meshopt":
        faces, order = meshopt.order_faces(faces, len(columns["POSITION"].values))
        columns = {name: column.take(order) for name, column in columns.items()}
    return _store_primitive(columns, faces, buffer)


def _store_primitive(columns: Columns, faces: IndexArray, buffer: BufferBuilder) -> JsonObject:
    """The primitive of triangles or lines with these vertices; its arrays are added to the buffer.

    Vertices and faces keep their order.
    """
    attributes = {
        name: buffer.add_positions(column) if name == "POSITION" else buffer.add(column)
        for name, column in columns.items()
    }
    return {
        "attributes": attributes,
        "indices": buffer.add_indices(faces, len(columns["POSITION"].values)),
        "mode": TRIANGLES if faces.shape[1] == 3 else LINES,
    }


def split_parts(mesh: Mesh) -> Iterator[tuple[MeshPart, Ints | slice, IndexArray]]:
    """For each part with faces: the part, its vertices, and its triangles.

    The triangles have indices into the vertices of the part.
    """
    runs = tuple(part.triangles for part in mesh.parts)
    vertices = len(mesh.positions)
    if len(runs) == 1:
        part_runs = _split(mesh.triangles, runs, vertices).runs
    else:
        part_runs = derive_once(
            (mesh.triangles,),
            ("glTF", runs, vertices),
            lambda: _split(mesh.triangles, runs, vertices),
        ).runs
    for part, (rows, triangles) in zip(mesh.parts, part_runs, strict=True):
        if len(triangles):
            yield part, rows, triangles


@dataclass(frozen=True, eq=False, slots=True)
class _Split:
    """For each run of triangles: its vertices, and its triangles with indices into these."""

    runs: tuple[tuple[Ints | slice, IndexArray], ...]

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""
        arrays = [array for run in self.runs for array in run if not isinstance(array, slice)]
        return sum(array.nbytes for array in arrays)


def _split(triangles: IndexArray, runs: Sequence[tuple[int, int]], vertices: int) -> _Split:
    """Split triangles into runs [begin, end), each with vertices of its own.

    Indices have 16 or 32 bits, as in the file.
    """
    if len(runs) == 1:
        return _Split(((slice(None), index_rows(triangles[slice(*runs[0])], vertices)),))
    is_used, lookup = np.zeros(vertices, dtype=np.bool_), np.empty(vertices, dtype=np.uint32)
    return _Split(tuple(_split_run(triangles[slice(*run)], is_used, lookup) for run in runs))


def _split_run(
    triangles: IndexArray, is_used: Bools, lookup: IndexArray
) -> tuple[Ints | slice, IndexArray]:
    """The vertices that these triangles use, and the triangles as indices into these vertices.

    `is_used` (all False) and `lookup`, both of shape (V,), are temporary arrays that the caller
    allocates once. Only the range of the indices is read, so that many small parts do not take
    longer than one large part.
    """
    if not len(triangles):
        return slice(0, 0), index_rows(triangles, 0)
    low, high = int(triangles.min()), int(triangles.max()) + 1
    is_used[triangles] = True
    vertices = np.flatnonzero(is_used[low:high]) + low
    is_used[low:high] = False
    count = len(vertices)
    if count == high - low:
        return slice(low, high), index_rows(triangles - np.uint32(low), count)
    lookup[vertices] = np.arange(count, dtype=np.uint32)
    return vertices, index_rows(lookup[triangles], count)
