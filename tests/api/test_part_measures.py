"""Measures of breps by HTTP: as JSON, in groups, and as CAD files."""

from math import pi

import pytest

from tests.breps import PLATE, build_box
from tools.client import Client


def test_a_brep_has_measures_and_a_group_those_of_its_members(client: Client) -> None:
    result = client.post("/v1/measure", {"surface": build_box()}).json()
    assert (result["closed"], result["reached"], "skipped_faces" in result) == (True, True, False)
    assert result["volume"]["value"] == pytest.approx(24)
    assert sum(length["value"] for length in result["edge_lengths"]) == pytest.approx(36)
    members = [{"surface": build_box(), "name": "box"}, {"surface": PLATE, "name": "plate"}]
    result = client.post("/v1/measure", {"surface": {"type": "group", "members": members}}).json()
    assert "volume" not in result
    assert [part["name"] for part in result["parts"]] == ["box", "plate"]
    assert result["parts"][0]["volume"]["value"] == pytest.approx(24)
    assert result["area"]["value"] == pytest.approx(152 - 4 * pi)
    first, second = result["boundaries"]
    assert (first["first_edge"], second["edges"]) == ({"patch": 6, "edge": 12}, 1)


def test_a_cad_file_is_measured(client: Client) -> None:
    file = client.post("/v1/convert?format=step", {"surface": build_box()})
    response = client.request(
        "POST", "/v1/measure", content=file.content, headers={"Content-Type": "model/step"}
    )
    assert response.status_code == 200
    assert "faces=6" in response.headers["Surface-Reading"]
    result = response.json()
    assert result["volume"]["low"] <= 24 <= result["volume"]["high"]


def test_a_brep_of_which_all_faces_are_left_out_has_no_area(client: Client) -> None:
    plate = PLATE | {"invalid_faces": "skip", "vertices": []}
    plate.pop("vertex_uncertainties")
    result = client.post("/v1/measure", {"surface": plate}).json()
    assert (result["area"]["value"], result["closed"]) == (0, False)
    assert [face["patch"] for face in result["skipped_faces"]] == [0]
