"""The nodes of a glTF scene: which meshes it shows, and the matrix of each.

References
----------
Khronos, glTF 2.0 Specification: 3.5 scenes, nodes and transformations.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import FileLimits, build_malformed_error, check_entities
from service.decoders.meshes.gltf_file import (
    JsonObject,
    extension_error,
    find_object,
    list_objects,
    pick,
    whole,
)

INSTANCING = "EXT_mesh_gpu_instancing"

_PLACEMENT = frozenset({"matrix", "rotation", "scale", "translation"})
"""The fields of a node by which it places what is below it."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacedMesh:
    """The number of a mesh, and the matrix (4, 4) from its coordinates to those of the scene."""

    mesh: int
    matrix: FloatArray


def find_placed_meshes(document: JsonObject, limits: FileLimits) -> list[PlacedMesh]:
    """The meshes of the scene that the file shows, in the order of its nodes, depth first.

    Without a scene these are the nodes that are below no other.

    Raises
    ------
    MalformedBody
        A node is below two others, or below itself: so each is visited once.
    TooLarge
    """
    nodes = list_objects(document, "nodes")
    check_entities(len(nodes), limits)
    scenes = list_objects(document, "scenes")
    if scenes:
        roots = _list_numbers(pick(scenes, document.get("scene", 0)), "nodes", nodes)
    else:
        below = {child for node in nodes for child in _list_numbers(node, "children", nodes)}
        roots = [number for number in range(len(nodes)) if number not in below]
    found, visited = list[PlacedMesh](), set[int]()
    identity = np.eye(4)
    waiting = [(number, identity) for number in reversed(roots)]
    while waiting:
        number, outer = waiting.pop()
        node = nodes[number]
        if number in visited:
            message, needed = "A node is below two others, or below itself.", "a tree of nodes"
            raise build_malformed_error(message, "a node twice", needed)
        visited.add(number)
        if INSTANCING in find_object(node, "extensions"):
            raise extension_error()
        matrix = outer
        if not _PLACEMENT.isdisjoint(node):
            with np.errstate(over="ignore", invalid="ignore"):  # the vertices are checked
                matrix = outer @ _read_matrix(node)
        if "mesh" in node:
            found.append(PlacedMesh(whole(node["mesh"]), matrix))
        children = _list_numbers(node, "children", nodes)
        waiting += [(child, matrix) for child in reversed(children)]
    return found


def _list_numbers(item: JsonObject, name: str, nodes: list[JsonObject]) -> list[int]:
    """The numbers of nodes in a list of an object."""
    numbers = item.get(name, [])
    if not isinstance(numbers, list) or any(whole(each) >= len(nodes) for each in numbers):
        needed = f"numbers less than {len(nodes)}"
        raise build_malformed_error("A list of nodes names other nodes.", "others", needed)
    return numbers


def _read_matrix(node: JsonObject) -> FloatArray:
    """The matrix of a node to the one above it: its own, or translation · rotation · scale."""
    if "matrix" in node:
        return _read_numbers(node["matrix"], 16).reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        matrix[:3, :3] = _turn(_read_numbers(node["rotation"], 4))
    if "scale" in node:
        matrix[:3, :3] *= _read_numbers(node["scale"], 3)
    if "translation" in node:
        matrix[:3, 3] = _read_numbers(node["translation"], 3)
    return matrix


def _read_numbers(value: object, count: int) -> FloatArray:
    """A list of this many finite numbers."""
    numbers = value if isinstance(value, list) else []
    if len(numbers) == count and set(map(type, numbers)) <= {int, float}:
        try:
            array = np.array(numbers, np.float64)
        except OverflowError:
            array = np.full(count, np.inf)
        if np.isfinite(array).all():
            return array
    needed = f"{count} finite numbers"
    raise build_malformed_error("The placement of a node is wrong.", "other values", needed)


def _turn(quaternion: FloatArray) -> FloatArray:
    """The rotation matrix (3, 3) of a quaternion (x, y, z, w) of any length above 0."""
    square = float(quaternion @ quaternion)
    if not square > 0:
        raise build_malformed_error("A rotation has no length.", "0", "a unit quaternion")
    x, y, z, w = quaternion
    return np.eye(3) + (2 / square) * np.array(
        [
            [-(y * y + z * z), x * y - z * w, x * z + y * w],
            [x * y + z * w, -(x * x + z * z), y * z - x * w],
            [x * z - y * w, y * z + x * w, -(x * x + y * y)],
        ]
    )
