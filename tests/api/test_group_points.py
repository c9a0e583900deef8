"""POST /v1/points on groups: faces and patches of all members, counted one after the other."""

from typing import Any

import numpy as np
import pytest

from tests import breps
from tests.breps import build_box
from tools.client import Client

PLATE = breps.PLATE | {"up": "y"}
NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
SPLINE = {
    "type": "bspline",
    "degree": 1,
    "control_net": [[[2 * i, j, i * i * j] for j in range(2)] for i in range(3)],
    "knots": [[0, 0, 2, 5, 5], [0, 0, 1, 1]],
}
TRIANGLE = {"type": "triangle", "control_net": [[[0, 0, 0], [1, 0, 0]], [[0, 1, 0]]]}
MIRRORING = [[0, 2, 0, 5], [3, 0, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]
"""Mirrors, and scales by different factors."""
TURNING = [[0, -2, 0, 1], [2, 0, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]]


def build_group(*members: tuple[Any, Any], **fields: Any) -> dict[str, Any]:
    """A group of members, each a surface and a placement or None."""
    return {
        "type": "group",
        "members": [
            {"surface": surface} if matrix is None else {"surface": surface, "matrix": matrix}
            for surface, matrix in members
        ],
        **fields,
    }


MIXED = build_group(({"control_net": NET}, None), (PLATE, TURNING), (SPLINE, MIRRORING))
"""The numbers: 0, the patch; 1, the face of the plate; 2 and 3, the spans of the B-spline."""


def evaluate(client: Client, surface: Any, **fields: Any) -> dict[str, Any]:
    response = client.post("/v1/points", {"surface": surface, **fields})
    assert response.status_code == 200, response.text
    result: dict[str, Any] = response.json()
    return result


def refuse(client: Client, surface: Any, **fields: Any) -> tuple[str, str]:
    response = client.post("/v1/points", {"surface": surface, **fields})
    assert response.status_code == 422
    error = response.json()["errors"][0]
    return error["code"], error["pointer"]


def place(points: Any, matrix: Any) -> Any:
    placed = np.asarray(points) @ np.array(matrix)[:3, :3].T + np.array(matrix)[:3, 3]
    return placed


def test_faces_and_patches_of_members_are_counted_one_after_the_other(client: Client) -> None:
    result = evaluate(client, MIXED, uv=[[0.25, 0.5]] * 4, patch=[0, 1, 2, 3])
    plate = place([[2.5, 5, 0]], TURNING)[0]
    # u and v of a mirrored patch are exchanged, so that its normals stay on their side.
    spans = place([[1, 0.25, 0.125], [3, 0.25, 0.625]], MIRRORING)
    np.testing.assert_allclose(result["positions"][:2], [[0.25, 0.5, 0.125], plate], atol=1e-12)
    np.testing.assert_allclose(result["positions"][2:], spans, atol=1e-12)
    assert result["inside"] == [True] * 4


def test_faces_of_placed_breps_have_the_parameters_of_their_surfaces(client: Client) -> None:
    """Points, partials and curvatures are those after the placement; `inside` does not change."""
    uv = [[0.1, 0.5], [0.5, 0.5], [0.7, 0.5], [0.5, 0]]
    alone = evaluate(client, PLATE, uv=uv)
    for matrix in (TURNING, MIRRORING):
        group = build_group((build_box(), None), (PLATE, matrix), (PLATE, None))
        placed = evaluate(client, group, uv=uv, patch=6)
        np.testing.assert_allclose(placed["positions"], place(alone["positions"], matrix))
        np.testing.assert_allclose(placed["du"], np.array(alone["du"]) @ np.array(matrix)[:3, :3].T)
        normals = np.cross(placed["du"], placed["dv"])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        np.testing.assert_allclose(placed["normals"], normals, atol=1e-14)
        assert placed["inside"] == alone["inside"] == [True, False, None, None]
        assert evaluate(client, group, uv=uv, patch=7) == alone


def test_curvatures_are_those_of_the_placed_surface(client: Client) -> None:
    ball = {"type": "bezier", "control_net": [[[x, y, x * x + y * y] for y in (-1, 0, 1)]
                                              for x in (-1, 0, 1)]}  # fmt: skip
    half = [[0.5, 0, 0, 9], [0, 0.5, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 1]]
    uv = [[0.5, 0.5], [0.2, 0.9]]
    alone = evaluate(client, ball, uv=uv, derivatives=2)
    group = build_group((PLATE, None), (ball, half))
    placed = evaluate(client, group, uv=uv, patch=1, derivatives=2)
    np.testing.assert_allclose(placed["mean_curvature"], 2 * np.array(alone["mean_curvature"]))
    face = {"type": "brep", "faces": [{"surface": ball}]}
    group = build_group((face, half))
    assert evaluate(client, group, uv=uv, derivatives=2) == placed


@pytest.mark.parametrize("matrix", [None, TURNING, MIRRORING])
@pytest.mark.parametrize("surface", [{"control_net": NET}, SPLINE, TRIANGLE])
def test_the_answer_of_a_projection_names_the_same_point(
    client: Client, surface: Any, matrix: Any
) -> None:
    group = build_group(({"control_net": NET}, None), (surface, matrix))
    target = [[9, 9, 9], [-3, 1, 2], [1, 1, -5]]
    closest = client.post("/v1/project", {"surface": group, "points": target}).json()
    is_triangle = surface is TRIANGLE and matrix is not MIRRORING
    for position, uv, patch in zip(
        closest["positions"], closest["uv"], closest["patch"], strict=True
    ):
        places: dict[str, Any] = {"uv": [uv]}
        if is_triangle and patch == 1:
            places = {"barycentric": [[1 - sum(uv), *uv]]}
        result = evaluate(client, group, patch=patch, **places)
        np.testing.assert_allclose(result["positions"], [position], atol=1e-9)
        assert "inside" not in result


def test_equal_members_are_evaluated_alike(client: Client) -> None:
    """Definitions, members below others, and another vertical axis."""
    up = build_group((build_box(), None), up="z")
    definitions = {
        "type": "group",
        "definitions": [build_box()],
        "members": [
            {"name": "a"},
            {"definition": 0, "parent": 0, "matrix": TURNING},
            {"definition": 0, "parent": 1, "matrix": TURNING},
        ],
    }
    uv, numbers = [[0.5, 0.25]] * 12, list(range(12))
    alone = np.array(evaluate(client, build_box(), uv=uv[:6], patch=numbers[:6])["positions"])
    found = np.array(evaluate(client, definitions, uv=uv, patch=numbers)["positions"])
    np.testing.assert_allclose(found[:6], place(alone, TURNING), atol=1e-12)
    np.testing.assert_allclose(found[6:], place(place(alone, TURNING), TURNING), atol=1e-12)
    turned = np.array(evaluate(client, up, uv=uv[:6], patch=numbers[:6])["positions"])
    np.testing.assert_allclose(turned, alone[:, [0, 2, 1]] * [1, -1, 1], atol=1e-12)


def test_nets_that_are_placed_together_do_not_matter(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(5)
    uv, numbers = rng.random((40, 2)).tolist(), rng.integers(0, 4, 40).tolist()
    expected = evaluate(client, MIXED, uv=uv, patch=numbers, derivatives=2)
    monkeypatch.setattr("service.engine.parts.points.CHUNK", 13)
    found = evaluate(client, MIXED, uv=uv, patch=numbers, derivatives=2)
    for name, column in expected.items():
        np.testing.assert_allclose(
            np.array(found[name], float), np.array(column, float), atol=1e-12, err_msg=name
        )


def test_refusals_point_into_the_request(client: Client) -> None:
    uv = [[0.5, 0.5]]
    assert refuse(client, MIXED, uv=uv) == ("missing_field", "/patch")
    assert refuse(client, MIXED, uv=uv, patch=4) == ("index_out_of_range", "/patch")
    assert refuse(client, MIXED, uv=[[0.5, 2]], patch=1) == ("outside_domain", "/uv/0/1")
    place = {"barycentric": [[1, 0, 0]]}
    assert refuse(client, MIXED, **place, patch=1) == ("wrong_parameters", "/barycentric/0")
    group = build_group((PLATE, None), (TRIANGLE, None))
    assert refuse(client, group, uv=uv, patch=1) == ("wrong_parameters", "/uv/0")
    ribbon = {"type": "ribbon", "curve": {"control_points": [[0, 0, 0], [1, 0, 0]]}, "width": 1}
    group = build_group((PLATE, None), (ribbon, None))
    pointer = "/surface/members/1/surface"
    assert refuse(client, group, uv=uv, patch=0) == ("not_parametric", pointer)
    corners = [[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]]  # clockwise
    loop = {"pcurves": [{"control_points": corners[k : k + 2]} for k in range(4)]}
    wrong = {"type": "brep", "faces": [{"surface": {"control_net": NET}, "loops": [loop]}]}
    group = build_group((PLATE, None), (wrong, None))
    pointer = "/surface/members/1/surface/faces/0/loops/0"
    assert refuse(client, group, uv=uv, patch=1) == ("loop_reversed", pointer)
    group["members"][1] = {"surface": wrong | {"invalid_faces": "skip"}}
    assert evaluate(client, group, uv=uv, patch=1)["inside"] == [None]
