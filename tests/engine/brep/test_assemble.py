"""The mesh from the triangles of a brep, made by hand: a cube, a cone, a folded sheet."""

from dataclasses import replace
from math import inf, pi
from typing import Any

import numpy as np
import pytest

from oracles.topology import count_topology
from service.engine.bounds.goal import Goal
from service.engine.brep.assemble import assemble
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.prepared import PreparedBrep
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.stored_positions import Storage
from tests.engine.brep.made_breps import CUBE, build_cube, build_grid

SINGLE = Storage(is_float32=True, has_local_origin=True)


def build(
    made: tuple[PreparedBrep, BrepTriangulation],
    goal: Goal | None = None,
    storage: Storage | None = None,
    **options: Any,
) -> Mesh:
    prepared, triangulation = made
    storage = storage or Storage()
    origin = storage.choose_origin(*prepared.box)
    return assemble(
        prepared,
        triangulation,
        goal or Goal(0.01),
        MeshOptions(**options),
        storage=storage,
        origin=origin,
    )


def test_a_cube_is_closed_and_its_normals_point_outwards() -> None:
    mesh = build(build_cube())
    assert mesh.welds is not None
    counts = count_topology(mesh.welds[mesh.triangles].tolist())
    assert counts.watertight
    assert mesh.report.watertight
    assert mesh.report.boundary_edges == 0
    assert mesh.report.vertices == 8
    # Each corner has three normals, because the angle of its faces is larger than the crease angle.
    assert len(mesh.positions) == 24
    assert mesh.normals is not None
    assert (np.vecdot(mesh.normals, mesh.positions - 0.5) > 0).all()
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    normals = mesh.normals[mesh.triangles[:, 0]]
    np.testing.assert_allclose(across / np.linalg.norm(across, axis=1)[:, None], normals)


def test_faces_share_vertices_within_the_crease_angle() -> None:
    mesh = build(build_cube(), crease_angle=pi)
    assert len(mesh.positions) == 8
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, (mesh.positions - 0.5) / 0.75**0.5, atol=1e-12)
    # Parameters belong to a face, so they separate vertices even there.
    assert len(build(build_cube(), crease_angle=pi, uvs=True).positions) > 8


def test_parts_are_the_faces_in_their_order() -> None:
    mesh = build(build_cube(names=("bottom", "", "top")))
    assert [part.name for part in mesh.parts] == [
        "bottom", "face 1", "top", "face 3", "face 4", "face 5",
    ]  # fmt: skip
    assert [part.triangles for part in mesh.parts] == [(2 * k, 2 * k + 2) for k in range(6)]
    assert [part.deviation_bound for part in mesh.parts] == [k / 1024 for k in range(6)]
    red = (0.8, 0.2, 0.1, 1.0)
    assert [part.color for part in mesh.parts] == [red, red, None, None, None, None]
    for number, part in enumerate(mesh.parts):
        corners = mesh.positions[mesh.triangles[slice(*part.triangles)]].reshape(-1, 3)
        assert np.ptp(corners, axis=0).min() == 0, number


def test_the_report_has_the_largest_bound_of_faces_and_edges() -> None:
    prepared, triangulation = build_cube()
    mesh = build((prepared, triangulation))
    assert mesh.report.deviation_bound == 5 / 1024
    brep = mesh.report.brep
    assert brep is not None
    assert brep.reached
    assert brep.complete
    assert brep.gap_bound == 1e-7
    longer = replace(triangulation, edge_bounds=np.full(12, 0.0625))
    mesh = build((prepared, longer))
    assert mesh.report.deviation_bound == 0.0625
    assert mesh.report.brep is not None
    assert not mesh.report.brep.reached  # the tolerance is 0.01
    assert mesh.report.mesh_deviation_bound is None


def test_a_second_bound_that_is_not_finite_has_a_reason() -> None:
    prepared, triangulation = build_cube()
    finite = build((prepared, replace(triangulation, mesh_bounds=np.arange(6) / 64)))
    assert finite.report.mesh_deviation_bound == 5 / 64
    assert finite.report.brep is not None
    assert finite.report.brep.unbounded_reason is None
    infinite = build((prepared, replace(triangulation, mesh_bounds=np.full(6, inf))))
    assert infinite.report.mesh_deviation_bound is None
    assert infinite.report.brep is not None
    assert infinite.report.brep.unbounded_reason


def test_skipped_and_degenerate_faces_leave_a_hole() -> None:
    prepared, triangulation = build_cube(skips=(2,))
    mesh = build((prepared, triangulation))
    brep = mesh.report.brep
    assert brep is not None
    assert not mesh.report.watertight
    assert mesh.report.boundary_edges == 4
    assert not brep.complete
    assert brep.degenerate_faces == 0
    assert [face.face for face in brep.skipped_faces] == [2]
    assert mesh.parts[2].triangles == (4, 4)
    assert mesh.parts[2].deviation_bound is None
    mesh = build((replace_gaps(prepared, skipped_faces=()), triangulation))
    assert mesh.report.brep is not None
    assert mesh.report.brep.degenerate_faces == 1
    assert not mesh.report.brep.complete


def replace_gaps(prepared: PreparedBrep, **changes: Any) -> PreparedBrep:
    """The prepared brep with changed fields and the same gaps."""
    changed = replace(prepared, **changes)
    changed.__dict__["gaps"] = prepared.gaps
    return changed


def test_edges_are_lines_through_the_vertices_of_the_mesh() -> None:
    mesh = build(build_cube(), overlays=("boundary",))
    (overlay,) = mesh.overlays
    assert len(overlay.segments) == 12
    ends = overlay.positions[overlay.segments]
    assert np.isin(overlay.positions.view("V24"), CUBE.view("V24")).all()
    np.testing.assert_array_equal(np.abs(ends[:, 0] - ends[:, 1]).sum(axis=1), 1.0)


def test_private_seams_are_not_drawn() -> None:
    prepared, triangulation = build_cube()
    sources = prepared.edge_sources.copy()
    sources[[3, 5]] = -2
    made = replace_gaps(prepared, edge_sources=sources), triangulation
    (overlay,) = build(made, overlays=("boundary",)).overlays
    assert len(overlay.segments) == 10


@pytest.mark.parametrize("storage", [SINGLE, Storage(is_float32=True), replace(SINGLE, step=2**-9)])
def test_the_bound_includes_the_rounding_of_vertices(storage: Storage) -> None:
    prepared, triangulation = build_cube()
    shift = np.array([1e3, -1e3, 1 / 3])
    moved = replace(triangulation, positions=triangulation.positions / 3 + shift)
    low, high = moved.positions.min(axis=0), moved.positions.max(axis=0)
    made = replace_gaps(prepared, box=np.array([low, high])), moved
    mesh = build(made, storage=storage)
    assert mesh.positions.dtype == np.float32
    stored = mesh.positions.astype(np.float64) + mesh.origin
    distances = np.linalg.norm(stored[:, None] - moved.positions, axis=2)
    moves = distances.min(axis=1).max()
    assert moves > 0
    assert mesh.report.deviation_bound is not None
    assert 5 / 1024 + moves <= mesh.report.deviation_bound <= 5 / 1024 + 1.01 * moves + 1e-12
    assert mesh.report.watertight


def test_a_triangle_without_area_in_the_file_is_left_out() -> None:
    prepared, triangulation = build_cube()
    # A point beside a corner of the cube, nearer than single precision tells apart: one edge of
    # the two faces at the edge gets three samples.
    begin, end = prepared.edge_vertices[0]
    positions = np.concatenate([CUBE, [CUBE[end] + 1e-12 * (CUBE[begin] - CUBE[end])]])
    triangles, points = triangulation.triangles, triangulation.points
    split: list[list[int]] = []
    faces: list[int] = []
    new_corners: dict[int, int] = {}
    for triangle, face in zip(triangles.tolist(), triangulation.faces.tolist(), strict=True):
        ends = [points[corner] for corner in triangle]
        for k in range(3):
            if {ends[k], ends[(k + 1) % 3]} == {begin, end}:
                corner = new_corners.setdefault(face, len(points) + len(new_corners))
                a, b, c = triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]
                split += [[a, corner, c], [corner, b, c]]
                faces += [face, face]
                break
        else:
            split.append(triangle)
            faces.append(face)
    assert len(split) == 14
    places = np.concatenate([triangulation.places, [[1, 1]] * 2])
    made = replace(
        triangulation,
        positions=positions,
        triangles=np.array(split),
        faces=np.array(faces),
        points=np.concatenate([points, [8, 8]]),
        corner_faces=np.concatenate([triangulation.corner_faces, list(new_corners)]),
        places=places,
    )
    assert len(build((prepared, made)).triangles) == 14
    mesh = build((prepared, made), storage=SINGLE)
    assert len(mesh.triangles) == 12
    assert mesh.report.watertight
    assert mesh.report.vertices == 8


def test_normals_and_curvatures_of_a_reversed_face_point_to_the_other_side() -> None:
    u, v = np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], indexing="ij")
    net = np.stack([u, v, np.where((u == 0.5) & (v == 0.5), 1.0, 0.0)], axis=-1)
    prepared, triangulation = build_grid(net, (2, 2), 4)
    plain = build((prepared, triangulation), curvatures=True)
    flipped = replace(triangulation, triangles=triangulation.triangles[:, ::-1])
    turned = build((replace_gaps(prepared, is_reversed=np.array([True])), flipped), curvatures=True)
    assert plain.normals is not None
    assert turned.normals is not None
    assert (plain.normals[:, 2] > 0).all()
    order, other = (np.lexsort(mesh.positions.T) for mesh in (plain, turned))
    np.testing.assert_array_equal(plain.normals[order], -turned.normals[other])
    curvatures, negative = dict(plain.attributes), dict(turned.attributes)
    np.testing.assert_array_equal(
        curvatures["mean_curvature"][order], -negative["mean_curvature"][other]
    )
    np.testing.assert_array_equal(
        curvatures["gaussian_curvature"][order], negative["gaussian_curvature"][other]
    )
    assert plain.report.curvature is not None


def test_a_crease_inside_a_face_has_two_normals() -> None:
    # A sheet of degree 1 along u, folded at u = 1/2.
    net = np.array([[[x, y, abs(x - 1.0)] for y in (0.0, 1.0)] for x in (0.0, 1.0, 2.0)])
    mesh = build(build_grid(net, (1, 1), 4))
    assert mesh.normals is not None
    np.testing.assert_allclose(np.abs(mesh.normals[:, 0]), 0.5**0.5)
    on_fold = mesh.positions[:, 0] == 1
    assert np.count_nonzero(on_fold) == 10
    assert len(np.unique(mesh.positions[on_fold], axis=0)) == 5
    # Each triangle has the normals of its own side of the fold.
    sides = np.sign(mesh.positions[mesh.triangles].mean(axis=1)[:, 0] - 1)
    np.testing.assert_array_equal(
        np.sign(mesh.normals[mesh.triangles][:, :, 0]), -np.repeat(sides[:, None], 3, axis=1)
    )


def test_the_apex_of_a_cone_has_the_normals_of_its_sides() -> None:
    # A pyramid-like patch whose side u = 1 is a point.
    rim = np.array([[2.0, 0, 0], [2.0, 2.0, 0], [0.0, 2.0, 0]])
    net = np.stack([rim, np.tile([0.0, 0, 1.0], (3, 1))])
    mesh = build(build_grid(net, (1, 2), 4))
    assert mesh.normals is not None
    assert np.isfinite(mesh.normals).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
    apex = mesh.positions[:, 2] == 1
    assert np.count_nonzero(apex) > 1
    assert mesh.report.poles_repaired > 0
    # The normal at a corner is that of its triangle, nearly: the patch is developable.
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    across /= np.linalg.norm(across, axis=1)[:, None]
    assert (np.vecdot(across[:, None], mesh.normals[mesh.triangles]) > 0.9).all()


def test_parameters_are_those_of_the_surface() -> None:
    net = np.array([[[x, y, abs(x - 1.0)] for y in (0.0, 1.0)] for x in (0.0, 1.0, 2.0)])
    mesh = build(build_grid(net, (1, 1), 4), uvs=True)
    assert mesh.uvs is not None
    np.testing.assert_allclose(mesh.uvs * [2, 1], mesh.positions[:, :2], atol=1e-9)


def test_an_angle_is_measured() -> None:
    mesh = build(build_cube(), Goal(0.01, angle=0.5))
    assert mesh.report.normal_angle == 0
    mesh = build(build_cube(), Goal(0.01, angle=0.5), normals=False, crease_angle=pi)
    assert mesh.normals is None
    assert mesh.report.normal_angle == pytest.approx(np.arccos(-1 / 3))
