"""POST /v1/estimate."""

from typing import Any

import pytest

from service.api.app import create_app
from service.encoders.registry import BY_NAME
from service.settings.values import Settings
from tests.api.client import Client, client_of

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}
JSON = {"Content-Type": "application/json"}


def test_it_tells_what_the_mesh_is_and_how_long(client: Client) -> None:
    body = client.get("/v1/surfaces/utah-teapot").json() | {"resolution": [3, 5]}
    told = client.post("/v1/estimate", body).json()
    report = client.post("/v1/mesh", body).json()["report"]
    assert told["exact"] is True
    assert {name: told[name] for name in ("vertices", "triangles", "quads")} == {
        name: report[name] for name in ("vertices", "triangles", "quads")
    }
    assert list(told["bytes"]) == list(BY_NAME)
    for name, size in told["bytes"].items():
        length = len(client.post(f"/v1/mesh?format={name}", body).content)
        assert length == size if name in told["exact_bytes"] else length <= size


def test_one_format_alone(client: Client) -> None:
    body = {"surface": SURFACE, "faces": "quads"}
    told = client.post("/v1/estimate?format=stl", body).json()
    assert (told["accepted"], told["bytes"]) == (False, {})
    assert [refused["formats"] for refused in told["refused"]] == [["stl"]]
    assert client.post("/v1/estimate?format=ply", body).json()["accepted"] is True
    answer = client.post("/v1/estimate?format=fbx", body)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["code"] == "unknown_format"


@pytest.mark.parametrize(
    "options",
    [
        {"resolution": 60_000},
        {"faces": "quads"},
        {"overlays": ["boundary"]},
        {"isocurves": 1, "wires": "tubes", "wire_width": 1e38},
        {"method": "forward_difference"},
        {"resolution": 300},
    ],
)
def test_the_verdict_is_that_of_the_mesh(options: dict[str, Any]) -> None:
    settings = Settings(max_response_bytes=1_000_000, max_vertices=100_000)
    body = {"surface": SURFACE, **options}
    with client_of(create_app(settings)) as client:
        told = client.post("/v1/estimate", body).json()
        refused = {name: issue for issue in told["refused"] for name in issue["formats"]}
        for name in BY_NAME:
            answer = client.post(f"/v1/mesh?format={name}", body)
            assert (answer.status_code == 200) == (name not in refused)
            if name in refused:
                issue = {k: v for k, v in refused[name].items() if k != "formats"}
                assert answer.json()["errors"] == [issue]
    assert told["accepted"] == (len(refused) < len(BY_NAME))
