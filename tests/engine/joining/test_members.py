"""Members of a group that share an edge: no cracks between them, and separate nodes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import PlacedSheet, Sheet, build_sheets
from oracles.topology import count_topology, weld_by_position
from service.bases.polynomials import split
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.limits import DEFAULT_LIMITS
from service.pipeline.mesh import plan_mesh
from service.pipeline.mesh_plan import build_plan
from service.surface.bezier import TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.multipatch import MultipatchSurface
from tools.building import build, build_scene
from tools.certify.closing import NEARLY_CLOSED, RESOLUTION

OPTIONS = [{"resolution": RESOLUTION}, {"accuracy": Accuracy(relative_tolerance=1e-2)}]


def place_pieces(seed: int) -> tuple[GroupSurface, bool]:
    """The pieces of a body as placed members, and whether the body is closed.

    Each piece has coordinates of its own; its placement moves it to its original place.
    """
    case, rng = NEARLY_CLOSED["borders"].build(seed), np.random.default_rng(seed)
    assert isinstance(case.surface, MultipatchSurface)
    members = []
    for k, piece in enumerate(case.surface.surfaces):
        assert isinstance(piece, BsplineSurface)
        matrix = np.eye(4)
        matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 2)
        matrix[:3, 3] = rng.normal(size=3) * 100 * (seed % 4)
        inverse = np.linalg.inv(matrix)
        net = piece.control_net @ inverse[:3, :3].T + inverse[:3, 3]
        color = (1.0, 0.5, 0.2) if k % 2 else None
        members.append(Member(replace(piece, control_net=net), f"piece {k}", color, matrix))
    return GroupSurface(tuple(members)), bool(case.is_closed)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "options"), [*enumerate(OPTIONS)])
def test_placed_pieces_of_a_body_have_no_cracks(seed: int, options: dict[str, Any]) -> None:
    """Borders have equal bits in one mesh and in separate nodes; some pieces are mirrored."""
    group, is_closed = place_pieces(seed)
    names = [member.name for member in group.members]
    mesh = build(group.lower(), MeshOptions(**options))
    assert mesh.report.watertight == is_closed
    assert [(part.name, part.color and part.color[:3]) for part in mesh.parts] == [
        (member.name, member.color) for member in group.members
    ]
    # Some pieces are inside out, so only edges are compared.
    shape = count_topology(weld_by_position(mesh.positions, mesh.triangles))
    assert mesh.report.vertices == shape.vertices
    assert (shape.boundary == 0, shape.non_manifold) == (is_closed, 0)
    sheets: list[Sheet] = [
        PlacedSheet(sheet, member.matrix)
        for member in group.members
        for sheet in build_sheets(member.surface)
        if member.matrix is not None  # true for each member; mypy needs the condition
    ]
    result = measure_surface_to_mesh(sheets, mesh.positions[mesh.triangles].astype(float), 100)
    assert mesh.report.deviation_bound is not None
    assert result.distance <= mesh.report.deviation_bound + result.rounding
    scene = build_scene(group.lower(), MeshOptions(**options), is_float32=True)
    assert [node.name for node in scene.nodes] == names
    positions = np.concatenate([m.positions + m.origin for m in scene.meshes])
    starts = np.cumsum([0, *(len(m.positions) for m in scene.meshes)])
    triangles = [m.triangles + start for m, start in zip(scene.meshes, starts, strict=False)]
    assert all(node.matrix is None for node in scene.nodes)
    shape = count_topology(weld_by_position(positions, np.concatenate(triangles)))
    assert (shape.boundary == 0) == is_closed


def build_hull() -> GroupSurface:
    """Half of a ship's hull and its mirror image, which meet along the keel."""
    net = np.random.default_rng(4).uniform(0, 0.3, (6, 5, 3))
    net += np.stack(
        [*np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij"), np.zeros((6, 5))], 2
    )
    net[:, 0, 1] = 0
    half = BsplineSurface(net, (3, 2))
    return GroupSurface(
        (Member(half, "port"), Member(half, "starboard", matrix=np.diag([1.0, -1, 1, 1])))
    )


def test_a_mirrored_member_keeps_its_uvs_and_normals() -> None:
    """After joining, the mirrored half has the uvs, normals and positions of a separate mesh."""
    # Joining exchanges u and v of a mirrored member's patches; the uvs of its mesh are exchanged
    # back. Ru then divides v, so the vertices agree with the separate mesh only if Ru = Rv.
    options = MeshOptions((3, 3), uvs=True)
    joined = build_scene(build_hull().lower(), options)
    separate = build(build_hull().lower(), replace(options, weld_tolerance=0.0))
    assert joined.report.boundary_edges < separate.report.boundary_edges
    mesh = joined.meshes[joined.nodes[1].model]
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert separate.normals is not None
    assert separate.uvs is not None
    half = len(separate.positions) // 2
    joined_rows, separate_rows = (
        np.concatenate(rows, axis=1)
        for rows in ((mesh.positions, mesh.uvs), (separate.positions[half:], separate.uvs[half:]))
    )
    for expected, normal in zip(separate_rows, separate.normals[half:], strict=True):
        differences = np.abs(joined_rows - expected).max(axis=1)
        assert differences.min() < 1e-12
        if expected[1]:  # normals at the keel are means of both halves
            np.testing.assert_allclose(mesh.normals[differences.argmin()], normal, atol=1e-9)


def test_copies_that_do_not_meet_share_one_mesh() -> None:
    group = build_hull()
    half = group.members[0]
    far = np.eye(4)
    far[1, 3] = -20
    for members in ((half,), (half, replace(half, matrix=far))):
        assert len(build_scene(replace(group, members=members).lower(), MeshOptions()).meshes) == 1


def build_triangle() -> TriangleSurface:
    """A quadratic triangle with a side in the plane x = 0."""
    net = [(0, 0, 0), (1, 0, 0.2), (2, 0, 0), (0, 1, 0.7), (1, 1, 0.3), (0, 2, 1)]
    return TriangleSurface(np.array(net, float))


def build_pipes() -> list[BsplineSurface]:
    """Two rings of one pipe, which meet along a closed curve that begins at different points."""
    angle = np.arange(8) * np.pi / 4
    ring = np.stack([3 * np.cos(angle), 2 * np.sin(angle), np.sin(3 * angle)], axis=-1)
    rise = np.array([0.0, 0, 1])
    nets = [
        np.stack([np.roll(ring, k, axis=0) + rise * (h + k) for h in (0, 1)], 1) for k in (0, 1)
    ]
    return [BsplineSurface(net, (3, 1), ("periodic", "clamped")) for net in nets]


def build_plates() -> list[BsplineSurface]:
    """A sheet, and a smaller sheet that meets its side u = 1 from v = 0.3 to v = 0.65."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, 0.3 * np.sin(x * y)], axis=-1)
    (line, _), _ = split(split((net[-1], None), 0.3)[1], 0.5)
    return [BsplineSurface(net), BsplineSurface(line + np.arange(3.0)[:, None, None], (2, 3))]


@pytest.mark.parametrize("options", OPTIONS, ids=["resolution", "tolerance"])
@pytest.mark.parametrize(
    ("members", "shape"),
    [
        (
            (Member(build_triangle()), Member(build_triangle(), matrix=np.diag([-1.0, 1, 1, 1]))),
            (1, 1, 0),
        ),
        (tuple(Member(pipe) for pipe in build_pipes()), (1, 0, 0)),
        (tuple(Member(plate) for plate in build_plates()), (1, 1, 0)),
    ],
    ids=["mirrored triangles", "different seams", "no common corner"],
)
def test_members_with_a_common_curve_become_one_sheet(
    members: tuple[Member, ...], shape: tuple[int, int, int], options: dict[str, Any]
) -> None:
    """`shape` has components, Euler characteristic and misoriented edges of one sheet."""
    mesh = build(GroupSurface(members).lower(), MeshOptions(uvs=True, **options))
    result = count_topology(weld_by_position(mesh.positions, mesh.triangles))
    assert (result.components, result.euler, result.misoriented) == shape
    assert result.boundary == mesh.report.boundary_edges


def test_the_cost_of_copies_that_meet_includes_a_mesh_for_each() -> None:
    """Members that meet have separate meshes; so their memory and their bytes are counted."""
    group = build_hull()
    fmt, options = BY_NAME["glb"], MeshOptions((60, 60))
    plan = plan_mesh(group, options, fmt)
    group_of_one = replace(group, members=group.members[:1])
    member_plan = plan_mesh(group_of_one, options, fmt)
    # The memory is almost twice that of one member.
    assert plan.cost.memory > 1.8 * member_plan.cost.memory
    length = len(plan.run().content)
    assert length > build_plan(group_of_one, options, fmt).file_bytes
    limits = replace(DEFAULT_LIMITS, max_bytes=length - 1)
    with pytest.raises(TooLarge) as caught:
        plan_mesh(group, options, fmt, limits=limits).run()
    assert caught.value.issues[0].code == "too_many_bytes"
