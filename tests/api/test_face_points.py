"""POST /v1/points on breps: points of the surfaces of faces, inside the trims or not."""

from typing import Any

import numpy as np
import pytest

from service.encoders.json_mesh import points_bound
from tests.breps import PLATE, build_box
from tools.client import Client

SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}


def evaluate(client: Client, surface: Any, **fields: Any) -> Any:
    response = client.post("/v1/points", {"surface": surface, **fields})
    assert response.status_code == 200, response.text
    return response.json()


def refuse(client: Client, surface: Any, **fields: Any) -> tuple[str, str]:
    response = client.post("/v1/points", {"surface": surface, **fields})
    assert response.status_code == 422
    error = response.json()["errors"][0]
    return error["code"], error["pointer"]


@pytest.mark.parametrize("fields", [{}, {"patch": 0}, {"patch": [0, 0, 0, 0]}])
def test_points_of_a_face_with_a_hole(client: Client, fields: dict[str, Any]) -> None:
    uv = [[0.1, 0.5], [0.5, 0.5], [0.7, 0.5], [0.5, 0]]
    result = evaluate(client, PLATE, uv=uv, **fields)
    assert result["inside"] == [True, False, None, None]
    assert result["positions"] == [[1, 5, 0], [5, 5, 0], [7, 5, 0], [5, 0, 0]]
    assert result["normals"] == [[0, 0, 1]] * 4


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_columns_are_those_of_the_surfaces_of_the_faces(client: Client, derivatives: int) -> None:
    rng = np.random.default_rng(3)
    net = rng.normal(size=(4, 3, 3)).tolist()
    knots = [[0, 0, 0, 1, 3, 3, 3], [2, 2, 2, 5, 5, 5]]
    spline = {"type": "bspline", "degree": 2, "control_net": net, "knots": knots}
    brep = {"type": "brep", "faces": [{"surface": SQUARE}, {"surface": spline}]}
    uv = np.stack([3 * rng.random(30), 2 + 3 * rng.random(30)], axis=1).tolist()
    result = evaluate(client, brep, uv=uv, patch=1, derivatives=derivatives)
    expected = evaluate(client, spline, uv=uv, derivatives=derivatives)
    assert result.pop("inside") == [True] * 30
    assert result.keys() == expected.keys()
    for name, column in expected.items():
        np.testing.assert_allclose(result[name], column, rtol=1e-9, atol=1e-11)


def test_each_point_has_its_face(client: Client) -> None:
    uv = [[0.5, 0.5]] * 6
    result = evaluate(client, build_box(), uv=uv, patch=list(range(6)))
    middles = sorted(map(tuple, result["positions"]))
    assert middles == sorted(
        [(1, 1.5, 0), (1, 1.5, 4), (1, 0, 2), (1, 3, 2), (0, 1.5, 2), (2, 1.5, 2)]
    )
    assert result["inside"] == [True] * 6


def test_a_face_that_is_left_out_has_points_but_no_inside(client: Client) -> None:
    corners = [[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]]  # clockwise
    loop = {"pcurves": [{"control_points": corners[k : k + 2]} for k in range(4)]}
    brep = {"type": "brep", "faces": [{"surface": SQUARE, "loops": [loop]}, {"surface": SQUARE}]}
    fields: dict[str, Any] = {"uv": [[0.5, 0.5]] * 2, "patch": [0, 1]}
    assert refuse(client, brep, **fields) == ("loop_reversed", "/surface/faces/0/loops/0")
    result = evaluate(client, brep | {"invalid_faces": "skip"}, **fields)
    assert result["inside"] == [None, True]
    assert result["positions"] == [[0.5, 0.5, 0]] * 2


def test_faces_that_do_not_exist_are_refused(client: Client) -> None:
    uv = [[0.5, 0.5]]
    assert refuse(client, build_box(), uv=uv) == ("missing_field", "/patch")
    assert refuse(client, build_box(), uv=uv, patch=6) == ("index_out_of_range", "/patch")
    assert refuse(client, PLATE, uv=uv, patch=1) == ("index_out_of_range", "/patch")
    assert refuse(client, PLATE, uv=[[0.5, 1.5]]) == ("outside_domain", "/uv/0/1")
    place = {"barycentric": [[1, 0, 0]]}
    assert refuse(client, PLATE, **place) == ("wrong_parameters", "/barycentric/0")


def test_responses_are_within_the_byte_bound(client: Client) -> None:
    uv = (np.random.default_rng(4).random((50, 2)) * 0.1).tolist()
    for order in (0, 1, 2):
        document = {"surface": PLATE, "uv": uv, "derivatives": order}
        assert len(client.post("/v1/points", document).content) <= points_bound(50, order)
