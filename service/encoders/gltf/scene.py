"""A scene as glTF: each copy is a named node; the arrays of each distinct mesh are stored once.

A glTF node can translate, rotate and scale (3.5.3), but it cannot shear. By the singular value
decomposition L = U S Vᵀ, any linear map is a rotation after a scaling after a rotation. So a copy
with shear is a node with the rotation U and the scaling S, whose child has the rotation Vᵀ. A
mirrored copy has a negative scaling; readers then reverse the winding of its faces (3.7.4).

A copy in another colour is another glTF mesh with the same accessors.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations, 3.7.4 instantiation.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.content import report_object
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.columns import node_transform
from service.encoders.gltf.document import (
    File,
    build_whole_document,
    turn_and_scale,
    write_gltf,
)
from service.encoders.gltf.glb import write_glb
from service.encoders.gltf.primitives import build_drawables
from service.engine.scenes.scene import Scene, scene_parts
from service.surface.lowered import Color, PlacedModel
from service.surface.placement import is_mirroring

NEGLIGIBLE = 1e-12
"""Columns whose cosine is at most this count as perpendicular, and a scaling that differs from 1 by
at most this counts as 1. Rounding errors are about 1e-16."""


def encode_glb_scene(scene: Scene, options: EncodeOptions) -> bytes:
    """The scene as a binary glTF file; raises `UnsupportedByFormat` if a mesh has quads."""
    return bytes(write_glb(*_Document(scene, options).finish()))


def encode_gltf_scene(scene: Scene, options: EncodeOptions) -> bytes:
    """The scene as one glTF JSON document; raises `UnsupportedByFormat` if a mesh has quads."""
    return write_gltf(*_Document(scene, options).finish())


class _Document:
    """Builds the document of a scene: adds nodes, meshes and materials one by one."""

    def __init__(self, scene: Scene, options: EncodeOptions) -> None:
        self.scene, self.options = scene, options
        self.buffer = BufferBuilder()
        self.drawables = [
            list(build_drawables(mesh, self.buffer, options)) for mesh in scene.meshes
        ]
        self.transforms = [node_transform(mesh) for mesh in scene.meshes]
        self.nodes: list[JsonObject] = []
        self.meshes: list[JsonObject] = []
        self.materials: list[JsonObject] = []
        self._mesh_numbers: dict[tuple[int, int, Color | None], int] = {}
        self._material_numbers: dict[tuple[str, bool, tuple[float, ...]], int] = {}

    def finish(self) -> File:
        """Build the document, with a node for each copy, and the buffer."""
        scene = self.scene
        transform = turn_and_scale(scene.up, scene.report.metres_per_unit)
        root: JsonObject = {"name": scene.name, **transform}
        self.nodes.append(root)
        root["children"] = self._add_tree()
        arrays: JsonObject = {
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
        }
        report = report_object(scene.report, scene_parts(scene))
        return build_whole_document(scene.name, report, arrays, self.buffer, self.options)

    def _add_tree(self) -> list[int]:
        """Add the nodes of all copies, and those above them; returns the numbers of the first."""
        copies = self.scene.nodes
        if not self.scene.tree:
            numbers = []
            for copy in copies:
                numbers.append(len(self.nodes))
                self._add_copy(self._add_node(copy.name, copy.matrix), copy)
            return numbers
        roots: list[int] = []
        inside: list[JsonObject] = []
        for each in self.scene.tree:
            number = len(self.nodes)
            node = self._add_node(each.name, each.matrix)
            inside.append(node)
            if each.copy is not None:
                self._add_copy(node, copies[each.copy], each.name)
            above = None if each.parent is None else inside[each.parent]
            (roots if above is None else above.setdefault("children", [])).append(number)
        return roots

    def _add_node(self, name: str, matrix: FloatArray | None) -> JsonObject:
        """Add a node, and a child of it if there is shear; returns the one that has the bodies."""
        node_fields, child_fields = split_matrix(matrix)
        node: JsonObject = {"name": name, **node_fields}
        self.nodes.append(node)
        if child_fields:
            node["children"] = [len(self.nodes)]
            node = child_fields
            self.nodes.append(node)
        return node

    def _add_copy(self, node: JsonObject, member: PlacedModel, name: str = "") -> None:
        """Add the mesh of a copy to its node, or a child for each of several drawables.

        A mesh gets this name, or that of the copy.
        """
        drawables, transform = self.drawables[member.model], self.transforms[member.model]
        if len(drawables) == 1 and not transform:
            node["mesh"] = self._add_mesh(member, 0, name or member.name)
        elif drawables:
            node["children"] = list(range(len(self.nodes), len(self.nodes) + len(drawables)))
            self.nodes += [
                {"name": each.name, "mesh": self._add_mesh(member, k, each.name), **transform}
                for k, each in enumerate(drawables)
            ]

    def _add_mesh(self, member: PlacedModel, k: int, name: str) -> int:
        """The number of the mesh of drawable k in the colour of a copy.

        The mesh is added, with this name, for the first copy in this colour.
        """
        drawable = self.drawables[member.model][k]
        color = member.color if drawable.is_repainted else None
        key = (member.model, k, color)
        if key not in self._mesh_numbers:
            self._mesh_numbers[key] = len(self.meshes)
            primitives = [
                primitive | {"material": self._add_material(material)}
                for primitive, material in drawable.paint(color)
            ]
            self.meshes.append({"name": name, "primitives": primitives})
        return self._mesh_numbers[key]

    def _add_material(self, material: JsonObject) -> int:
        """The number of a material; added if it is new."""
        shade = material["pbrMetallicRoughness"]
        color = tuple(shade.get("baseColorFactor", ()))
        key = (str(material["name"]), "alphaMode" in material, color)
        if key not in self._material_numbers:
            self._material_numbers[key] = len(self.materials)
            self.materials.append(material)
        return self._material_numbers[key]


def split_matrix(matrix: FloatArray | None) -> tuple[JsonObject, JsonObject]:
    """Split an affine matrix into the fields of a node, and of its child node if there is shear.

    The fields are `translation`, `rotation` and `scale`. None stands for the identity. Without
    shear, the second result is empty.
    """
    if matrix is None:
        return {}, {}
    shift, linear = matrix[:3, 3], matrix[:3, :3]
    fields: JsonObject = {"translation": shift.tolist()} if shift.any() else {}
    if not (linear - np.diag(np.diag(linear))).any():
        return fields | _write_scale(np.diag(linear)), {}
    # If the columns are perpendicular, linear = turn · diag(lengths).
    lengths = np.sqrt((linear**2).sum(axis=0))
    if is_mirroring(linear):
        lengths = -lengths
    turn = linear / lengths
    if np.abs(turn.T @ turn - np.eye(3)).max() <= NEGLIGIBLE:
        return fields | {"rotation": quaternion(turn)} | _write_scale(lengths), {}
    # linear = left · diag(scale) · right, where `left` and `right` may mirror at first.
    left, scale, right = np.linalg.svd(linear)
    if is_mirroring(left):
        left, scale = -left, -scale
    if is_mirroring(right):
        right, scale = -right, -scale
    fields |= {"rotation": quaternion(left)} | _write_scale(scale)
    return fields, {"rotation": quaternion(right)}


def quaternion(turn: FloatArray) -> list[float]:
    """The unit quaternion (x, y, z, w) of a rotation matrix (3, 3).

    References
    ----------
    Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1(3), 1978.
    """
    trace = np.trace(turn)
    # 4 times the squares of x, y, z and w.
    squares = np.append(1 - trace + 2 * np.diag(turn), 1 + trace)
    # `products` is 4 times the quaternion times its largest component: the fewest digits are lost.
    largest_index = int(np.argmax(squares))
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    products = np.array([x, y, z, squares[3]])
    if largest_index < 3:
        symmetric = turn + turn.T
        products = np.append(symmetric[largest_index], (x, y, z)[largest_index])
        products[largest_index] = squares[largest_index]
    unit: list[float] = (products / np.linalg.norm(products)).tolist()
    return unit


def _write_scale(scale: FloatArray) -> JsonObject:
    """The field `scale` of a node, unless all scalings are 1."""
    return {"scale": scale.tolist()} if np.abs(scale - 1).max() > NEGLIGIBLE else {}
