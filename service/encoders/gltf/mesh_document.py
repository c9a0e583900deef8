"""A mesh as a glTF 2.0 document, and as one JSON text.

One root node has the name of the mesh and the rotation from z up to y up; below it every part and
every overlay is a named node with one mesh, translated by the local origin. All buffer views are
planar and aligned to 4 bytes.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations.
"""

from service.encoders.content import report_object
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.document import Z_UP_TO_Y_UP, File, build_whole_document, textual
from service.encoders.gltf.primitives import pieces
from service.encoders.gltf.quantized import grid_place
from service.engine.mesh.mesh_value import Mesh


def encode_gltf(mesh: Mesh, options: EncodeOptions) -> bytes:
    """The JSON form, its buffer inside it as base64.

    Raises
    ------
    UnsupportedByFormat
        If the mesh has quads.
    """
    return textual(*build_document(mesh, options))


def node_place(mesh: Mesh) -> JsonObject:
    """Translation and scaling of a node, from stored positions to model coordinates."""
    if mesh.step and (len(mesh.positions) or mesh.overlays):
        return grid_place(mesh)
    return {"translation": mesh.origin.tolist()} if mesh.origin.any() else {}


def build_document(mesh: Mesh, options: EncodeOptions) -> File:
    """The document, and its buffer."""
    buffer = BufferBuilder()
    pairs = [(piece, piece.material()) for piece in pieces(mesh, buffer, options)]
    materials: list[JsonObject] = []
    for _, material in pairs:
        if material not in materials:
            materials.append(material)
    meshes: list[JsonObject] = [
        {
            "name": piece.name,
            "primitives": [piece.primitive | {"material": materials.index(material)}],
        }
        for piece, material in pairs
    ]
    place = node_place(mesh)
    nodes = [{"name": m["name"], "mesh": k, **place} for k, m in enumerate(meshes)]

    root: JsonObject = {"name": mesh.name, "children": list(range(1, len(nodes) + 1))}
    if mesh.up == "z":
        root["rotation"] = Z_UP_TO_Y_UP
    arrays: JsonObject = {
        "nodes": [root, *nodes] if nodes else [],
        "meshes": meshes,
        "materials": materials,
    }
    return build_whole_document(
        mesh.name, report_object(mesh.report, mesh.parts), arrays, buffer, options
    )
