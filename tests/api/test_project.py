"""POST /v1/project: points on surfaces and curves, files of points, and refused requests."""

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.api.models.queries import ClosestPoints
from service.settings.values import Settings
from tools.client import Client, start_client
from tools.examples import UNTRIMMED

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
QUARTER = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, 0.5**0.5, 1]}


def project(client: Client, **fields: Any) -> Any:
    """The valid response to a request with these fields."""
    response = client.post("/v1/project", fields)
    assert response.status_code == 200, response.text
    ClosestPoints.model_validate_json(response.content)
    return response.json()


def test_closest_points_on_a_square(client: Client) -> None:
    result = project(client, surface={"control_net": NET}, points=[[0.25, 0.5, 2], [3, 0.5, 0]])
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


def test_points_have_signs_only_for_closed_surfaces(client: Client) -> None:
    sphere = client.get("/v1/surfaces/sphere").json()["surface"]
    points = [[0, 0, 0.5], [0, 0, 1], [0, 1, 1]]  # inside, on and outside the sphere
    assert project(client, surface=sphere, points=points, sign=True)["signs"] == [-1, None, 1]
    assert (
        project(client, surface={"control_net": NET}, points=points, sign=True)["signs"]
        == [None] * 3
    )
    assert "signs" not in project(client, surface=sphere, points=points)


def test_closest_points_on_a_curve_in_the_plane(client: Client) -> None:
    result = project(client, curve=QUARTER, points=[[3, 4], [5, -1]])
    assert result["positions"] == [pytest.approx([0.6, 0.8]), [1, 0]]
    assert result["tangents"] == [pytest.approx([-0.8, 0.6]), [0, 1]]
    assert result["parameters"][1] == 0
    assert "patch" not in result


# Every second example, to save time.
@pytest.mark.parametrize("name", sorted(UNTRIMMED)[1::2])
def test_vertices_of_an_examples_mesh_are_on_its_surface(client: Client, name: str) -> None:
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
    # The default tolerance is 1e-9 of the diagonal of the control points: about 2e-9 of a side.
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


def test_too_many_points_are_refused() -> None:
    with start_client(create_app(Settings(max_points=2))) as client:
        body = {"surface": {"control_net": NET}, "points": [[0, 0, 0]] * 3}
        response = client.post("/v1/project", body)
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == "too_many_points"


NPY_HEADERS = {"Content-Type": "application/x-npy"}


def save_npy(array: object, dtype: str = "<f8") -> bytes:
    """The `.npy` file of these numbers."""
    file = io.BytesIO()
    np.save(file, np.asarray(array, dtype))
    return file.getvalue()


def test_points_in_an_array_and_in_json_give_equal_results(client: Client) -> None:
    points = [[0, 0, 0.5], [0, 2, 1]]
    surface = client.get("/v1/surfaces/sphere").json()["surface"]
    expected = project(client, surface=surface, points=points, sign=True, relative_tolerance=1e-6)
    stored = client.post("/v1/surfaces", {"surface": surface}).json()["id"]
    for name, dtype in (("sphere", "<f8"), (stored, ">f4")):
        query = f"?surface={name}&sign=true&relative_tolerance=1e-6"
        response = client.request(
            "POST", f"/v1/project{query}", save_npy(points, dtype), NPY_HEADERS
        )
        assert response.json() == expected, response.text


@pytest.mark.parametrize(
    ("query", "body", "code", "location"),
    [
        ("", save_npy([[0, 0, 0]]), "missing_field", {"parameter": "surface"}),
        ("?surface=no", save_npy([[0, 0, 0]]), "unknown_surface", {"parameter": "surface"}),
        ("?surface=sphere&points=1", save_npy([[0, 0, 0]]), "unknown_field",
         {"parameter": "points"}),
        # The request has a field `curve`, but its value is an object, which no query can have.
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
def test_invalid_files_are_refused(
    client: Client, query: str, body: bytes, code: str, location: dict[str, str]
) -> None:
    response = client.request("POST", f"/v1/project{query}", body, NPY_HEADERS)
    statuses = {"unknown_surface": 404, "malformed_body": 400}
    assert response.status_code == statuses.get(code, 422), response.text
    issue = response.json()["errors"][0]
    assert issue["code"] == code
    assert location.items() <= issue.items()


def test_a_surface_above_the_limits_is_named_by_its_parameter() -> None:
    """An instance with wider limits stored the surface that the query of a file names."""
    unlimited_app, limited_app = create_app(Settings()), create_app(Settings(max_control_points=5))
    limited_app.state.services = replace(
        limited_app.state.services, store=unlimited_app.state.services.store
    )
    with start_client(unlimited_app) as client:
        surface = {"control_net": [*NET, [[2, 0, 0], [2, 1, 0]]]}  # 6 points
        id = client.post("/v1/surfaces", {"surface": surface}).json()["id"]
    with start_client(limited_app) as client:
        response = client.request(
            "POST", f"/v1/project?surface={id}", save_npy([[0, 0, 0]]), NPY_HEADERS
        )
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["parameter"]) == ("too_many_control_points", "surface")
