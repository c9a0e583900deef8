"""Files that the service or trimesh writes are read as the mesh that was written."""

import json
from io import BytesIO
from typing import Any, Literal

import numpy as np
import pytest
import trimesh

from service.decoders.child import read_file
from service.decoders.mesh_axes import undo_root
from service.decoders.mesh_registry import GLTF_NAMES, MESH_BY_NAME, find_mesh_by_content
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.mesh import render
from service.schemas.document import DocumentLimits
from service.schemas.meshes import MeshDefinition
from service.schemas.validation import parse_request, validate_document
from service.surface.examples.catalogue import find
from service.surface.given_mesh import GivenMesh, QuadDiagonal
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sizes import SurfaceKind
from tests.decoders.meshes.files import LIMITS, read, refuse
from tools.hostile.gltf import write_glb

COMPRESSIONS: tuple[Literal["none", "meshopt"], ...] = ("none", "meshopt")

SLOW = pytest.mark.slow

SINGLE = 2.0**-21
"""Some roundings of a float32, as a share of the largest coordinate."""


def encode(
    surface: SurfaceKind,
    name: str,
    faces: Literal["triangles", "quads"] = "triangles",
    options: EncodeOptions | None = None,
) -> bytes:
    mesh_options = MeshOptions(resolution=(5, 4), faces=faces)
    return render(surface, mesh_options, BY_NAME[name], options or EncodeOptions())


def read_json(
    surface: SurfaceKind, faces: Literal["triangles", "quads"] = "triangles"
) -> GivenMesh:
    """The mesh as the service writes it in JSON: in float64, and in the surface's coordinates."""
    answer = encode(surface, "json", faces)
    return parse_request(MeshDefinition, answer, DocumentLimits()).to_mesh("02")


def sort_triangles(mesh: GivenMesh) -> list[list[float]]:
    """The coordinates of the corners of each triangle, in an order that depends on them alone."""
    return sorted(mesh.corners.reshape(-1, 9).tolist())


def turn_triangles(mesh: GivenMesh) -> list[list[list[float]]]:
    """The triangles, each from its least corner on, in an order that depends on them alone."""
    turned = []
    for corners in mesh.corners.tolist():
        first = corners.index(min(corners))
        turned.append(corners[first:] + corners[:first])
    return sorted(turned)


def assert_same(mesh: GivenMesh, expected: GivenMesh, share: float) -> None:
    """The corners of all triangles are equal, up to a share of the largest coordinate."""
    atol = share * float(np.abs(expected.positions).max())
    np.testing.assert_allclose(mesh.corners, expected.corners, rtol=0, atol=atol)
    if mesh.normals is not None and expected.normals is not None:
        found, wanted = mesh.normals[mesh.triangles], expected.normals[expected.triangles]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", MESH_BY_NAME)
@pytest.mark.parametrize("title", ["utah-teapot", "torus", "cone"])
def test_files_of_the_service_are_read(name: str, title: str) -> None:
    surface = find(title).surface()
    mesh = read(name, encode(surface, name))
    if name in GLTF_NAMES:
        mesh = undo_root(mesh, surface.lower().up, None)
    expected = read_json(surface)
    assert_same(mesh, expected, 0 if name in {"obj", "ply", "off"} else SINGLE)
    assert (mesh.normals is None) == (name in {"stl", "off"})


@pytest.mark.parametrize("diagonal", ["02", "13"])
@pytest.mark.parametrize("name", ["obj", "ply", "off"])
@pytest.mark.parametrize("title", ["utah-teapot", "cone"])
def test_quads_are_divided_along_the_diagonal(
    name: str, title: str, diagonal: QuadDiagonal
) -> None:
    surface = find(title).surface()
    answer = encode(surface, "json", "quads")
    expected = parse_request(MeshDefinition, answer, DocumentLimits()).to_mesh(diagonal)
    mesh = read(name, encode(surface, name, "quads"), diagonal)
    # In JSON faces follow part by part; in PLY and OFF the quads are first.
    assert sort_triangles(mesh) == sort_triangles(expected)


def test_a_text_of_stl_is_read_as_the_binary_file() -> None:
    surface = find("torus").surface()
    text = encode(surface, "stl", options=EncodeOptions(stl="ascii"))
    binary = read("stl", encode(surface, "stl"))
    assert_same(read("stl", text), binary, SINGLE)
    several = text.replace(b"solid surface", b"solid a vertex of facets")
    two = read("stl", several + several)
    assert_same(GivenMesh(two.positions, two.triangles[: len(binary.triangles)]), binary, SINGLE)
    assert len(two.triangles) == 2 * len(binary.triangles)


def test_quantized_glb_is_read() -> None:
    surface = find("utah-teapot").surface()
    mesh = read("glb", encode(surface, "glb", options=EncodeOptions(quantize=True)))
    expected = read_json(surface)
    mesh = undo_root(mesh, surface.lower().up, None)
    # One step of the grid, in 16 bits, and normals in 16 bits.
    atol = float(np.ptp(expected.positions, axis=0).max()) / 2**15
    np.testing.assert_allclose(mesh.corners, expected.corners, rtol=0, atol=atol)
    assert mesh.normals is not None
    assert expected.normals is not None
    np.testing.assert_allclose(
        mesh.normals[mesh.triangles], expected.normals[expected.triangles], rtol=0, atol=1e-4
    )


@pytest.mark.parametrize("quantize", [False, True])
def test_compressed_glb_is_read(quantize: bool) -> None:
    """The triangles are in another order, and each may begin with another corner."""
    surface = find("utah-teapot").surface()
    plain, packed = (
        read(
            "glb",
            encode(
                surface,
                "glb",
                options=EncodeOptions(quantize=quantize, compression=compression),
            ),
        )
        for compression in COMPRESSIONS
    )
    assert turn_triangles(packed) == turn_triangles(plain)
    assert packed.normals is not None
    lengths = np.linalg.norm(packed.normals, axis=1)
    np.testing.assert_allclose(lengths, 1, rtol=0, atol=1e-3)


def test_damaged_views_are_refused() -> None:
    options = EncodeOptions(compression="meshopt")
    content = encode(find("torus").surface(), "glb", options=options)
    length = 20 + int.from_bytes(content[12:16], "little")
    document = json.loads(content[20:length])
    views = [view for view in document["bufferViews"] if "extensions" in view]
    fields = views[0]["extensions"]["EXT_meshopt_compression"]
    binary = content[length + 8 :]
    assert len(read("glb", write_glb(document, binary)).triangles)
    for name, value, code in (
        ("count", 10**12, "malformed_file"),
        ("count", fields["count"] - 1, "malformed_file"),
        ("byteStride", 300, "malformed_body"),
        ("byteOffset", len(binary), "malformed_file"),
        ("byteLength", 3, "malformed_file"),
        ("mode", "OTHER", "malformed_body"),
        ("filter", "OTHER", "malformed_body"),
        ("buffer", 9, "malformed_file"),
    ):
        old = fields.get(name)
        fields[name] = value
        assert refuse("glb", write_glb(document, binary)) == code
        fields[name] = old
        if old is None:
            del fields[name]
    noise = bytes(binary[k] ^ 0xFF for k in range(len(binary)))
    assert refuse("glb", write_glb(document, noise)) in {"malformed_file", "index_out_of_range"}


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("metres", [None, 0.001, 0.3048])
def test_the_root_of_a_glb_is_undone(up: str, metres: float | None) -> None:
    """Members are placed by rotation and shear, and mirrored; the unit is not the metre."""
    turned = np.eye(4)
    turned[:3] = [[0.6, -0.8, 0, 50], [0.8, 0.6, 0.25, -7], [0, 0, 2, 1e4]]
    mirrored = np.diag([-1.0, 1, 1, 1])
    torus = find("torus").surface()
    members = tuple(Member(torus, matrix=matrix) for matrix in (None, turned, mirrored))
    group = GroupSurface(members, up=up, metres_per_unit=metres)  # type: ignore[arg-type]
    mesh = undo_root(read("glb", encode(group, "glb")), up, metres)  # type: ignore[arg-type]
    expected = read_json(group)
    assert len(mesh.triangles) == len(expected.triangles)
    # Near 10,000 a member has its own origin, so float32 rounds its size and not its place.
    near = slice(0, len(mesh.triangles) // 3)
    for part in (near, slice(None)):
        found, wanted = mesh.corners[part], expected.corners[part]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=4 * SINGLE)
    assert mesh.normals is not None
    assert expected.normals is not None
    found, wanted = (
        each / np.linalg.norm(each, axis=-1, keepdims=True)
        for each in (mesh.normals[mesh.triangles], expected.normals[expected.triangles])
    )
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5)


def test_a_mesh_may_be_too_large_in_the_unit_of_the_surface() -> None:
    mesh = GivenMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1e38, 0]]), np.array([[0, 1, 2]]))
    assert undo_root(mesh, "z", 1000.0).positions.tolist()[2] == [0, 0, 1e35]
    with pytest.raises(InvalidRequest) as caught:
        undo_root(mesh, "z", 1e-3)
    assert caught.value.issues[0].code == "coordinate_too_large"


@pytest.mark.parametrize("name", ["glb", "obj", "ply", "ply_ascii", "stl", "stl_ascii", "off"])
def test_files_of_trimesh_are_read(name: str) -> None:
    box: Any = trimesh.creation.icosphere(subdivisions=2)
    box.visual.vertex_colors = np.full((len(box.vertices), 4), 200, np.uint8)
    kind = name.partition("_")[0]
    if name == "ply_ascii":
        content = box.export(file_type="ply", encoding="ascii")
    elif name == "glb":
        scene: Any = trimesh.Scene(box)
        content = scene.export(file_type="glb")
    else:
        content = box.export(file_type=name)
    mesh = read(kind, content)
    expected = GivenMesh(np.array(box.vertices), np.array(box.faces))
    assert_same(mesh, expected, 0 if name == "stl_ascii" else 1e-6)


@pytest.mark.parametrize(
    "name", [name if name == "glb" else pytest.param(name, marks=SLOW) for name in MESH_BY_NAME]
)
def test_a_child_reads_what_this_process_reads(name: str) -> None:
    """Its trimesh finds no other library, and it can open no file."""
    surface = find("torus").surface()
    content = encode(surface, name)
    tree = read_file(MESH_BY_NAME[name], content, None, LIMITS).tree
    mesh = validate_document(MeshDefinition, tree).to_mesh("02")
    assert_same(mesh, read(name, content), 0)


def test_formats_are_known_by_their_beginnings() -> None:
    surface = find("torus").surface()
    for name, decoder in MESH_BY_NAME.items():
        found = find_mesh_by_content(encode(surface, name))
        assert found == (None if name == "stl" else decoder)  # binary STL begins with anything
    text = encode(surface, "stl", options=EncodeOptions(stl="ascii"))
    assert find_mesh_by_content(text) == MESH_BY_NAME["stl"]
    assert BytesIO(text).readline() == b"solid surface\n"
