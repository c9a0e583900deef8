"""A scene as glTF: one named node for each copy; the arrays of each distinct mesh are stored once.

A node has a translation, a rotation and scalings (3.5.3), but no shear. Any linear map is the
product of two such maps (singular values, L = U S Vᵀ): a shearing copy is a node with U and S
around a node with Vᵀ. Mirrored copies have a negative scaling; readers then reverse the faces'
winding (3.7.4).

A copy in another colour has another glTF mesh with the same accessors.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations, 3.7.4 instantiation.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.content import report_object
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.document import Z_UP_TO_Y_UP, File, build_whole_document, textual
from service.encoders.gltf.glb import binary
from service.encoders.gltf.mesh_document import node_place
from service.encoders.gltf.primitives import Piece, pieces
from service.engine.scenes.scene import Scene, scene_parts
from service.surface.lowered import Color, PlacedModel

SAME = 1e-12
"""The largest cosine of columns that count as perpendicular, and the largest difference from 1 of a
scaling that counts as 1; rounding errors are 1e-16."""


def encode_glb_scene(scene: Scene, options: EncodeOptions) -> bytes:
    """The binary form; raises `UnsupportedByFormat` if a mesh has quads."""
    return bytes(binary(*_Document(scene, options).finish()))


def encode_gltf_scene(scene: Scene, options: EncodeOptions) -> bytes:
    """The JSON form; raises `UnsupportedByFormat` if a mesh has quads."""
    return textual(*_Document(scene, options).finish())


class _Document:
    """Builds a document: arrays of nodes, meshes and materials that only grow."""

    def __init__(self, scene: Scene, options: EncodeOptions) -> None:
        self.scene, self.options = scene, options
        self.buffer = BufferBuilder()
        self.pieces = [list(pieces(mesh, self.buffer, options)) for mesh in scene.meshes]
        self.places = [node_place(mesh) for mesh in scene.meshes]
        self.nodes: list[JsonObject] = []
        self.meshes: list[JsonObject] = []
        self.materials: list[JsonObject] = []
        self._mesh_numbers: dict[tuple[int, int, Color | None], int] = {}
        self._material_numbers: dict[tuple[str, bool, Color | None], int] = {}

    def finish(self) -> File:
        """The document with a node for each copy, and its buffer."""
        scene = self.scene
        root: JsonObject = {"name": scene.name}
        if scene.up == "z":
            root["rotation"] = Z_UP_TO_Y_UP
        self.nodes.append(root)
        root["children"] = [self._copy(member) for member in scene.nodes]
        arrays: JsonObject = {
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
        }
        report = report_object(scene.report, scene_parts(scene))
        return build_whole_document(scene.name, report, arrays, self.buffer, self.options)

    def _copy(self, member: PlacedModel) -> int:
        """The node of one copy, with child nodes if it has several pieces."""
        number = len(self.nodes)
        outer, inner = split_matrix(member.matrix)
        node: JsonObject = {"name": member.name, **outer}
        self.nodes.append(node)
        if inner:
            node["children"] = [len(self.nodes)]
            node = inner
            self.nodes.append(node)
        model_pieces = self.pieces[member.model]
        place = self.places[member.model]
        if len(model_pieces) == 1 and not place:
            node["mesh"] = self._mesh(member, 0, member.name)
        elif model_pieces:
            node["children"] = list(range(len(self.nodes), len(self.nodes) + len(model_pieces)))
            self.nodes += [
                {"name": piece.name, "mesh": self._mesh(member, k, piece.name), **place}
                for k, piece in enumerate(model_pieces)
            ]
        return number

    def _mesh(self, member: PlacedModel, k: int, name: str) -> int:
        """The mesh of piece k in the colour of a copy; the first copy names it."""
        piece = self.pieces[member.model][k]
        color = None if piece.mesh is None else piece.color or member.color
        key = (member.model, k, color)
        if key not in self._mesh_numbers:
            self._mesh_numbers[key] = len(self.meshes)
            primitive = piece.primitive | {"material": self._material(piece, color)}
            self.meshes.append({"name": name, "primitives": [primitive]})
        return self._mesh_numbers[key]

    def _material(self, piece: Piece, color: Color | None) -> int:
        material = piece.material(color)
        key = (str(material["name"]), "alphaMode" in material, color)
        if key not in self._material_numbers:
            self._material_numbers[key] = len(self.materials)
            self.materials.append(material)
        return self._material_numbers[key]


def split_matrix(matrix: FloatArray | None) -> tuple[JsonObject, JsonObject]:
    """Translation, rotation and scalings of a node, and of an inner node if the map has shear."""
    if matrix is None:
        return {}, {}
    shift, linear = matrix[:3, 3], matrix[:3, :3]
    place: JsonObject = {"translation": shift.tolist()} if shift.any() else {}
    if not (linear - np.diag(np.diag(linear))).any():
        return place | dict(_write_scale(np.diag(linear))), {}
    lengths = np.sqrt((linear**2).sum(axis=0))
    if np.linalg.det(linear) < 0:
        lengths = -lengths
    turn = linear / lengths
    if np.abs(turn.T @ turn - np.eye(3)).max() <= SAME:
        return place | {"rotation": quaternion(turn)} | dict(_write_scale(lengths)), {}
    outer, scale, inner = np.linalg.svd(linear)
    if np.linalg.det(outer) < 0:
        outer, scale = -outer, -scale
    if np.linalg.det(inner) < 0:
        inner, scale = -inner, -scale
    place |= {"rotation": quaternion(outer)} | dict(_write_scale(scale))
    return place, {"rotation": quaternion(inner)}


def quaternion(turn: FloatArray) -> list[float]:
    """Unit quaternion (x, y, z, w) of a rotation matrix.

    References
    ----------
    Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1(3), 1978.
    """
    trace = np.trace(turn)
    squares = np.append(1 - trace + 2 * np.diag(turn), 1 + trace)
    # The largest component is the root of its square, the others are quotients of products by it.
    largest = int(np.argmax(squares))
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    products = np.array([x, y, z, squares[3]])
    if largest < 3:
        symmetric = turn + turn.T
        products = np.append(symmetric[largest], (x, y, z)[largest])
        products[largest] = squares[largest]
    unit: list[float] = (products / np.linalg.norm(products)).tolist()
    return unit


def _write_scale(scale: FloatArray) -> Iterator[tuple[str, list[float]]]:
    if np.abs(scale - 1).max() > SAME:
        yield "scale", scale.tolist()
