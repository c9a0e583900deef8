"""A scene as glTF: each copy is a named node; the arrays of each distinct mesh are stored once.

A copy in another colour is another glTF mesh with the same accessors.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations.
"""

from service.encoders.content import MAX_LISTED_FACES, report_object
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
from service.encoders.gltf.nodes import split_matrices
from service.encoders.gltf.primitives import build_drawables
from service.engine.scenes.scene import Scene, count_parts, scene_parts
from service.surface.lowered import Color, GroupNode, PlacedModel


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
        # The parts of very many faces would not be listed.
        is_listed = scene.report.brep is None or count_parts(scene) <= MAX_LISTED_FACES
        report = report_object(scene.report, scene_parts(scene) if is_listed else ())
        return build_whole_document(scene.name, report, arrays, self.buffer, self.options)

    def _add_tree(self) -> list[int]:
        """Add the nodes of all copies, and those above them; returns the numbers of the first."""
        copies = self.scene.nodes
        tree = self.scene.tree or [
            GroupNode(copy.name, matrix=copy.matrix, copy=number)
            for number, copy in enumerate(copies)
        ]
        roots: list[int] = []
        inside: list[JsonObject] = []
        fields = split_matrices([each.matrix for each in tree])
        for each, (outer, inner) in zip(tree, fields, strict=True):
            number = len(self.nodes)
            node = self._add_node(each.name, outer, inner)
            inside.append(node)
            if each.copy is not None:
                self._add_copy(node, copies[each.copy], each.name)
            above = None if each.parent is None else inside[each.parent]
            (roots if above is None else above.setdefault("children", [])).append(number)
        return roots

    def _add_node(self, name: str, fields: JsonObject, child_fields: JsonObject) -> JsonObject:
        """Add a node, and a child of it if it has fields; returns the one that has the bodies."""
        node: JsonObject = {"name": name, **fields}
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
