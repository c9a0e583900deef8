"""A mesh as a glTF 2.0 document.

The root node has the name of the mesh and, if z is up, the rotation from z up to y up. Below the
root, every part with faces and every overlay is a named node with one mesh and with the local
origin as its translation. Every attribute has a buffer view of its own, aligned to 4 bytes.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations.
"""

from service.encoders.content import report_object
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.document import Z_UP_TO_Y_UP, File, build_whole_document, write_gltf
from service.encoders.gltf.primitives import build_drawables
from service.encoders.gltf.quantized import grid_transform
from service.engine.mesh.mesh_value import Mesh


def encode_gltf(mesh: Mesh, options: EncodeOptions) -> bytes:
    """The mesh as one glTF JSON document, which contains the buffer as base64.

    Raises
    ------
    UnsupportedByFormat
        The mesh has quads.
    """
    return write_gltf(*build_document(mesh, options))


def node_transform(mesh: Mesh) -> JsonObject:
    """The fields `translation` and `scale` of a node: from stored to model coordinates."""
    if mesh.step:
        return grid_transform(mesh)
    return {"translation": mesh.origin.tolist()} if mesh.origin.any() else {}


def build_document(mesh: Mesh, options: EncodeOptions) -> File:
    """The glTF document of a mesh, and its buffer."""
    buffer = BufferBuilder()
    pairs = [(each, each.material()) for each in build_drawables(mesh, buffer, options)]
    materials: list[JsonObject] = []
    for _, material in pairs:
        if material not in materials:
            materials.append(material)
    meshes: list[JsonObject] = [
        {
            "name": drawable.name,
            "primitives": [drawable.primitive | {"material": materials.index(material)}],
        }
        for drawable, material in pairs
    ]
    transform = node_transform(mesh)
    nodes = [{"name": m["name"], "mesh": k, **transform} for k, m in enumerate(meshes)]

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
