"""Quantized glTF: the stored integers, and the values that they represent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oracles.gltf import Gltf, read_glb
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import quantize_mesh
from service.pipeline.mesh import plan_mesh, render
from service.surface.bezier import BezierSurface
from service.surface.group import GroupSurface
from service.surface.member import Member
from tests.clients.gltf_validator import list_issues
from tests.encoders.gltf.test_scene import find_copies
from tests.strategies import Array
from tools.meshes import (
    add_attributes,
    add_overlays,
    build_sheet,
    build_silo,
    remove_faces,
    to_single,
)

STEP = 2.0**-14
QUANTIZED = EncodeOptions(quantize=True)
NET = np.random.default_rng(8).uniform(-1, 1, (4, 4, 3))

POINT = replace(to_single(build_sheet(1)), positions=np.full((4, 3), 0.7, np.float32), overlays=())
MESHES = {
    "parts": to_single(build_silo(12, 3)),
    "far away": to_single(build_silo(12, 3), origin=(5e5, 4.6e6, 1e-3)),
    "z up": to_single(add_overlays(build_silo(12, 3)), origin=(1.0, 2.0, 3.0), up="z"),
    "positions alone": replace(to_single(build_silo(5)), normals=None, uvs=None),
    "flat": to_single(build_sheet(4)),
    "a point": POINT,
    "no faces": to_single(remove_faces(build_silo())),
    "overlays alone": to_single(remove_faces(add_overlays(build_silo()))),
    "colours": to_single(add_attributes(build_silo(12, 3))),
    "translucent colours": to_single(
        add_attributes(build_silo(5), opacity=True), (1.0, 2.0, 3.0), "z"
    ),
}


def write_quantized(mesh: Mesh, step: float = STEP) -> Gltf:
    """Quantizes a mesh, encodes it as GLB, and reads the file again."""
    return read_glb(bytes(BY_NAME["glb"].encode(quantize_mesh(mesh, step), QUANTIZED)))


def read_positions(gltf: Gltf, name: str) -> Array:
    """Positions at a node, in model coordinates, computed from the stored integers."""
    node = gltf.node(name)
    stored = gltf.attribute(name, "POSITION").astype(np.float64)
    positions: Array = stored * node["scale"] + node.get("translation", [0.0, 0.0, 0.0])
    return positions


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
def test_the_validator_finds_no_issue(mesh: Mesh, tmp_path: Path) -> None:
    content = bytes(BY_NAME["glb"].encode(quantize_mesh(mesh, STEP), QUANTIZED))
    assert list_issues(content, tmp_path / "model.glb") == []


@pytest.mark.parametrize("name", ["z up", "far away", "flat", "a point"])
def test_integers_represent_the_positions_of_the_mesh_exactly(name: str) -> None:
    mesh = quantize_mesh(MESHES[name], STEP)
    gltf = write_quantized(MESHES[name])
    assert gltf.document["extensionsRequired"] == ["KHR_mesh_quantization"]
    for part in mesh.parts:
        corners = mesh.triangles[slice(*part.triangles)]
        indices = gltf.array(gltf.primitive(part.name)["indices"]).reshape(-1, 3)
        positions = read_positions(gltf, part.name)[indices]
        assert (positions == mesh.positions.astype(np.float64)[corners] + mesh.origin).all()
    for overlay in mesh.overlays:
        expected = overlay.positions.astype(np.float64) + mesh.origin
        assert (read_positions(gltf, overlay.name) == expected).all()


def test_bounds_of_accessors_are_the_least_and_largest_integers() -> None:
    gltf = write_quantized(MESHES["z up"])
    for name in ("base", "wall", "roof", "boundary"):
        accessor = gltf.document["accessors"][gltf.primitive(name)["attributes"]["POSITION"]]
        stored = gltf.attribute(name, "POSITION")
        assert stored.dtype == np.uint16
        assert accessor["min"] == stored.min(axis=0).tolist()
        assert accessor["max"] == stored.max(axis=0).tolist()
        assert all(isinstance(number, int) for number in accessor["min"])
    nodes = gltf.document["nodes"][1:]
    assert len(nodes) == 5  # three parts and two overlays
    assert all(node.get("translation") == nodes[0].get("translation") for node in nodes)


def test_neighbouring_parts_share_exact_positions() -> None:
    gltf = write_quantized(to_single(build_silo(13, 3)))
    base, wall = (
        {tuple(row) for row in read_positions(gltf, name).tolist()} for name in ("base", "wall")
    )
    assert len(base & wall) == 13


def test_normals_texture_coordinates_and_colours_differ_only_by_rounding() -> None:
    mesh = to_single(add_attributes(build_silo(60, 9), opacity=True))
    rows = np.random.default_rng(1).normal(size=mesh.positions.shape)
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    part = replace(mesh.parts[0], triangles=(0, len(mesh.triangles)))
    mesh = replace(mesh, normals=rows.astype(np.float32), parts=(part,))
    quantized = write_quantized(mesh)
    plain = read_glb(bytes(BY_NAME["glb"].encode(mesh, EncodeOptions())))
    attributes = quantized.primitive("base")["attributes"]
    values = {name: quantized.values(number) for name, number in attributes.items()}
    normals = values["NORMAL"] / np.linalg.norm(values["NORMAL"], axis=1)[:, None]
    angles = np.degrees(2 * np.arcsin(np.linalg.norm(normals - rows, axis=1) / 2))
    assert angles.max() < 0.0015
    for name in ("TEXCOORD_0", "COLOR_0"):
        # Half a step of 16 bits, and some rounding.
        assert np.abs(values[name] - plain.attribute("base", name)).max() <= 0.51 / 65535
    for name in ("_TEMPERATURE", "_FLOW_0", "_FLOW_1"):
        assert (values[name] == plain.attribute("base", name)).all()


def test_texture_coordinates_above_1_stay_float32() -> None:
    mesh = to_single(build_sheet(3))
    assert mesh.uvs is not None
    gltf = write_quantized(replace(mesh, uvs=mesh.uvs * np.float32(1.5)))
    assert gltf.attribute("sheet", "TEXCOORD_0").dtype == np.float32


def test_a_mesh_that_is_too_large_for_its_grid_raises_an_error() -> None:
    mesh = replace(quantize_mesh(to_single(build_silo()), STEP), step=2.0**-30)
    with pytest.raises(ValueError, match="longer than 65535 steps"):
        bytes(BY_NAME["glb"].encode(mesh, QUANTIZED))


def test_quantization_does_not_move_members_of_a_group(tmp_path: Path) -> None:
    shear = np.array([[1.0, 0.5, 0, 3], [0, 1, 0.25, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
    copy = Member(BezierSurface(NET), name="b", matrix=shear)
    group = GroupSurface((Member(BezierSurface(NET), name="a"), copy))
    options = MeshOptions((3, 3), overlays=("control_net",))
    content = bytes(plan_mesh(group, options, BY_NAME["glb"], QUANTIZED).run().content)
    assert list_issues(content, tmp_path / "model.glb") == []
    quantized, plain = read_glb(content), read_glb(render(group, options, BY_NAME["glb"]))
    for name in ("a", "b"):
        positions, expected = (place_positions(file, name) for file in (quantized, plain))
        # The mesh and the control net have 16 points each.
        assert positions.shape == expected.shape == (2, 16, 3)
        assert np.abs(positions - expected).max() < 1e-4


def place_positions(gltf: Gltf, name: str) -> Array:
    """World positions of all primitives at or below the nodes of this name, (primitives, 16, 3)."""
    world_positions = []
    for matrix, mesh in find_copies(gltf, name):
        for primitive in mesh["primitives"]:
            positions = gltf.array(primitive["attributes"]["POSITION"])
            world_positions.append(positions @ matrix[:3, :3].T + matrix[:3, 3])
    return np.array(world_positions)
