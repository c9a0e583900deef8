"""Colours of parts as colours of vertices."""

from dataclasses import replace

import numpy as np

from service.engine.scenes.flattening import flatten
from service.engine.scenes.painting import paint_parts
from service.engine.scenes.scene import Scene, arrange
from service.surface.bezier import BezierSurface
from service.surface.lowered import Color, GroupModel, PatchModel, PlacedModel
from tools.meshes import build_brep, build_silo

RED: Color = (0.8, 0.2, 0.1, 1.0)
BLUE: Color = (0.1, 0.2, 0.9, 1.0)


def test_each_corner_has_the_colour_of_its_part() -> None:
    mesh = build_brep(7, 2)
    painted = paint_parts(mesh)
    assert painted.colors is not None
    assert painted.colors.shape == (len(painted.positions), 3)
    for part in mesh.parts:
        run = slice(*part.triangles)
        corners, before = painted.triangles[run], mesh.triangles[run]
        np.testing.assert_array_equal(painted.positions[corners], mesh.positions[before])
        assert painted.normals is not None
        assert mesh.normals is not None
        np.testing.assert_array_equal(painted.normals[corners], mesh.normals[before])
        expected = (part.color or (1.0, 1.0, 1.0, 1.0))[:3]
        assert (painted.colors[corners] == expected).all()
    assert painted.report == mesh.report


def test_vertices_at_one_position_stay_welded() -> None:
    mesh = build_brep(7, 2)
    # All faces share their vertices, as smooth faces do; so painting must separate some.
    assert mesh.welds is not None
    leaders, number = np.unique(mesh.welds, return_inverse=True)
    shared = replace(
        mesh,
        positions=mesh.positions[leaders],
        normals=None,
        uvs=None,
        triangles=number.astype(np.uint32)[mesh.triangles],
        welds=None,
    )
    painted = paint_parts(shared)
    assert len(painted.positions) > len(shared.positions)
    assert painted.welds is not None
    _, first = np.unique(painted.positions, axis=0, return_index=True)
    assert set(painted.welds.tolist()) == set(first.tolist())
    np.testing.assert_array_equal(painted.positions[painted.welds], painted.positions)
    assert painted.welds.dtype == np.uint32


def test_opacity_has_a_column_of_its_own() -> None:
    mesh = build_brep()
    parts = (*mesh.parts[:2], replace(mesh.parts[2], color=(0.1, 0.2, 0.3, 0.5)), mesh.parts[3])
    painted = paint_parts(replace(mesh, parts=parts))
    assert painted.colors is not None
    assert set(painted.colors[:, 3].tolist()) == {0.5, 1.0}


def test_a_mesh_without_colours_is_not_changed() -> None:
    mesh = build_silo()
    assert paint_parts(mesh) is mesh


def build_scene(*members: PlacedModel) -> Scene:
    sheet = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])).lower()
    assert isinstance(sheet, PatchModel)
    return arrange(GroupModel("group", (sheet,), members), (build_brep(),))


def test_the_colour_of_a_member_does_not_change_faces_with_a_colour() -> None:
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    mesh = flatten(build_scene(PlacedModel("a", 0, BLUE, mirror), PlacedModel("b", 0)))
    assert mesh.colors is not None
    assert [part.color for part in mesh.parts[1:4]] == [RED, BLUE, RED]
    assert [part.color for part in mesh.parts[5:]] == [RED, None, RED]
    for part, expected in zip(
        (*mesh.parts[1:4], *mesh.parts[5:]), (RED, BLUE, RED, RED, (1.0,) * 4, RED), strict=True
    ):
        corners = mesh.triangles[slice(*part.triangles)]
        assert (mesh.colors[corners] == expected[:3]).all()
    assert mesh.report.watertight
