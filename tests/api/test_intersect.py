"""POST /v1/intersect with rays: surfaces, groups, files of rays, and refused requests."""

from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.api.models.queries import RayHits
from service.settings.values import Settings
from tests.api.test_project import NPY_HEADERS, save_npy
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
DOWN = {"origins": [[0.25, 0.5, 2], [3, 0.5, 2]], "directions": [[0, 0, -4]]}
"""Two rays with one direction; only the first hits `NET`. `t` is in lengths of the direction, 4."""


def intersect(client: Client, **fields: Any) -> Any:
    """The valid response to a request with these fields."""
    response = client.post("/v1/intersect", fields)
    assert response.status_code == 200, response.text
    RayHits.model_validate_json(response.content)
    return response.json()


def test_a_ray_hits_a_square_at_its_parameters(client: Client) -> None:
    result = intersect(client, surface={"control_net": NET}, rays=DOWN)
    bounds = result.pop("t_bounds")
    assert result == {
        "reached": [True, True], "counts": [1, 0], "ray": [0], "t": [0.5],
        "positions": [[0.25, 0.5, 0]], "uv": [[0.25, 0.5]], "normals": [[0, 0, 1]],
        "kind": ["crossing"], "entering": [True],
    }  # fmt: skip
    assert 0.5 - 1e-12 < bounds[0][0] <= 0.5 <= bounds[0][1] < 0.5 + 1e-12


def test_patches_are_numbered_over_all_members_of_a_group(client: Client) -> None:
    member = {"type": "bezier", "control_net": NET}
    raised_member = {
        "surface": member,
        "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]],
    }
    group = {"type": "group", "members": [{"surface": member}, raised_member]}
    result = intersect(client, surface=group, rays=DOWN, hits="all")
    assert result["patch"] == [1, 0]
    assert result["t"] == [0.25, 0.5]
    assert intersect(client, surface=group, rays=DOWN)["patch"] == [1]


def test_rays_in_an_array_and_in_json_give_equal_hits(client: Client) -> None:
    surface = client.get("/v1/surfaces/sphere").json()["surface"]
    rows = np.array([[0, 0, 4, 0, 0, -2], [3, 0.25, 0, -1, 0, 0]])
    rays = {"origins": rows[:, :3].tolist(), "directions": rows[:, 3:].tolist()}
    expected = intersect(client, surface=surface, rays=rays, hits="all", relative_thickness=1e-6)
    stored = client.post("/v1/surfaces", {"surface": surface}).json()["id"]
    for name, dtype in (("sphere", "<f8"), (stored, ">f4")):
        query = f"?surface={name}&hits=all&relative_thickness=1e-6&format=json"
        response = client.request(
            "POST", f"/v1/intersect{query}", save_npy(rows, dtype), NPY_HEADERS
        )
        assert response.json() == expected, response.text


@pytest.mark.parametrize(
    ("query", "rows", "code", "location"),
    [
        ("?surface=sphere", [[0, 0, 0]], "wrong_dimension", {"pointer": "/rays"}),
        ("?surface=sphere", np.zeros((0, 6)), "empty_list", {"pointer": "/rays/origins"}),
        ("?surface=sphere", [[0] * 6], "zero_direction", {"pointer": "/rays/directions/0"}),
        ("?surface=sphere&rays=1", [[0] * 6], "unknown_field", {"parameter": "rays"}),
        ("?surface=sphere&hits=two", [[1] * 6], "wrong_value", {"parameter": "hits"}),
        ("?surface=sphere&format=svg", [[1] * 6], "unsupported_by_format",
         {"parameter": "format"}),
    ],
)  # fmt: skip
def test_invalid_files_of_rays_are_refused(
    client: Client, query: str, rows: Any, code: str, location: dict[str, str]
) -> None:
    response = client.request("POST", f"/v1/intersect{query}", save_npy(rows), NPY_HEADERS)
    assert response.status_code == 422, response.text
    issue = response.json()["errors"][0]
    assert issue["code"] == code
    assert location.items() <= issue.items()


RAYS = {"origins": [[1.1, 1.2, 50]], "directions": [[0, 0, -1]]}


def test_a_tube_is_refused(client: Client) -> None:
    tube = client.get("/v1/surfaces/trefoil-tube").json()["surface"]
    response = client.post("/v1/intersect", {"surface": tube, "rays": RAYS})
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == "not_parametric"


def test_hits_of_a_surface_with_one_domain_name_no_patch(client: Client) -> None:
    spline = client.get("/v1/surfaces/bspline-hills").json()["surface"]
    hits = intersect(client, surface=spline, rays=RAYS)
    assert hits["kind"] == ["crossing"]
    assert "patch" not in hits


def test_too_many_rays_are_refused() -> None:
    settings = Settings(max_points=10)
    with start_client(create_app(settings)) as client:
        rays = {"origins": [[0, 0, 1]] * 11, "directions": [[0, 0, -1]]}
        response = client.post("/v1/intersect", {"surface": {"control_net": NET}, "rays": rays})
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == "too_many_rays"
