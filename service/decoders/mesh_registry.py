"""The registry of the files of meshes that clients give: triangles and polygons that anyone made.

These formats are no formats of surfaces: `service.decoders.registry` has those, under some of the
same names. A child process reads every file (`service.decoders.meshes`), with trimesh.
"""

# ruff: noqa: PLC0415

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

from service.decoders.format import Decoded, Decoder, FileLimits, check_kind

GLTF_NAMES = frozenset({"glb", "gltf"})
"""Formats whose coordinates are those of glTF: metres, and y is up."""


def _reader(name: str) -> Callable[[bytes, str | None, FileLimits], Decoded]:
    """The function `Decoder.decode` of a format; it imports the readers when a file needs them."""

    def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
        from service.decoders.meshes.read import read

        check_kind(kind, ())
        return Decoded(read(name, content, limits))

    return decode


def import_readers() -> None:
    """Imports all that the decoders need, in a child process."""
    import service.decoders.meshes.read  # noqa: F401
    from service.decoders.meshes.gltf_meshopt import find_library
    from service.decoders.meshes.library import import_trimesh

    find_library()
    import_trimesh()


def _mesh(
    name: str,
    title: str,
    about: str,
    *,
    media_type: str,
    memory_factor: float,
    is_binary: bool = True,
) -> Decoder:
    """The entry of a format."""
    return Decoder(
        name=name,
        title=title,
        media_type=media_type,
        suffixes=(name,),
        is_binary=is_binary,
        kinds=(),
        decode=_reader(name),
        about=about,
        memory_factor=memory_factor,
        base_memory=128 << 20,  # short numbers take more for each byte
        byte_seconds=4e-6,
        fields=(),
        child_bytes=-1,  # an empty file, too
        is_mesh=True,
    )


MESH_DECODERS: tuple[Decoder, ...] = (
    _mesh(
        "glb",
        "glTF 2.0, binary",
        "The triangles of all meshes of the scene, with its nodes applied. Integers as positions "
        "(KHR_mesh_quantization) are read and, with the extra `meshopt`, compressed views "
        "(EXT_meshopt_compression); Draco is refused. Lines, points, materials, skins and morph "
        "targets are left out.",
        media_type="model/gltf-binary",
        memory_factor=16,
    ),
    _mesh(
        "gltf",
        "glTF 2.0, JSON",
        "The same, as JSON whose buffers are in it as base64: no other file is opened.",
        media_type="model/gltf+json",
        memory_factor=16,
        is_binary=False,
    ),
    _mesh(
        "obj",
        "Polygons of Wavefront OBJ",
        "The faces (`f`) of all objects and groups, with their normals. Lines, points, curves, "
        "surfaces and materials are left out.",
        media_type="model/obj",
        memory_factor=40,
        is_binary=False,
    ),
    _mesh(
        "ply",
        "PLY",
        "The vertices and faces, of a text or of either binary form, with normals of vertices. "
        "Other elements and properties are left out.",
        media_type="model/x-ply",
        memory_factor=40,
    ),
    _mesh(
        "stl",
        "STL",
        "The triangles, binary or as text; each has three vertices of its own.",
        media_type="model/stl",
        memory_factor=16,
    ),
    _mesh(
        "off",
        "OFF",
        "The vertices and faces of a text; colours, normals and texture coordinates are left out.",
        media_type="model/x-off",
        memory_factor=40,
        is_binary=False,
    ),
)
"""All formats of meshes, in the order in which lists name them."""

MESH_BY_NAME: Mapping[str, Decoder] = MappingProxyType({d.name: d for d in MESH_DECODERS})
"""All formats of meshes by name."""

MESH_BY_SUFFIX: Mapping[str, Decoder] = MappingProxyType(
    {suffix: decoder for decoder in MESH_DECODERS for suffix in decoder.suffixes}
)
"""All formats of meshes by suffix, without a dot."""

MESH_BEGINNINGS: Mapping[str, re.Pattern[bytes]] = MappingProxyType(
    {
        "glb": re.compile(rb"glTF"),
        "gltf": re.compile(rb"(?:\xef\xbb\xbf)?\s*\{[^\0]*\"asset\""),
        "ply": re.compile(rb"ply\s+(?:comment|format|obj_info)"),
        "off": re.compile(rb"\s*(?:#[^\n]*\n\s*)*(?:ST)?C?N?OFF\s"),
        "stl": re.compile(rb"\s*solid\b"),
        "obj": re.compile(rb"(?:\s*(?:#[^\n]*|mtllib[^\n]*|[og] [^\n]*)\n)*\s*v\s"),
    }
)
"""How files begin, of those that can be known by this: a binary STL file cannot."""


def find_mesh_by_content(content: bytes) -> Decoder | None:
    """The decoder of a mesh file that begins with these bytes, if its format can be known."""
    start = content[:4096]
    names = (name for name, each in MESH_BEGINNINGS.items() if each.match(start))
    return next((MESH_BY_NAME[name] for name in names), None)
