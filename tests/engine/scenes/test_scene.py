"""Groups as scenes, and flattened to one mesh: positions, normals, winding, shared meshes."""

from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.topology import volume
from service.engine.build import build, build_scene
from service.engine.evaluation.evaluate import evaluate
from service.engine.mesh.mesh import Mesh
from service.engine.models import keep_model_channels, to_patches
from service.engine.options import MeshOptions
from service.surface.batches import ChannelKind
from service.surface.bezier import BezierSurface
from service.surface.channels import Channels
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel
from service.surface.member import Member
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh, check_sound, find_first_vertices, to_triangles
from tests.strategies import Array, placements

RED = (1.0, 0.0, 0.0)
NET = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


def build_group(*members: Member, **fields: Any) -> GroupModel:
    """The lowered group of members; `fields` are other fields of `GroupSurface`."""
    return GroupSurface(members, **fields).lower()


def compute_area_vectors(mesh: Mesh) -> Array:
    """The area vectors of all triangles: normal to the triangle, with its area as length."""
    a, b, c = (mesh.positions[to_triangles(mesh)[:, k]] for k in range(3))
    areas: Array = np.cross(b - a, c - a) / 2
    return areas


def compute_volume(mesh: Mesh) -> float:
    return float(volume(mesh.positions, to_triangles(mesh)))


@given(
    st.sampled_from(["torus", "cone", "tveit", "saddle"]),
    placements(),
    st.sampled_from(["triangles", "quads"]),
    st.booleans(),
)
def test_a_flattened_copy_is_the_placed_mesh(
    example: str, matrix: Array, faces: str, weld: bool
) -> None:
    """Points are L x + t, normals are along L⁻ᵀ n, and faces are reversed if L is a reflection."""
    options = MeshOptions(resolution=(3, 4), faces=faces, weld=weld)  # type: ignore[arg-type]
    surface = find(example).surface()
    mesh = build(build_group(Member(surface, matrix=matrix), up=surface.up), options)
    check_sound(mesh)
    unplaced = build_mesh(example, resolution=(3, 4), faces=faces, weld=weld)
    linear, shift = matrix[:3, :3], matrix[:3, 3]
    np.testing.assert_allclose(mesh.positions, unplaced.positions @ linear.T + shift, atol=1e-13)
    assert unplaced.normals is not None
    assert mesh.normals is not None
    expected = unplaced.normals @ np.linalg.inv(linear)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.normals, expected, atol=1e-12)
    # Faces stay counter-clockwise about the normals.
    areas = compute_area_vectors(unplaced) @ np.linalg.inv(linear) * abs(np.linalg.det(linear))
    np.testing.assert_allclose(compute_area_vectors(mesh), areas, atol=1e-11)
    if unplaced.report.watertight:
        expected_volume = abs(np.linalg.det(linear)) * compute_volume(unplaced)
        assert compute_volume(mesh) == pytest.approx(expected_volume, rel=1e-12)


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_normals_of_a_mirrored_body_point_outwards(faces: str) -> None:
    """Checks faces, normals, and grids, which the OOGL formats use."""
    options = MeshOptions(resolution=(5, 3), faces=faces)  # type: ignore[arg-type]
    mesh = build(build_group(Member(find("sphere").surface(), matrix=MIRROR), up="z"), options)
    assert compute_volume(mesh) > 0
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, mesh.positions, atol=1e-12)
    for grid in mesh.grids[0]:
        corners = mesh.positions[[grid[1, 1], grid[2, 1], grid[1, 2]]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert np.dot(normal, corners[0]) > 0


def test_members_become_parts_under_their_names_and_colors() -> None:
    """If a member has several parts, their names are "member/part"."""
    model = build_group(
        Member(find("cylinder").surface(), "drum", RED),
        Member(find("saddle").surface()),
        Member(find("cylinder").surface(), "other", matrix=MIRROR),
    )
    mesh = build(model, MeshOptions(resolution=(4, 4), overlays=("boundary",)))
    names = [part.name for part in mesh.parts]
    drum = ["drum/side", "drum/top", "drum/bottom"]
    assert names == [*drum, "saddle", "other/side", "other/top", "other/bottom"]
    assert [part.color for part in mesh.parts] == [(*RED, 1.0)] * 3 + [None] * 4
    runs = [part.triangles for part in mesh.parts]
    # Each part has a run of triangles (begin, end), which begins where the previous run ends.
    assert all(previous[1] == following[0] for previous, following in pairwise(runs))
    assert runs[-1][1] == len(mesh.triangles)
    overlays = [overlay.name for overlay in mesh.overlays]
    assert overlays == ["drum/boundary", "saddle/boundary", "other/boundary"]
    first, _, last = (overlay.positions for overlay in mesh.overlays)
    # The axis of the cylinder is z and "up" of the group is y: so it is rotated, then mirrored.
    np.testing.assert_array_equal(first * [-1, 1, 1], last)
    assert np.ptp(first[:, 1]) == 2


def test_equal_members_share_one_mesh_and_are_counted_separately() -> None:
    ball = find("sphere").surface()
    model = build_group(*(Member(ball, matrix=np.diag([k, k, k, 1.0])) for k in (1, 2, 3)), up="z")
    scene = build_scene(model, MeshOptions(resolution=(4, 4)), is_float32=True)
    (mesh,) = scene.meshes
    assert [node.model for node in scene.nodes] == [0, 0, 0]
    report = scene.report
    assert report.vertices == 3 * mesh.report.vertices
    assert report.triangles == 3 * mesh.report.triangles
    assert (report.bounds_min, report.bounds_max) == ((-3, -3, -3), (3, 3, 3))
    assert report.watertight


def test_copies_are_not_welded_to_each_other() -> None:
    """Two copies with one placement: vertices are welded within each copy only."""
    ball = find("sphere").surface()
    mesh = build(build_group(Member(ball), Member(ball)), MeshOptions(resolution=(3, 3)))
    first_vertices = find_first_vertices(mesh)
    half = len(first_vertices) // 2
    np.testing.assert_array_equal(first_vertices[half:], first_vertices[:half] + half)


def test_a_mesh_with_a_framed_member_has_no_grids() -> None:
    """The strips of a stitched patch are not a grid."""
    square = np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]])
    # The common edge of the patches of `uneven` is along v in one patch and along u in the other,
    # so it has 5 and 2 divisions.
    table = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])
    uneven = PatchSurface(table, np.array([[[0, 1], [2, 3]], [[2, 4], [3, 5]]]))
    options = MeshOptions(resolution=(2, 5))
    single_mesh = build(build_group(Member(BezierSurface(square))), options)
    group_mesh = build(build_group(Member(BezierSurface(square)), Member(uneven)), options)
    assert len(single_mesh.grids) == 1
    assert group_mesh.grids == ()
    check_sound(group_mesh)


@given(placements())
def test_placing_control_points_places_the_patches(matrix: Array) -> None:
    """Compares samples of a placed copy with placed samples; a mirror image has u and v swapped."""
    surface = find("cone").surface()
    model = to_patches(
        build_group(Member(surface, "first", matrix=matrix), Member(surface), up="z")
    )
    assert [(part.name, part.first, part.last) for part in model.parts] == [
        ("first", 0, 8),
        ("cone", 8, 16),
    ]
    placed, unplaced = (evaluate(batch, (3, 3)) for batch in model.batches)
    expected = unplaced.positions @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0:
        expected = expected.swapaxes(1, 2)
    np.testing.assert_allclose(placed.positions, expected, atol=1e-13)


def test_far_members_keep_their_shape_in_single_precision() -> None:
    """The float32 positions of a group far from zero are relative to one local origin."""
    matrix = np.eye(4)
    matrix[:3, 3] = 1e6
    model = build_group(Member(find("sphere").surface(), matrix=matrix), up="z")
    mesh = build(model, MeshOptions(resolution=(4, 4)), is_float32=True)
    assert mesh.positions.dtype == np.float32
    assert mesh.origin.tolist() == [1e6] * 3
    assert np.abs(np.linalg.norm(mesh.positions, axis=1) - 1).max() < 1e-6
    check_sound(mesh)


def test_base_colors_become_colors_of_vertices() -> None:
    """A member without colours is white; base colours multiply colours in linear light."""
    painted = BezierSurface(NET, channels=Channels(colors=np.full((1, 1, 3), 0.5)))
    tinted = Member(painted, "tinted", (0.5, 1.0, 0.0, 0.25))
    mesh = build(
        build_group(Member(painted), tinted, Member(find("tveit").surface())),
        MeshOptions(resolution=(1, 1)),
    )
    assert mesh.colors is not None
    first, second, third = np.split(mesh.colors, 3)
    np.testing.assert_array_equal(first, [[0.5, 0.5, 0.5, 1]] * 4)
    # sRGB 0.5 is linear 0.2140411; its square is 0.0458136, which is sRGB 0.236967.
    np.testing.assert_allclose(second, [[0.236967, 0.5, 0, 0.25]] * 4, atol=1e-6)
    np.testing.assert_array_equal(third, [[1, 1, 1, 1]] * 4)


def test_one_mesh_keeps_only_attributes_that_all_members_have() -> None:
    """The members list their attributes in different orders.

    In a file with nodes, each member keeps its mesh with all its attributes, in the order of names.
    """
    heat, flow = np.ones((1, 1, 1)), np.ones((1, 1, 2))
    first, second = (
        BezierSurface(NET, channels=Channels(attributes=attributes))
        for attributes in ((("heat", heat), ("flow", flow)), (("flow", flow * 2), ("cold", heat)))
    )
    model = build_group(Member(first), Member(second))
    kinds: frozenset[ChannelKind] = frozenset({"attribute"})
    mesh = build(keep_model_channels(model, kinds, has_nodes=False), MeshOptions(resolution=(1, 1)))
    ((name, values),) = mesh.attributes
    assert name == "flow"
    np.testing.assert_array_equal(values, [[1, 1]] * 4 + [[2, 2]] * 4)
    scene = build_scene(
        cast(GroupModel, keep_model_channels(model, kinds, has_nodes=True)),
        MeshOptions(resolution=(1, 1)),
    )
    assert [[n for n, _ in m.attributes] for m in scene.meshes] == [
        ["flow", "heat"],
        ["cold", "flow"],
    ]
