"""Compressed views: the same vertices and faces in another order, in fewer bytes."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oracles.gltf import CORNERS, Gltf, read_glb, read_gltf
from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME
from service.engine.build import build
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import quantize_mesh
from service.surface.examples.catalogue import find
from tests.clients.gltf_validator import list_issues
from tools.meshes import (
    add_attributes,
    add_overlays,
    build_sheet,
    build_silo,
    remove_faces,
    to_single,
)

pytest.importorskip("meshopt")

COMPRESSED = EncodeOptions(compression="meshopt")
QUANTIZED = EncodeOptions(quantize=True, compression="meshopt")
STEP = 2.0**-14

MESHES = {
    "parts": to_single(add_overlays(build_silo(24, 8)), origin=(1.0, 2.0, 3.0), up="z"),
    "colours": to_single(add_attributes(build_silo(24, 8), opacity=True)),
    "short": to_single(build_sheet(1)),
    "no faces": to_single(remove_faces(build_silo())),
    "overlays alone": to_single(remove_faces(add_overlays(build_silo()))),
}
each_mesh = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
both_options = pytest.mark.parametrize(
    "options", [COMPRESSED, QUANTIZED], ids=["floats", "integers"]
)


def prepare_mesh(mesh: Mesh, options: EncodeOptions) -> Mesh:
    """The mesh, with positions on a grid if the options quantize."""
    return quantize_mesh(mesh, STEP) if options.quantize else mesh


def remove_compression(options: EncodeOptions) -> EncodeOptions:
    return replace(options, compression="none")


def read_faces(gltf: Gltf, name: str, ignored: Iterable[str] = ()) -> set[tuple[Any, ...]]:
    """The faces at a node, each a tuple of the attribute values of its corners.

    Each triangle begins with its least corner, so equal triangles are equal tuples. The values of
    `ignored` attributes are omitted.
    """
    primitive = gltf.primitive(name)
    columns = [
        gltf.array(number).astype(np.float64)
        for key, number in sorted(primitive["attributes"].items())
        if key not in ignored
    ]
    corners = CORNERS[primitive["mode"]]
    vertices = list(map(tuple, np.hstack(columns).tolist()))
    faces = []
    for face in gltf.array(primitive["indices"]).reshape(-1, corners).tolist():
        rows = [vertices[k] for k in face]
        first = min(range(corners), key=rows.__getitem__) if corners == 3 else 0
        faces.append(tuple(rows[first:] + rows[:first]))
    assert len(set(faces)) == len(faces)
    return set(faces)


@both_options
@each_mesh
def test_decompressed_meshes_have_the_same_faces(mesh: Mesh, options: EncodeOptions) -> None:
    mesh = prepare_mesh(mesh, options)
    compressed = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    plain = read_glb(bytes(BY_NAME["glb"].encode(mesh, remove_compression(options))))
    # Quantized normals are rounded in another way if they are compressed.
    ignored = {"NORMAL"} if options.quantize else ()
    names = list_names(plain)
    assert list_names(compressed) == names
    for name in names:
        assert read_faces(compressed, name, ignored) == read_faces(plain, name, ignored)
    assert compressed.document["asset"] == plain.document["asset"]


def list_names(gltf: Gltf) -> list[str]:
    """The names of the nodes below the root; a file without faces and lines has no nodes."""
    return [node["name"] for node in gltf.document.get("nodes", ())[1:]]


def test_normals_are_within_a_tenth_of_a_degree() -> None:
    rows = np.random.default_rng(4).normal(size=(4225, 3))
    # Normals along an axis and along a diagonal are included. Of the 27 vectors with components
    # -1, 0 and 1, the vector 13 is zero, and is replaced.
    rows[:27] = np.indices((3, 3, 3)).reshape(3, -1).T - 1
    rows[13] = 1, 1e-6, -1e-6
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    mesh = quantize_mesh(replace(to_single(build_sheet(64)), normals=rows.astype(np.float32)), STEP)
    compressed = read_glb(bytes(BY_NAME["glb"].encode(mesh, QUANTIZED)))
    attributes = compressed.primitive("sheet")["attributes"]
    normals = compressed.values(attributes["NORMAL"])
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-4
    # Positions say which sample (i, j) of the sheet each vertex of the file is: two samples are
    # 1/64 apart, which is 256 steps.
    samples = compressed.array(attributes["POSITION"]).astype(int) // 256
    expected = rows[samples[:, 0] * 65 + samples[:, 1]]
    angles = np.degrees(2 * np.arcsin(np.linalg.norm(normals - expected, axis=1) / 2))
    assert 0.02 < angles.max() < 0.1


@both_options
def test_views_that_would_become_longer_are_not_compressed(options: EncodeOptions) -> None:
    """Random bits cannot be compressed."""
    rng = np.random.default_rng(6)
    mesh = to_single(add_attributes(build_sheet(40)))
    # Bits below 2^31 − 2^24 are those of finite numbers.
    noise = rng.integers(0, 2**31 - 2**24, (len(mesh.positions), 16), np.int32).view(np.float32)
    positions = rng.uniform(-1, 1, mesh.positions.shape).astype(np.float32)
    triangles = rng.permuted(mesh.triangles.ravel()).reshape(-1, 3)
    mesh = replace(mesh, positions=positions, triangles=triangles, attributes=(("noise", noise),))
    mesh = prepare_mesh(mesh, options)
    compressed = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    plain = read_glb(bytes(BY_NAME["glb"].encode(mesh, remove_compression(options))))
    assert len(compressed.buffer) < len(plain.buffer)
    views = compressed.document["bufferViews"]
    uncompressed_views = [view for view in views if "extensions" not in view]
    assert 0 < len(uncompressed_views) < len(views)
    assert read_faces(compressed, "sheet", {"NORMAL"}) == read_faces(plain, "sheet", {"NORMAL"})


@both_options
def test_the_validator_reports_only_that_it_does_not_know_the_extension(
    options: EncodeOptions, tmp_path: Path
) -> None:
    path = tmp_path / "model.glb"
    content = bytes(BY_NAME["glb"].encode(prepare_mesh(MESHES["parts"], options), options))
    # The extension is the last: after that for lines without shading, and that for quantization.
    pointer = "/extensionsUsed/" + ("2" if options.quantize else "1")
    assert summarize_issues(content, path) == [("UNSUPPORTED_EXTENSION", 2, pointer)]
    # A sheet has no lines. If every view is compressed, the validator finds no use of the buffer.
    content = bytes(
        BY_NAME["glb"].encode(prepare_mesh(to_single(build_sheet(20)), options), options)
    )
    pointer = "/extensionsUsed/" + ("1" if options.quantize else "0")
    assert summarize_issues(content, path) == [
        ("UNSUPPORTED_EXTENSION", 2, pointer),
        ("UNUSED_OBJECT", 2, "/buffers/0"),
    ]


def summarize_issues(content: bytes, path: Path) -> list[tuple[str, int, str]]:
    """Code, severity (2 is information) and pointer of each message of the validator."""
    return sorted(
        (issue["code"], issue["severity"], issue["pointer"]) for issue in list_issues(content, path)
    )


@both_options
def test_gltf_and_glb_have_the_same_buffer(options: EncodeOptions) -> None:
    mesh = prepare_mesh(MESHES["parts"], options)
    text = read_gltf(bytes(BY_NAME["gltf"].encode(mesh, options)))
    binary = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    # In a GLB file, the buffer is padded.
    assert text.buffer == binary.buffer[: len(text.buffer)]
    assert text.document["bufferViews"] == binary.document["bufferViews"]


def test_indices_of_more_than_65535_vertices_are_uint32() -> None:
    mesh = build(find("saddle").surface().lower(), MeshOptions((256, 256)), is_float32=True)
    compressed = read_glb(bytes(BY_NAME["glb"].encode(mesh, COMPRESSED)))
    primitive = compressed.primitive("saddle")
    indices = compressed.array(primitive["indices"])
    assert indices.dtype == np.uint32
    assert indices.max() == len(mesh.positions) - 1 == 66048
    corners = compressed.array(primitive["attributes"]["POSITION"])[indices.reshape(-1, 3)]
    expected = mesh.positions[mesh.triangles]
    # Faces have another order, so sums over their corners are compared in ascending order.
    sums, expected_sums = (np.sort(each.sum(axis=1), axis=0) for each in (corners, expected))
    assert np.allclose(sums, expected_sums, atol=1e-6)


def test_vertices_that_no_face_uses_come_last() -> None:
    triangles = np.array([[5, 2, 7], [7, 2, 1]], np.uint32)
    ordered_triangles, order = meshopt.order_faces(triangles, 10)
    assert sorted(order.tolist()) == list(range(10))
    assert order[4:].tolist() == [0, 3, 4, 6, 8, 9]
    faces = {tuple(np.roll(face, -face.argmin()).tolist()) for face in order[ordered_triangles]}
    assert faces == {(2, 7, 5), (1, 7, 2)}
    lines, order = meshopt.order_faces(np.array([[3, 1], [1, 0]], np.uint32), 4)
    assert order[lines].tolist() == [[3, 1], [1, 0]]
