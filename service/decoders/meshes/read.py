"""Reads the meshes of a file, as the document of one mesh with arrays in place of lists."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.decoders.format import FileLimits, Tree, build_file_error
from service.decoders.mesh_axes import check_range
from service.decoders.meshes import gltf, obj, off, ply, stl
from service.decoders.meshes.content import PlainFile, check_corners, check_indices
from service.decoders.meshes.library import load
from service.decoders.meshes.polygons import count_triangles, join_quads
from service.errors import InvalidRequest

_FORMS: Mapping[str, Callable[[bytes, FileLimits], PlainFile]] = {
    "obj": obj.write_plain,
    "off": off.write_plain,
    "ply": ply.write_plain,
    "stl": stl.write_plain,
}

_OPTIONS: Mapping[str, dict[str, bool]] = {
    "obj": {"group_material": False, "skip_materials": True},
    "ply": {"fix_texture": False, "skip_materials": True},
}


def read(name: str, content: bytes, limits: FileLimits) -> Tree:
    """The document of the mesh in a file: `vertices`, `faces` and, if the file has them, `normals`.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
    """
    if name in {"glb", "gltf"}:
        vertices, faces, normals = gltf.read(name, content, limits)
    else:
        vertices, faces, normals = _read_plain(name, _FORMS[name](content, limits))
    check_range(vertices)
    tree: Tree = {"vertices": vertices, "faces": faces}
    if normals is not None:
        # A normal that is not a number says as little as one of the length 0.
        normals[~np.isfinite(normals).all(axis=1)] = 0.0
        tree["normals"] = normals
    return tree


def _read_plain(name: str, plain: PlainFile) -> tuple[FloatArray, Ints, FloatArray | None]:
    """The arrays that trimesh finds in a plain file, which must be as long as the file says."""
    check_corners(plain.corners)
    options = dict(_OPTIONS.get(name, {}))
    if name == "obj":
        options["maintain_order"] = plain.vertices is not None
    try:
        loaded: Mapping[str, Any] = load(name, plain.content, **options)
        if name == "obj":
            (loaded,) = loaded["geometry"].values()
        vertices = np.ascontiguousarray(loaded["vertices"], np.float64)
        triangles = np.ascontiguousarray(loaded["faces"], np.intp)
    except (ValueError, LookupError, TypeError, OverflowError, ImportError):
        # For a text that is not in UTF-8 it looks for a library that would guess the encoding.
        raise _unreadable() from None
    count = len(vertices)
    if vertices.shape != (count, 3) or triangles.shape != (count_triangles(plain.corners), 3):
        raise _unreadable()
    if plain.vertices not in (None, count):
        raise _unreadable()
    check_indices(triangles, count)
    normals = loaded.get("vertex_normals")
    if normals is not None:
        normals = np.ascontiguousarray(normals, np.float64)
        normals = normals if normals.shape == vertices.shape else None
    return vertices, join_quads(triangles, plain.corners), normals


def _unreadable() -> InvalidRequest:
    return build_file_error(
        "The file does not have the numbers that it counts.",
        "something else in place of a number, or too few",
        "three numbers for each vertex, and whole ones for each face",
    )
