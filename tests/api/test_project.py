"""POST /v1/project: surfaces, groups and curves, and refused requests."""

import io
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.api.models.project import ClosestPoints
from service.settings.values import Settings
from service.surface.examples import EXAMPLES
from tests.api.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
QUARTER = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, 0.5**0.5, 1]}
SWEPT = {"trefoil-tube", "helix-ribbon"}


def ask(client: Client, **fields: Any) -> Any:
    response = client.post("/v1/project", fields)
    assert response.status_code == 200, response.text
    ClosestPoints.model_validate_json(response.content)
    return response.json()


def test_a_square(client: Client) -> None:
    result = ask(client, surface={"control_net": NET}, points=[[0.25, 0.5, 2], [3, 0.5, 0]])
    assert result["positions"] == [[0.25, 0.5, 0], [1, 0.5, 0]]
    assert result["distances"] == [2, 2]
    assert result["uv"] == [[0.25, 0.5], [1, 0.5]]
    assert "patch" not in result
    assert result["on_boundary"] == [False, True]
    assert result["normals"] == [[0, 0, 1]] * 2
    assert result["reached"] == [True] * 2
    assert result["tied"] == [False] * 2
    for low, high in result["distance_bounds"]:
        assert 2 - 1e-8 < low <= 2 <= high < 2 + 1e-13


def test_signs_of_a_closed_and_of_an_open_surface(client: Client) -> None:
    sphere = client.get("/v1/surfaces/sphere").json()["surface"]
    points = [[0, 0, 0.5], [0, 0, 1], [0, 1, 1]]
    assert ask(client, surface=sphere, points=points, sign=True)["signs"] == [-1, None, 1]
    assert (
        ask(client, surface={"control_net": NET}, points=points, sign=True)["signs"] == [None] * 3
    )
    assert "signs" not in ask(client, surface=sphere, points=points)


def test_a_curve_in_the_plane(client: Client) -> None:
    result = ask(client, curve=QUARTER, points=[[3, 4], [5, -1]])
    assert result["positions"] == [pytest.approx([0.6, 0.8]), [1, 0]]
    assert result["tangents"] == [pytest.approx([-0.8, 0.6]), [0, 1]]
    assert result["parameters"][1] == 0
    assert "patch" not in result


@pytest.mark.parametrize("name", sorted(EXAMPLES)[1::2])
def test_every_example_is_closest_to_its_own_points(client: Client, name: str) -> None:
    surface = client.get(f"/v1/surfaces/{name}").json()["surface"]
    mesh = client.post("/v1/mesh?format=json", {"surface": surface, "resolution": 3}).json()
    vertices = mesh["vertices"]
    body = {"surface": surface, "points": vertices[:: len(vertices) // 5 + 1]}
    response = client.post("/v1/project", body)
    if response.status_code == 422:
        assert response.json()["errors"][0]["code"] == "not_parametric"
        assert response.json()["errors"][0]["pointer"] == "/surface"
        return
    result = response.json()
    assert max(result["distances"]) < 2e-9 * np.ptp(mesh["vertices"], axis=0).max()
    low, high = np.array(result["distance_bounds"]).T
    assert (low <= high).all()


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({"points": [[0, 0, 0]]}, "missing_field", "/surface"),
        ({"surface": {"control_net": NET}, "curve": QUARTER, "points": [[0, 0, 0]]},
         "conflicting_options", "/curve"),
        ({"curve": QUARTER, "points": [[0, 0]], "sign": True}, "conflicting_options", "/sign"),
        ({"surface": {"control_net": NET}}, "missing_field", "/points"),
        ({"surface": {"control_net": NET}, "points": []}, "empty_list", "/points"),
        ({"surface": {"control_net": NET}, "points": [[0, 0]]}, "wrong_dimension", "/points/0"),
        ({"curve": QUARTER, "points": [[0, 0, 0]]}, "wrong_dimension", "/points/0"),
        ({"surface": {"control_net": NET}, "points": [[0, 0, 1e300]]},
         "coordinate_too_large", "/points/0/2"),
        ({"surface": {"control_net": NET}, "points": [[0, 0, 0]], "relative_tolerance": 0},
         "out_of_range", "/relative_tolerance"),
        ({"surface": {"control_net": [[[0, 0, 0]]]}, "points": [[0, 0, 0]]},
         "too_few_points", "/surface/control_net"),
    ],
)  # fmt: skip
def test_invalid_requests_are_refused(client: Client, fields: Any, code: str, pointer: str) -> None:
    response = client.post("/v1/project", fields)
    assert response.status_code == 422, response.text
    issue = response.json()["errors"][0]
    assert (issue["code"], issue["pointer"]) == (code, pointer)


def test_too_many_points_are_refused_before_any_work() -> None:
    with start_client(create_app(Settings(max_points=2))) as client:
        body = {"surface": {"control_net": NET}, "points": [[0, 0, 0]] * 3}
        response = client.post("/v1/project", body)
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == "too_many_points"


NPY = {"Content-Type": "application/x-npy"}


def save_npy(array: object, dtype: str = "<f8") -> bytes:
    file = io.BytesIO()
    np.save(file, np.asarray(array, dtype))
    return file.getvalue()


def test_points_in_a_file_of_numpy(client: Client) -> None:
    points = [[0, 0, 0.5], [0, 2, 1]]
    surface = client.get("/v1/surfaces/sphere").json()["surface"]
    expected = ask(client, surface=surface, points=points, sign=True, relative_tolerance=1e-6)
    stored = client.post("/v1/surfaces", {"surface": surface}).json()["id"]
    for name, dtype in (("sphere", "<f8"), (stored, ">f4")):
        query = f"?surface={name}&sign=true&relative_tolerance=1e-6"
        response = client.request("POST", f"/v1/project{query}", save_npy(points, dtype), NPY)
        assert response.json() == expected, response.text


@pytest.mark.parametrize(
    ("query", "body", "code", "place"),
    [
        ("", save_npy([[0, 0, 0]]), "missing_field", {"parameter": "surface"}),
        ("?surface=no", save_npy([[0, 0, 0]]), "unknown_surface", {"parameter": "surface"}),
        ("?surface=sphere&points=1", save_npy([[0, 0, 0]]), "unknown_field",
         {"parameter": "points"}),
        ("?surface=sphere&curve=1", save_npy([[0, 0, 0]]), "wrong_type", {"parameter": "curve"}),
        ("?surface=sphere&sign=maybe", save_npy([[0, 0, 0]]), "wrong_type", {"parameter": "sign"}),
        ("?surface=sphere&sign=true&sign=true", save_npy([[0, 0, 0]]), "repeated_key",
         {"parameter": "sign"}),
        ("?surface=sphere&relative_tolerance=0", save_npy([[0, 0, 0]]), "out_of_range",
         {"parameter": "relative_tolerance"}),
        ("?surface=sphere", save_npy([0, 0, 0]), "wrong_type", {"pointer": "/points/0"}),
        ("?surface=sphere", save_npy([[0, 0]]), "wrong_dimension", {"pointer": "/points/0"}),
        ("?surface=sphere", save_npy(np.zeros((0, 3))), "empty_list", {"pointer": "/points"}),
        ("?surface=sphere", save_npy([[0, 0, np.nan]]), "not_finite", {"pointer": "/points/0/2"}),
        ("?surface=sphere", save_npy([[0, 0, 0]])[:-1], "malformed_body", {"pointer": ""}),
    ],
)  # fmt: skip
def test_files_that_are_refused(
    client: Client, query: str, body: bytes, code: str, place: dict[str, str]
) -> None:
    response = client.request("POST", f"/v1/project{query}", body, NPY)
    statuses = {"unknown_surface": 404, "malformed_body": 400}
    assert response.status_code == statuses.get(code, 422), response.text
    issue = response.json()["errors"][0]
    assert issue["code"] == code
    assert place.items() <= issue.items()
