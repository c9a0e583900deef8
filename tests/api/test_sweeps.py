"""Meshes of tubes over HTTP: their options, and tubes that cost too much."""

import pytest

from tools.client import Client

CURVE = {"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]}
TUBE = {"type": "tube", "curve": CURVE, "radius": [0.2, 0.1], "sides": 6, "name": "wire"}


def test_options_of_a_mesh_apply_to_tubes(client: Client) -> None:
    document = {
        "surface": TUBE,
        "resolution": [4, 3],
        "faces": "quads",
        "uvs": True,
        "overlays": ["control_net", "boundary"],
    }
    response = client.post("/v1/mesh", document).json()
    report = response["report"]
    # 4 divisions of the curve × 6 sides of the tube (whatever the second resolution), and 2 caps of
    # 6 triangles.
    assert (report["quads"], report["triangles"], report["watertight"]) == (24, 12, True)
    assert [part["name"] for part in response["parts"]] == ["wire"]
    # A tube with caps has no boundary.
    (line,) = response["lines"]
    assert (line["name"], len(line["segments"])) == ("control_net", 3)
    uvs = [value for row in response["uvs"] for value in row]
    assert (min(uvs), max(uvs)) == (0, 1)


@pytest.mark.slow
def test_tubes_that_would_take_minutes_are_refused(client: Client) -> None:
    points = [[k % 7, k % 5, k % 3] for k in range(400)]
    curve = {"type": "bspline", "control_points": points, "degree": 64}
    tube = {"type": "tube", "curve": curve, "radius": 0.1, "sides": 3}
    group = {"type": "group", "members": [{"surface": tube}] * 2 + [{"surface": TUBE}]}
    for surface in (tube, group):
        response = client.post("/v1/mesh", {"surface": surface, "resolution": 400})
        assert response.status_code == 422
        (error,) = response.json()["errors"]
        assert (error["code"], error["pointer"]) == ("too_costly", "/resolution")
