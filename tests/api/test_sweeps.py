"""Tubes and ribbons over HTTP: every format, and what is refused."""

from pathlib import Path
from typing import Any

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tests.api.client import Client, client_of
from tests.clients.gltf_validator import issues

CURVE = {"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]}
TUBE = {"type": "tube", "curve": CURVE, "radius": [0.2, 0.1], "sides": 6, "name": "wire"}
RIBBON = {"type": "ribbon", "curve": CURVE, "width": 0.2, "camera": [0, 0, 10], "up": "z"}


def test_all_options_apply(client: Client) -> None:
    document = {
        "surface": TUBE,
        "resolution": [4, 3],
        "faces": "quads",
        "uvs": True,
        "overlays": ["control_net", "boundary"],
    }
    answer = client.post("/v1/mesh", document).json()
    report = answer["report"]
    assert (report["quads"], report["triangles"], report["watertight"]) == (24, 12, True)
    assert [part["name"] for part in answer["parts"]] == ["wire"]
    (line,) = answer["lines"]
    assert (line["name"], len(line["segments"])) == ("control_net", 3)
    uvs = [value for row in answer["uvs"] for value in row]
    assert (min(uvs), max(uvs)) == (0, 1)


@pytest.mark.parametrize("surface", [TUBE, RIBBON], ids=["tube", "ribbon"])
def test_what_has_no_parameters_says_so(client: Client, surface: Any) -> None:
    asked = [
        client.post("/v1/points", {"surface": surface, "uv": [[0, 0]]}),
        client.post("/v1/convert", {"surface": surface, "operations": [{"op": "transpose"}]}),
        client.post("/v1/mesh?format=oogl", {"surface": surface, "oogl": "bez"}),
    ]
    for answer in asked:
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert (error["code"], error["pointer"]) == ("not_parametric", "/surface")


def test_tubes_are_members_of_groups(client: Client, tmp_path: Path) -> None:
    members = [{"surface": TUBE, "name": "a"}, {"surface": TUBE, "name": "b"}, {"surface": RIBBON}]
    document = {"surface": {"type": "group", "members": members}, "resolution": 3}
    for fmt in ("glb", "json", "oogl", "stl"):
        answer = client.post(f"/v1/mesh?format={fmt}", document)
        assert answer.status_code == 200, answer.text
        if fmt == "glb":
            assert issues(answer.content, tmp_path / "group.glb") == []
    exact = client.post("/v1/mesh?format=oogl", {**document, "oogl": "bez"})
    assert exact.json()["errors"][0]["code"] == "not_parametric"


def test_a_mesh_that_would_be_too_large_is_not_begun(client: Client) -> None:
    document = {"surface": {**TUBE, "sides": 1000}, "resolution": 60_000}
    answer = client.post("/v1/mesh", document)
    assert answer.json()["code"] == "result_too_large"


def test_the_curves_of_a_group_count_together() -> None:
    members = [{"surface": TUBE}, {"surface": RIBBON}, {"surface": TUBE}]
    document = {"surface": {"type": "group", "members": members}}
    with client_of(create_app(Settings(max_control_points=11))) as client:
        answer = client.post("/v1/mesh", document)
    (error,) = answer.json()["errors"]
    assert (error["code"], error["got"]) == ("too_many_control_points", "12 control points")


def test_what_would_take_minutes_is_refused(client: Client) -> None:
    points = [[k % 7, k % 5, k % 3] for k in range(400)]
    curve = {"type": "bspline", "control_points": points, "degree": 64}
    tube = {"type": "tube", "curve": curve, "radius": 0.1, "sides": 3}
    group = {"type": "group", "members": [{"surface": tube}] * 2 + [{"surface": TUBE}]}
    for surface in (tube, group):
        answer = client.post("/v1/mesh", {"surface": surface, "resolution": 400})
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert (error["code"], error["pointer"]) == ("too_costly", "/resolution")
