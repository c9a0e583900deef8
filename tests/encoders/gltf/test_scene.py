"""Groups in glTF: a node for each member, meshes that members share, and materials."""

from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles.gltf import Gltf, read_glb, read_gltf
from service.encoders.format import EncodeOptions
from service.encoders.gltf.nodes import quaternion, split_matrix
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.pipeline.mesh_counts import mesh_size
from service.pipeline.mesh_plan import shares_meshes
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sizes import SurfaceKind
from tests.breps import PLATE, build_box
from tests.clients.gltf_validator import list_issues
from tests.strategies import Array, placements
from tools.examples import UNTRIMMED

MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
SHEAR = np.array([[1.0, 0.5, 0, 3], [0, 1, 0.25, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
COARSE = MeshOptions(resolution=(3, 3))


def build_translation(x: float, y: float, z: float) -> Array:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def read_surface(document: dict[str, Any]) -> SurfaceKind:
    return validate_document(SurfaceRequest, {"surface": document}).to_surface()


def build_group(*members: Member, **fields: Any) -> GroupSurface:
    return GroupSurface(members, **fields)


def write_group(group: GroupSurface, options: MeshOptions = COARSE) -> Gltf:
    """Writes a group as GLB, and reads the file again."""
    return read_glb(render(group, options, BY_NAME["glb"]))


def read_matrix(node: dict[str, Any]) -> Array:
    """The matrix T R S of a node (glTF 2.0, 3.5.3)."""
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(rotation) @ np.diag(node.get("scale", (1, 1, 1)))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def find_copies(gltf: Gltf, name: str) -> list[tuple[Array, dict[str, Any]]]:
    """The meshes at or below the nodes of this name, each with its world matrix.

    The world matrix does not include the matrix of the root.
    """
    nodes, copies = gltf.document["nodes"], []

    def visit(number: int, parent_matrix: Array) -> None:
        node = nodes[number]
        matrix = parent_matrix @ read_matrix(node)
        if "mesh" in node:
            copies.append((matrix, gltf.document["meshes"][node["mesh"]]))
        for child in node.get("children", ()):
            visit(child, matrix)

    for number in nodes[0]["children"]:
        if nodes[number]["name"] == name:
            visit(number, np.eye(4))
    return copies


@given(placements())
def test_a_matrix_is_the_product_of_two_nodes(matrix: Array) -> None:
    """A node has a rotation, a scale and a translation; a shear needs two nodes."""
    outer, inner = split_matrix(matrix)
    for node in (outer, inner):
        if "rotation" in node:
            assert np.linalg.norm(node["rotation"]) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(read_matrix(outer) @ read_matrix(inner), matrix, atol=2e-14)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("angle", [1e-9, 0.3, 2.0, np.pi - 1e-9, np.pi])
def test_quaternions_of_rotations_by_any_angle_are_exact(axis: int, angle: float) -> None:
    """Near half a turn, 4 w² = 1 + trace is near 0, and has few correct digits."""
    rotation = np.eye(3)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    rotation[[j, k], [j, k]] = np.cos(angle)
    rotation[[j, k], [k, j]] = -np.sin(angle), np.sin(angle)
    expected = np.zeros(4)
    expected[[axis, 3]] = np.sin(angle / 2), np.cos(angle / 2)
    assert abs(np.dot(quaternion(rotation), expected)) == pytest.approx(1, abs=1e-15)


def test_equal_surfaces_with_equal_colours_share_one_mesh() -> None:
    """Meshes of equal surfaces with different colours use the same accessors."""
    ball, ramp = find("sphere").surface(), find("saddle").surface()
    group = build_group(
        Member(ball, "a"),
        Member(ball, "b", matrix=build_translation(3, 0, 0)),
        Member(ball, "c", (1.0, 0.0, 0.0), MIRROR),
        Member(ball, "d", (1.0, 0.0, 0.0), SHEAR),
        Member(ramp, "e", (1.0, 0.0, 0.0)),
        up="z",
    )
    gltf = write_group(group)
    document = gltf.document
    assert [node["name"] for node in document["nodes"] if "name" in node] == ["group", *"abcde"]
    assert len(document["meshes"]) == 3
    assert len(document["materials"]) == 2
    # Positions, normals and indices of two different meshes.
    assert len(document["accessors"]) == 6
    meshes = {name: find_copies(gltf, name)[0][1] for name in "abcde"}
    assert meshes["a"] is meshes["b"]
    assert meshes["c"] is meshes["d"]
    (plain,), (red,) = meshes["a"]["primitives"], meshes["c"]["primitives"]
    assert plain["attributes"] == red["attributes"]
    assert plain["indices"] == red["indices"]
    assert plain["material"] != red["material"]


def test_nodes_place_members_as_the_group_does() -> None:
    """A sheared member has two nodes; a member with several parts has a node for each part."""
    ball, drum = find("sphere").surface(), find("cylinder").surface()
    group = build_group(Member(ball, "ball", matrix=SHEAR), Member(drum, "drum", matrix=MIRROR))
    for gltf in (write_group(group), read_gltf(render(group, COARSE, BY_NAME["gltf"]))):
        # Members are z-up, the group is y-up.
        upright = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
        ((world, mesh),) = find_copies(gltf, "ball")
        np.testing.assert_allclose(world, SHEAR @ upright, atol=1e-15)
        assert mesh["name"] == "ball"
        parts = find_copies(gltf, "drum")
        assert [part["name"] for _, part in parts] == ["side", "top", "bottom"]
        for world, _ in parts:
            np.testing.assert_allclose(world, MIRROR @ upright, atol=1e-15)


def test_a_far_member_keeps_a_local_origin_below_its_placement() -> None:
    far = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]) + 1e6)
    gltf = write_group(build_group(Member(far, "far", matrix=build_translation(-1e6, -1e6, -1e6))))
    ((world, mesh),) = find_copies(gltf, "far")
    (primitive,) = mesh["primitives"]
    stored = gltf.array(primitive["attributes"]["POSITION"])
    assert np.abs(stored).max() < 2
    positions = stored @ world[:3, :3].T + world[:3, 3]
    bounds = [positions.min(axis=0), positions.max(axis=0)]
    np.testing.assert_allclose(bounds, [[0, 0, 0], [1, 1, 0]])


def test_colors_are_linear_and_opacity_blends() -> None:
    ball = find("sphere").surface()
    group = build_group(
        Member(ball, "solid", (1.0, 0.5, 0.02)), Member(ball, "glass", (0.0, 0.5, 1.0, 0.25))
    )
    solid, glass = write_group(group).document["materials"]
    # Linear light of 0.5 is ((0.5 + 0.055) / 1.055)^2.4, and of 0.02 it is 0.02 / 12.92.
    light_half, light_dark = 0.21404114048223255, 0.0015479876160990712
    assert solid["pbrMetallicRoughness"]["baseColorFactor"] == [1.0, light_half, light_dark, 1.0]
    assert glass["pbrMetallicRoughness"]["baseColorFactor"] == [0.0, light_half, 1.0, 0.25]
    assert (solid["name"], glass["name"]) == ("surface #ff8005", "surface #0080ff40")
    assert "alphaMode" not in solid
    assert glass["alphaMode"] == "BLEND"


def build_group_of_examples() -> GroupSurface:
    """All examples but groups and parts, sheared and mirrored; every second has a colour."""
    surfaces = [find(name).surface() for name in UNTRIMMED]
    member_surfaces = [each for each in surfaces if not isinstance(each, GroupSurface)]
    members = [
        Member(
            surface,
            None,
            (0.2, 0.5, 0.7) if k % 2 else None,
            build_translation(9 * k, 0, 0) @ SHEAR @ MIRROR,
        )
        for k, surface in enumerate(member_surfaces)
    ]
    return GroupSurface(tuple(members), "z")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "uvs"), [("glb", False), *((name, True) for name in BY_NAME)])
def test_every_kind_of_surface_can_be_a_member(name: str, uvs: bool, tmp_path: Path) -> None:
    """Some members have colours or attributes; the file is not longer than its bound."""
    group, fmt = build_group_of_examples(), BY_NAME[name]
    options = MeshOptions(resolution=(3, 2), uvs=uvs)
    # Most formats with nodes store each surface once.
    group_size = group.stored_size() if shares_meshes(fmt, EncodeOptions()) else group.size()
    size = mesh_size(group_size, options, fmt)
    content = render(group, options, fmt)
    assert len(content) <= fmt.byte_bound(size, EncodeOptions())
    if name in ("glb", "gltf"):
        assert list_issues(content, tmp_path / f"model.{name}") == []


@st.composite
def trees(draw: st.DrawFn) -> GroupSurface:
    """Plates and frames, some below others; a third of them turned, sheared or mirrored."""
    plate, box = (read_surface(each) for each in (PLATE, build_box()))
    sail = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]), up="y")
    members: list[Member] = []
    for k in range(draw(st.integers(2, 7))):
        surface = draw(st.sampled_from([None, plate, box, sail]))
        matrix = draw(st.sampled_from([None, MIRROR, SHEAR, build_translation(k, 2, 3)]))
        color = draw(st.sampled_from([None, (1.0, 0.0, 0.0)]))
        parent = draw(st.none() | st.integers(0, k - 1)) if k else None
        members.append(Member(surface, f"m{k}", color, matrix, parent))
    members.append(Member(box, "last", parent=len(members) - 1))
    return GroupSurface(tuple(members), "z", metres_per_unit=0.001)


def list_triangles(gltf: Gltf) -> dict[str, list[Array]]:
    """The corners of all triangles, in the units and axes of the group, by the colour of the mesh.

    Readers reverse the triangles of nodes with a negative determinant (glTF 2.0, 3.7.4).
    """
    document, found = gltf.document, dict[str, list[Array]]()

    def visit(number: int, parent_matrix: Array) -> None:
        node = document["nodes"][number]
        matrix = parent_matrix @ read_matrix(node)
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            positions = gltf.array(primitive["attributes"]["POSITION"]).astype(float)
            placed = positions @ matrix[:3, :3].T + matrix[:3, 3]
            rows = gltf.array(primitive["indices"]).reshape(-1, 3)
            if np.linalg.det(matrix[:3, :3]) < 0:
                rows = rows[:, ::-1]
            material = document["materials"][primitive["material"]]
            color = str(material["pbrMetallicRoughness"].get("baseColorFactor"))
            found.setdefault(color, []).extend(placed[rows])
        for child in node.get("children", ()):
            visit(child, matrix)

    for number in document["nodes"][0]["children"]:
        visit(number, np.eye(4))
    return found


def describe_triangles(corners: Array) -> list[list[float]]:
    """The centre and the normal of each triangle times its area, sorted; without −0."""
    a, b, c = corners.swapaxes(0, 1)
    rows = np.concatenate([(a + b + c) / 3, np.cross(b - a, c - a) / 2], axis=1)
    return sorted((rows.round(4) + 0.0).tolist())


@settings(deadline=None)
@given(trees())
def test_a_tree_of_nodes_places_what_the_flat_mesh_has(group: GroupSurface) -> None:
    """Also mirrored and sheared frames, and colours of parents; the root turns and scales."""
    options = MeshOptions()
    gltf = read_glb(render(group, options, BY_NAME["glb"]))
    root = gltf.document["nodes"][0]
    assert root["scale"] == [0.001] * 3
    flat = orjson.loads(render(group, options, BY_NAME["json"]))
    assert flat["report"]["metres_per_unit"] == 0.001
    vertices = np.array(flat["vertices"])
    expected = describe_triangles(vertices[np.array(flat["faces"])])
    by_color = list_triangles(gltf)
    found = describe_triangles(np.concatenate([np.array(each) for each in by_color.values()]))
    np.testing.assert_allclose(found, expected, atol=2e-4)
    # Each colour has as many triangles as the parts of that colour.
    red = sum(
        part["faces"][1] - part["faces"][0]
        for part in flat["parts"]
        if part.get("color") == [1, 0, 0, 1]
    )
    assert len(by_color.get("[1.0, 0.0, 0.0, 1.0]", [])) == red
    report = gltf.document["asset"]["extras"]["report"]
    assert [each["name"] for each in report["parts"]] == [each["name"] for each in flat["parts"]]


def test_members_below_others_have_their_own_names_in_nodes(tmp_path: Path) -> None:
    """Paths are for formats without nodes."""
    box = read_surface(build_box())
    group = build_group(
        Member(name="machine"),
        Member(box, "bolt", matrix=MIRROR, parent=0),
        Member(box, "nut", parent=1),
    )
    content = render(group, MeshOptions(), BY_NAME["gltf"])
    assert list_issues(content, tmp_path / "model.gltf") == []
    document = read_gltf(content).document
    assert [node.get("name") for node in document["nodes"]][:3] == ["group", "machine", "bolt"]
    assert len(document["meshes"]) == 1
    text = render(group, MeshOptions(), BY_NAME["obj"]).decode()
    assert "machine/bolt/nut" in text


def test_joined_members_are_below_the_root() -> None:
    """Their common edge has the same vertices in both; products of placements could move them."""
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    tile = BezierSurface(net)
    frame = build_translation(0.1, 0.2, 0.3)
    group = build_group(
        Member(name="floor", matrix=frame),
        Member(tile, "a", parent=0),
        Member(tile, "b", matrix=build_translation(1, 0, 0), parent=0),
        Member(tile, "c", matrix=build_translation(9, 0, 0), parent=0),
    )
    gltf = write_group(group)
    nodes = gltf.document["nodes"]
    below = [nodes[k]["name"] for k in nodes[0]["children"]]
    assert below == ["floor", "floor/a", "floor/b"]
    ((_, a),), ((_, b),) = (find_copies(gltf, f"floor/{name}") for name in "ab")
    edges = []
    for (matrix, mesh), x in zip(
        (find_copies(gltf, "floor/a")[0], find_copies(gltf, "floor/b")[0]), (1.1, 1.1), strict=True
    ):
        stored = gltf.array(mesh["primitives"][0]["attributes"]["POSITION"])
        placed = stored + np.float32(0) + matrix[:3, 3]
        edges.append(sorted(placed[np.abs(placed[:, 0] - x) < 1e-6].tolist()))
    assert edges[0] == edges[1]
    assert len(edges[0]) == 4
    assert a is not b
    assert len(find_copies(gltf, "floor")) == 1
