"""Surfaces and curves in three.js: positions, normals, colours, uvs and lines."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree

from service.encoders.polylines.format import in_space
from service.encoders.polylines.registry import CURVES_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.curvatures.placement_scale import add_stretches
from service.pipeline.mesh import render
from service.pipeline.polylines import plan_curve
from service.schemas.curves import CurveRequest
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from tests.forms import CURVES, REQUESTS
from tests.web.clients import to_linear
from tools.browser import Stage
from tools.building import build


def turn_rows(up: str, *columns: Any) -> np.ndarray:
    """The vectors of each column (N, 3), rotated to y up; n columns are joined to (N, 3 n)."""
    rotation = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) if up == "z" else np.eye(3)
    return np.hstack([np.asarray(column, float).reshape(-1, 3) @ rotation for column in columns])


def assert_rows_are_among(rows: np.ndarray, expected: np.ndarray) -> None:
    """Checks that each row of the first array is a row of the second, up to 1e-5."""
    distance, _ = KDTree(expected).query(rows)
    assert distance.max() < 1e-5


def assert_rows_are_equal(rows: np.ndarray, expected: np.ndarray) -> None:
    """Checks that both arrays have the same set of rows, up to 1e-5."""
    assert_rows_are_among(rows, expected)
    assert_rows_are_among(expected, rows)


# Every second request, to save time; other tests read the files of all requests.
@pytest.mark.parametrize("title", list(REQUESTS)[::2])
def test_three_reads_all_attributes_of_the_mesh(stage: Stage, title: str) -> None:
    """three.js reads all positions with their normals, colours and uvs, and all lines."""
    request = validate_document(MeshRequest, REQUESTS[title])
    surface, options = request.to_surface(), request.mesh_options()
    stage.show(render(surface, options, BY_NAME["glb"]))
    meshes, lines = stage.read_meshes(), stage.read_lines()
    assert stage.page.evaluate("window.viewer.measure()")["coverage"] > 0
    model = surface.lower()
    # As in `render`: the curvatures of a group are those after the placement of its members.
    mesh = build(add_stretches(model) if options.curvatures else model, options)
    positions = mesh.positions + mesh.origin
    assert sum(drawn_mesh["triangles"] for drawn_mesh in meshes) == len(mesh.triangles)
    if len(mesh.triangles):
        assert mesh.normals is not None
        assert max(drawn_mesh["maxNormalLengthError"] for drawn_mesh in meshes) < 1e-6
        rows = [
            np.hstack([drawn_mesh["positions"], drawn_mesh["normals"]]) for drawn_mesh in meshes
        ]
        assert_rows_are_equal(np.concatenate(rows), turn_rows(mesh.up, positions, mesh.normals))
    if mesh.colors is not None:
        light = mesh.colors.astype(float)
        light[:, :3] = to_linear(light[:, :3])
        # Only some members of a group have colours. In `mesh`, colours of a group have an opacity.
        with_colors = [drawn_mesh for drawn_mesh in meshes if drawn_mesh["colors"]]
        colors = np.concatenate([drawn_mesh["colors"] for drawn_mesh in with_colors])
        rows_with_colors = np.hstack(
            [np.concatenate([drawn_mesh["positions"] for drawn_mesh in with_colors]), colors]
        )
        assert_rows_are_among(
            rows_with_colors,
            np.hstack([turn_rows(mesh.up, positions), light[:, : colors.shape[1]]]),
        )
        assert title.startswith("group") or with_colors == meshes
    if mesh.uvs is not None:
        rows = [np.hstack([drawn_mesh["positions"], drawn_mesh["uvs"]]) for drawn_mesh in meshes]
        assert_rows_are_equal(
            np.concatenate(rows), np.hstack([turn_rows(mesh.up, positions), mesh.uvs])
        )
    assert [line["name"] for line in lines] == [overlay.name for overlay in mesh.overlays]
    for line, overlay in zip(lines, mesh.overlays, strict=True):
        assert line["type"] == "LineSegments"
        assert line["segments"] == len(overlay.segments)
        assert_rows_are_equal(
            np.array(line["positions"]), turn_rows(mesh.up, overlay.positions + mesh.origin)
        )


@pytest.mark.parametrize("name", CURVES)
def test_three_reads_the_points_of_curves(stage: Stage, name: str) -> None:
    request = validate_document(CurveRequest, {"curve": CURVES[name], "resolution": 5})
    curve, options = request.to_curve(), request.curve_options()
    stage.show(plan_curve(curve, options, CURVES_BY_NAME["glb"]).run())
    (line,) = stage.read_lines()
    assert line["type"] == "Line"
    assert {"_arc_length", "_parameter", "_tangent", "position"} == set(line["attributes"])
    assert stage.page.evaluate("window.viewer.measure()")["coverage"] > 0
    document = json.loads(plan_curve(curve, options, CURVES_BY_NAME["json"]).run())
    points = in_space(np.array(document["points"]))  # points of a curve in the plane get z = 0
    np.testing.assert_allclose(line["positions"], turn_rows(curve.up, points), atol=1e-6)
