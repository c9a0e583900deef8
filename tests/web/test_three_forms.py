"""Every form of a surface and of a curve as three.js has it, in headless Chromium."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree

from service.encoders.curves.format import in_space
from service.encoders.curves.registry import CURVES_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.build import build
from service.engine.curvatures.placement_scale import add_stretches
from service.pipeline.curve import plan_curve
from service.pipeline.mesh import render
from service.schemas.curves import CurveRequest
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from tests.forms import CURVES, REQUESTS
from tests.web.browser import Stage
from tests.web.clients import to_linear


def turn_rows(up: str, *columns: Any) -> np.ndarray:
    """Rows of vectors, turned into a scene with y up."""
    turn = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) if up == "z" else np.eye(3)
    return np.hstack([np.asarray(column, float).reshape(-1, 3) @ turn for column in columns])


def check_near(rows: np.ndarray, expected: np.ndarray) -> None:
    """Checks that every row of the first array is a row of the second."""
    distance, _ = KDTree(expected).query(rows)
    assert distance.max() < 1e-5


def check_same(rows: np.ndarray, expected: np.ndarray) -> None:
    """Checks that both arrays have the same set of rows."""
    check_near(rows, expected)
    check_near(expected, rows)


@pytest.mark.parametrize("form", list(REQUESTS)[::2])  # the validator tests all forms
def test_forms_are_drawn_where_they_are(stage: Stage, form: str) -> None:
    """Every corner with its normal, every colour, every texture coordinate, every line."""
    request = validate_document(MeshRequest, REQUESTS[form])
    surface, options = request.to_surface(), request.mesh_options()
    stage.show(render(surface, options, BY_NAME["glb"]))
    meshes, lines = stage.meshes(), stage.lines()
    assert stage.page.evaluate("window.viewer.measure()")["coverage"] > 0
    model = surface.lower()
    mesh = build(add_stretches(model) if options.curvatures else model, options)
    positions = mesh.positions + mesh.origin
    assert sum(drawn["triangles"] for drawn in meshes) == len(mesh.triangles)
    if len(mesh.triangles):
        assert mesh.normals is not None
        assert max(drawn["longestNormalError"] for drawn in meshes) < 1e-6
        result = [np.hstack([drawn["positions"], drawn["normals"]]) for drawn in meshes]
        check_same(np.concatenate(result), turn_rows(mesh.up, positions, mesh.normals))
    if mesh.colors is not None:
        light = mesh.colors.astype(float)
        light[:, :3] = to_linear(light[:, :3])
        # Only members with colours; if they are one mesh, all colours have an opacity.
        painted = [drawn for drawn in meshes if drawn["colors"]]
        colors = np.concatenate([drawn["colors"] for drawn in painted])
        shown = np.hstack([np.concatenate([drawn["positions"] for drawn in painted]), colors])
        check_near(shown, np.hstack([turn_rows(mesh.up, positions), light[:, : colors.shape[1]]]))
        assert form.startswith("group") or painted == meshes
    if mesh.uvs is not None:
        result = [np.hstack([drawn["positions"], drawn["uvs"]]) for drawn in meshes]
        check_same(np.concatenate(result), np.hstack([turn_rows(mesh.up, positions), mesh.uvs]))
    assert [drawn["name"] for drawn in lines] == [overlay.name for overlay in mesh.overlays]
    for drawn, overlay in zip(lines, mesh.overlays, strict=True):
        assert drawn["type"] == "LineSegments"
        assert drawn["segments"] == len(overlay.segments)
        check_same(
            np.array(drawn["positions"]), turn_rows(mesh.up, overlay.positions + mesh.origin)
        )


@pytest.mark.parametrize("name", CURVES)
def test_every_curve_is_drawn_where_it_is(stage: Stage, name: str) -> None:
    request = validate_document(CurveRequest, {"curve": CURVES[name], "resolution": 5})
    curve, options = request.to_curve(), request.curve_options()
    stage.show(plan_curve(curve, options, CURVES_BY_NAME["glb"]).run())
    (line,) = stage.lines()
    assert line["type"] == "Line"
    assert {"_arc_length", "_parameter", "_tangent", "position"} == set(line["attributes"])
    assert stage.page.evaluate("window.viewer.measure()")["coverage"] > 0
    reported = json.loads(plan_curve(curve, options, CURVES_BY_NAME["json"]).run())
    points = in_space(np.array(reported["points"]))
    np.testing.assert_allclose(line["positions"], turn_rows(curve.up, points), atol=1e-6)
