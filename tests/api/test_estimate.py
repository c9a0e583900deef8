"""POST /v1/estimate: counts, bytes, and formats that refuse the mesh."""

from service.encoders.registry import BY_NAME
from tools.client import Client

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}


def test_estimates_have_the_counts_and_bytes_of_the_mesh(client: Client) -> None:
    body = client.get("/v1/surfaces/utah-teapot").json() | {"resolution": [3, 5]}
    estimate = client.post("/v1/estimate", body).json()
    report = client.post("/v1/mesh", body).json()["report"]
    assert estimate["exact"] is True
    assert {name: estimate[name] for name in ("vertices", "triangles", "quads")} == {
        name: report[name] for name in ("vertices", "triangles", "quads")
    }
    assert list(estimate["bytes"]) == list(BY_NAME)
    for name, size in estimate["bytes"].items():
        length = len(client.post(f"/v1/mesh?format={name}", body).content)
        assert length == size if name in estimate["exact_bytes"] else length <= size


def test_an_estimate_may_be_for_one_format(client: Client) -> None:
    body = {"surface": SURFACE, "faces": "quads"}
    estimate = client.post("/v1/estimate?format=stl", body).json()
    assert (estimate["accepted"], estimate["bytes"]) == (False, {})
    assert [entry["formats"] for entry in estimate["refused"]] == [["stl"]]
    assert client.post("/v1/estimate?format=ply", body).json()["accepted"] is True
    response = client.post("/v1/estimate?format=fbx", body)
    assert response.status_code == 422
    assert response.json()["errors"][0]["code"] == "unknown_format"
