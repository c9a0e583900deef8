"""Groups and wireframes over HTTP: what they answer, and what has no meaning for them."""

import json
from collections.abc import Iterator
from typing import Any

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tests.api.client import Client, client_of

NET = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
IDENTITY = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
GROUP = {"type": "group", "members": [{"surface": NET, "name": "sail", "matrix": IDENTITY}]}


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    settings = Settings(max_control_points=64)
    with client_of(create_app(settings)) as client:
        yield client


def refused(client: Client, address: str, body: dict[str, Any]) -> tuple[str, str]:
    answer = client.post(address, body)
    assert answer.status_code == 422
    error = answer.json()["errors"][0]
    return error["code"], error["pointer"]


def test_control_points_of_all_members_count_together(client: Client) -> None:
    """Sixteen members of four points are as many as are allowed."""
    members = [{"surface": NET}] * 16
    body = {"surface": {"type": "group", "members": members}, "resolution": 1}
    assert client.post("/v1/mesh", body).status_code == 200
    body["surface"] = {"type": "group", "members": [*members, {"surface": NET}]}
    found = refused(client, "/v1/mesh", body)
    assert found == ("too_many_control_points", "/surface/members")


def test_keys_repeated_inside_members_are_found(client: Client) -> None:
    text = json.dumps({"surface": GROUP}).replace('"name": "sail"', '"name": "a", "name": "b"')
    answer = client.request(
        "POST", "/v1/mesh", iter([text.encode()]), {"Content-Type": "application/json"}
    )
    assert answer.status_code == 422
    error = answer.json()["errors"][0]
    assert (error["code"], error["pointer"]) == ("repeated_key", "/surface/members/0/name")


def test_a_group_is_listed_with_its_patches(client: Client) -> None:
    listed = {entry["id"]: entry for entry in client.get("/v1/surfaces").json()["surfaces"]}
    tea = listed["tea-service"]
    # A tray of 12, the pot of 32, four saucers of 8 and four cups of 16 patches.
    assert tea["patches"] == 12 + 32 + 4 * 8 + 4 * 16
    assert tea["degree"] == [3, 3]
    assert tea["up"] == "z"


def test_the_wireframe_of_the_teapot_is_one_request(client: Client) -> None:
    """As lines, and as tubes in a format that has no lines."""
    address = "/v1/surfaces/utah-teapot/mesh"
    lines = client.get(f"{address}.json?faces=none&isocurves=1&resolution=4").json()
    assert lines["faces"] == []
    (overlay,) = lines["lines"]
    assert overlay["name"] == "isocurves"
    # 68 borders that are no points, in four divisions each.
    assert len(overlay["segments"]) == 68 * 4
    tubes = client.get(f"{address}.stl?faces=none&isocurves=1&resolution=4&wires=tubes")
    assert tubes.status_code == 200
    refusal = client.get(f"{address}.stl?isocurves=1").json()["errors"][0]
    assert (refusal["code"], refusal["parameter"]) == ("unsupported_by_format", "wires")
