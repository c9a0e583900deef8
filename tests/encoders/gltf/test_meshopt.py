"""Compressed views: the same numbers in another order, smaller, and read by others."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME
from service.engine.build import build
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import quantize_mesh
from service.surface.examples import find
from tests.clients.gltf_validator import list_issues
from tests.encoders.gltf.reader import Gltf, read_glb, read_gltf
from tests.meshes import (
    add_attributes,
    add_overlays,
    build_sheet,
    build_silo,
    remove_faces,
    to_single,
)

pytest.importorskip("meshopt")

COMPRESSED = EncodeOptions(compression="meshopt")
BOTH = EncodeOptions(quantize=True, compression="meshopt")
STEP = 2.0**-14

MESHES = {
    "parts": to_single(add_overlays(build_silo(24, 8)), origin=(1.0, 2.0, 3.0), up="z"),
    "colours": to_single(add_attributes(build_silo(24, 8), opacity=True)),
    "short": to_single(build_sheet(1)),
    "no faces": to_single(remove_faces(build_silo())),
    "overlays alone": to_single(remove_faces(add_overlays(build_silo()))),
}
each_mesh = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
each_form = pytest.mark.parametrize("options", [COMPRESSED, BOTH], ids=["floats", "integers"])


def prepare_mesh(mesh: Mesh, options: EncodeOptions) -> Mesh:
    return quantize_mesh(mesh, STEP) if options.quantize else mesh


def without_compression(options: EncodeOptions) -> EncodeOptions:
    return replace(options, compression="none")


def read_faces(gltf: Gltf, name: str, without: Iterable[str] = ()) -> set[tuple[Any, ...]]:
    """Faces as the numbers of their corners; each begins with its least corner."""
    primitive = gltf.primitive(name)
    columns = [
        gltf.array(number).astype(np.float64)
        for key, number in sorted(primitive["attributes"].items())
        if key not in without
    ]
    corners = {1: 2, 4: 3}[primitive["mode"]]
    vertices = list(map(tuple, np.hstack(columns).tolist()))
    result = []
    for face in gltf.array(primitive["indices"]).reshape(-1, corners).tolist():
        rows = [vertices[k] for k in face]
        first = min(range(corners), key=rows.__getitem__) if corners == 3 else 0
        result.append(tuple(rows[first:] + rows[:first]))
    assert len(set(result)) == len(result)
    return set(result)


@each_form
@each_mesh
def test_decompressed_it_is_the_same_mesh(mesh: Mesh, options: EncodeOptions) -> None:
    mesh = prepare_mesh(mesh, options)
    small = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    plain = read_glb(bytes(BY_NAME["glb"].encode(mesh, without_compression(options))))
    lossy = {"NORMAL"} if options.quantize else ()
    names = [node["name"] for node in plain.document.get("nodes", [{}])[1:]]
    assert [node["name"] for node in small.document.get("nodes", [{}])[1:]] == names
    for name in names:
        assert read_faces(small, name, lossy) == read_faces(plain, name, lossy)
    assert small.document["asset"] == plain.document["asset"]


def test_normals_are_within_a_tenth_of_a_degree() -> None:
    rows = np.random.default_rng(4).normal(size=(4225, 3))
    # Normals along an axis and along a diagonal are included.
    rows[:27] = np.indices((3, 3, 3)).reshape(3, -1).T - 1
    rows[13] = 1, 1e-6, -1e-6
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    mesh = quantize_mesh(replace(to_single(build_sheet(64)), normals=rows.astype(np.float32)), STEP)
    small = read_glb(bytes(BY_NAME["glb"].encode(mesh, BOTH)))
    attributes = small.primitive("sheet")["attributes"]
    result = small.values(attributes["NORMAL"])
    assert np.abs(np.linalg.norm(result, axis=1) - 1).max() < 1e-4
    # The vertex of the sheet for each vertex of the file.
    places = small.array(attributes["POSITION"]).astype(int) // 256
    expected = rows[places[:, 0] * 65 + places[:, 1]]
    apart = np.degrees(2 * np.arcsin(np.linalg.norm(result - expected, axis=1) / 2))
    assert 0.02 < apart.max() < 0.1


@each_form
def test_noise_is_not_made_longer(options: EncodeOptions) -> None:
    """Views that do not compress are stored unchanged."""
    rng = np.random.default_rng(6)
    mesh = to_single(add_attributes(build_sheet(40)))
    noise = rng.integers(0, 2**31 - 2**24, (len(mesh.positions), 16), np.int32).view(np.float32)
    positions = rng.uniform(-1, 1, mesh.positions.shape).astype(np.float32)
    triangles = rng.permuted(mesh.triangles.ravel()).reshape(-1, 3)
    mesh = replace(mesh, positions=positions, triangles=triangles, attributes=(("noise", noise),))
    mesh = prepare_mesh(mesh, options)
    small = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    plain = read_glb(bytes(BY_NAME["glb"].encode(mesh, without_compression(options))))
    assert len(small.buffer) < len(plain.buffer)
    views = small.document["bufferViews"]
    kept = [view for view in views if "extensions" not in view]
    assert 0 < len(kept) < len(views)
    assert read_faces(small, "sheet", {"NORMAL"}) == read_faces(plain, "sheet", {"NORMAL"})


@each_form
def test_the_validator_reports_the_unknown_extension(
    options: EncodeOptions, tmp_path: Path
) -> None:
    path = tmp_path / "model.glb"
    content = bytes(BY_NAME["glb"].encode(prepare_mesh(MESHES["parts"], options), options))
    unknown = "/extensionsUsed/" + ("2" if options.quantize else "1")
    assert summarize_issues(content, path) == [("UNSUPPORTED_EXTENSION", 2, unknown)]
    # If every view is compressed, the validator finds no use of the buffer.
    content = bytes(
        BY_NAME["glb"].encode(prepare_mesh(to_single(build_sheet(20)), options), options)
    )
    unknown = "/extensionsUsed/" + ("1" if options.quantize else "0")
    assert summarize_issues(content, path) == [
        ("UNSUPPORTED_EXTENSION", 2, unknown),
        ("UNUSED_OBJECT", 2, "/buffers/0"),
    ]


def summarize_issues(content: bytes, path: Path) -> list[tuple[str, int, str]]:
    """Code, severity (2: for information) and place of each message of the validator."""
    return sorted(
        (issue["code"], issue["severity"], issue["pointer"]) for issue in list_issues(content, path)
    )


@each_form
def test_the_json_form_holds_the_same(options: EncodeOptions) -> None:
    mesh = prepare_mesh(MESHES["parts"], options)
    text = read_gltf(bytes(BY_NAME["gltf"].encode(mesh, options)))
    binary = read_glb(bytes(BY_NAME["glb"].encode(mesh, options)))
    assert text.buffer == binary.buffer[: len(text.buffer)]
    assert text.document["bufferViews"] == binary.document["bufferViews"]


def test_more_than_65535_vertices_have_long_indices() -> None:
    mesh = build(find("saddle").surface().lower(), MeshOptions((256, 256)), single=True)
    small = read_glb(bytes(BY_NAME["glb"].encode(mesh, COMPRESSED)))
    primitive = small.primitive("saddle")
    indices = small.array(primitive["indices"])
    assert indices.dtype == np.uint32
    assert indices.max() == len(mesh.positions) - 1 == 66048
    corners = small.array(primitive["attributes"]["POSITION"])[indices.reshape(-1, 3)]
    expected = mesh.positions[mesh.triangles]
    one, other = (np.sort(each.sum(axis=1), axis=0) for each in (corners, expected))
    assert np.allclose(one, other, atol=1e-6)


def test_vertices_that_no_face_uses_come_last() -> None:
    triangles = np.array([[5, 2, 7], [7, 2, 1]], np.uint32)
    ordered, order = meshopt.order_faces(triangles, 10)
    assert sorted(order.tolist()) == list(range(10))
    assert order[4:].tolist() == [0, 3, 4, 6, 8, 9]
    back = {tuple(np.roll(face, -face.argmin()).tolist()) for face in order[ordered]}
    assert back == {(2, 7, 5), (1, 7, 2)}
    lines, order = meshopt.order_faces(np.array([[3, 1], [1, 0]], np.uint32), 4)
    assert order[lines].tolist() == [[3, 1], [1, 0]]
