"""glTF 2.0: the triangles of all meshes of a scene as one mesh, in the scene's coordinates.

Lines, points, materials, skins, morph targets and animations are left out. trimesh gets a GLB file
with the accessors of triangles alone, each mesh once; the nodes are applied to what it reads.

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations, 3.7 geometry.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from service.bases.arrays import AnyArray, FloatArray, Ints
from service.decoders.format import FileLimits, build_file_error
from service.decoders.meshes.content import check_corners, check_indices, check_size
from service.decoders.meshes.gltf_accessors import Accessors
from service.decoders.meshes.gltf_file import (
    JsonObject,
    extension_error,
    find_object,
    list_objects,
    parse_file,
    pick,
    whole,
)
from service.decoders.meshes.gltf_nodes import find_placed_meshes
from service.decoders.meshes.gltf_plain import FAN, STRIP, TRIANGLES, PlainGlb, Primitive
from service.decoders.meshes.library import load
from service.surface.placement import is_mirroring

DRACO = "KHR_draco_mesh_compression"


class Piece(NamedTuple):
    """The triangles of a primitive in the coordinates of its mesh; normals are None, or (n, 3)."""

    vertices: FloatArray
    triangles: Ints
    normals: FloatArray | None


def read(
    name: str, content: bytes, limits: FileLimits
) -> tuple[FloatArray, Ints, FloatArray | None]:
    """The vertices, the triangles and the normals, if all triangles have them, of a file.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
    """
    document, buffers = parse_file(name, content)
    accessors = Accessors(document, buffers)
    placed = find_placed_meshes(document, limits)
    meshes = list_objects(document, "meshes")
    primitives = {
        number: _find_primitives(pick(meshes, number), accessors)
        for number in dict.fromkeys(each.mesh for each in placed)
    }
    _check_sizes([primitives[each.mesh] for each in placed], accessors, limits)
    used = list(dict.fromkeys(one for several in primitives.values() for one in several))
    pieces = dict(zip(used, _read_pieces(used, accessors), strict=True))
    return _join(
        [_place(pieces[one], each.matrix) for each in placed for one in primitives[each.mesh]]
    )


def _find_primitives(mesh: JsonObject, accessors: Accessors) -> list[Primitive]:
    """The primitives of a mesh that have triangles."""
    found = []
    for each in list_objects(mesh, "primitives"):
        mode, attributes = whole(each.get("mode"), TRIANGLES), find_object(each, "attributes")
        if mode not in {TRIANGLES, STRIP, FAN} or "POSITION" not in attributes:
            continue
        position = whole(attributes["POSITION"])
        if DRACO in find_object(each, "extensions") and not accessors.has_bytes(position):
            raise extension_error()
        normal, indices = attributes.get("NORMAL"), each.get("indices")
        if normal is not None and accessors.count(normal) != accessors.count(position):
            message, got = "A primitive has not a normal for each vertex.", "another number"
            raise build_file_error(message, got, "a normal for each vertex")
        primitive = Primitive(
            position,
            None if normal is None else whole(normal),
            None if indices is None else whole(indices),
            mode,
        )
        if _count_triangles(primitive, accessors):
            found.append(primitive)
    return found


def _count_triangles(primitive: Primitive, accessors: Accessors) -> int:
    """The number of triangles of a primitive, by the number of its corners."""
    corners = accessors.count(
        primitive.position if primitive.indices is None else primitive.indices
    )
    if primitive.mode != TRIANGLES:
        return max(corners - 2, 0)
    if corners % 3:
        raise build_file_error("A triangle lacks a corner.", f"{corners} corners", "3 for each")
    return corners // 3


def _check_sizes(
    placed: Sequence[list[Primitive]], accessors: Accessors, limits: FileLimits
) -> None:
    """Refuse a scene with too many vertices or triangles, of which instances count each.

    Of vertices that several primitives share, each keeps one for a corner at most.
    """
    sizes: dict[Primitive, tuple[int, int]] = {}
    vertices = triangles = 0
    for several in placed:
        for one in several:
            if one not in sizes:
                count, own_triangles = (
                    accessors.count(one.position),
                    _count_triangles(one, accessors),
                )
                check_size(count, own_triangles, limits)
                sizes[one] = min(count, 3 * own_triangles), own_triangles
            vertices += sizes[one][0]
            triangles += sizes[one][1]
    check_corners(np.full(min(triangles, 1), 3))
    check_size(vertices, triangles, limits)


def _read_pieces(used: Sequence[Primitive], accessors: Accessors) -> list[Piece]:
    """The arrays that trimesh reads of these primitives."""
    plain = PlainGlb(accessors)
    divisors = [plain.add(one) for one in used]
    try:
        loaded: Mapping[str, Any] = load("glb", plain.write(), skip_materials=True)
    except (ValueError, LookupError, TypeError, AssertionError):
        message, needed = "The numbers of the file cannot be read.", "accessors of triangles"
        raise build_file_error(message, "other accessors", needed) from None
    return [
        _check_piece(mesh, *scale)
        for mesh, scale in zip(loaded["geometry"].values(), divisors, strict=True)
    ]


def _check_piece(mesh: Mapping[str, Any], divisor: int, normal_divisor: int) -> Piece:
    """The arrays of trimesh for a primitive, with integers divided by the largest of their type."""
    vertices, normals = mesh["vertices"], mesh.get("vertex_normals")
    triangles = np.ascontiguousarray(mesh["faces"], np.intp)
    check_indices(triangles, len(vertices))
    if len(vertices) > triangles.size:  # most of them belong to other primitives
        used, numbers = np.unique(triangles, return_inverse=True)
        triangles = numbers.reshape(triangles.shape)
        vertices, normals = vertices[used], None if normals is None else normals[used]
    positions = _divide(vertices, divisor)
    return Piece(
        positions, triangles, None if normals is None else _divide(normals, normal_divisor)
    )


def _divide(numbers: AnyArray, divisor: int) -> FloatArray:
    """Numbers as float64; those of normalized integers are at least −1, as the format says."""
    values = np.array(numbers, np.float64)
    return values if divisor == 1 else np.maximum(values / divisor, -1.0)


def _place(piece: Piece, matrix: FloatArray) -> Piece:
    """The triangles in the coordinates of the scene; a mirror image keeps its outside."""
    linear = matrix[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused later
        vertices = piece.vertices @ linear.T + matrix[:3, 3]
        triangles = piece.triangles[:, [0, 2, 1]] if is_mirroring(linear) else piece.triangles
        if piece.normals is None:
            return Piece(vertices, triangles, None)
        return Piece(vertices, triangles, piece.normals @ _find_normal_map(linear).T)


def _find_normal_map(linear: FloatArray) -> FloatArray:
    """A multiple of the inverse transpose of a linear map, by a factor that is not negative."""
    x, y, z = (linear / max(float(np.abs(linear).max()), np.finfo(float).tiny)).T
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)
    return -cofactors if x @ np.cross(y, z) < 0 else cofactors


def _join(pieces: Sequence[Piece]) -> tuple[FloatArray, Ints, FloatArray | None]:
    """All pieces as one mesh, one after another."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertices = np.concatenate([piece.vertices for piece in pieces])
    shifted = (piece.triangles + start for piece, start in zip(pieces, starts, strict=False))
    triangles = np.concatenate(list(shifted))
    normals = [piece.normals for piece in pieces if piece.normals is not None]
    return vertices, triangles, np.concatenate(normals) if len(normals) == len(pieces) else None
