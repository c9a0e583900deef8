"""POST /v1/intersect with planes: formats, groups, and refused requests."""

from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.api.models.queries import Sections
from service.encoders.polylines.registry import SECTION_FORMATS
from service.pipeline.polylines import MAX_PLANES
from service.settings.values import Settings
from tests.breps import build_box
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
SQUARE = {"control_net": NET}
PLANES = {"normals": [[2, 0, 0]], "offsets": [0.25, 0.5, 3]}
"""The planes x = 0.25, x = 0.5 and x = 3: offsets are distances along the unit normal."""


def intersect(client: Client, **fields: Any) -> Any:
    """The valid response to a request with these fields."""
    response = client.post("/v1/intersect", fields)
    assert response.status_code == 200, response.text
    Sections.model_validate_json(response.content)
    return response.json()


def test_sections_of_a_square_are_lines(client: Client) -> None:
    result = intersect(client, surface=SQUARE, planes=PLANES)
    assert [len(section["polylines"]) for section in result["sections"]] == [1, 1, 0]
    (line,) = result["sections"][0]["polylines"]
    assert line == {"closed": False, "points": [[0.25, 1, 0], [0.25, 0, 0]]}
    assert result["sections"][1]["normal"] == [1, 0, 0]
    points = {"normals": [[2, 0, 0]], "points": [[0.25, 7, 0], [0.5, 0, 8], [3, 0, 0]]}
    assert intersect(client, surface=SQUARE, planes=points) == result


def test_sections_list_the_patches_in_their_plane(client: Client) -> None:
    raise_by_1 = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]
    members = [{"surface": SQUARE}, {"surface": SQUARE, "matrix": raise_by_1}]
    group = {"type": "group", "members": members}
    planes = {"normals": [[0, 0, 1]], "offsets": [0, 1, 2]}
    result = intersect(client, surface=group, planes=planes)["sections"]
    assert [section["coplanar"] for section in result] == [[0], [1], []]
    assert [len(section["polylines"]) for section in result] == [1, 1, 0]
    assert result[1]["polylines"][0]["closed"]


@pytest.mark.parametrize("fmt", SECTION_FORMATS, ids=lambda fmt: fmt.name)
def test_formats_by_name_and_by_media_type_are_equal(client: Client, fmt: Any) -> None:
    body = {"surface": {"control_net": NET, "name": "<script>"}, "planes": PLANES}
    by_name = client.post(f"/v1/intersect?format={fmt.name}", body)
    by_media_type = client.post("/v1/intersect", body, headers={"Accept": fmt.media_type})
    assert by_name.status_code == 200
    assert by_name.content == by_media_type.content
    assert by_name.headers["content-type"].split(";")[0] == fmt.media_type
    if fmt.name == "svg":
        assert b"script" not in by_name.content


def test_hits_of_rays_are_json_only(client: Client) -> None:
    body = {"surface": SQUARE, "rays": {"origins": [[0, 0, 1]], "directions": [[0, 0, -1]]}}
    response = client.post("/v1/intersect?format=svg", body)
    assert response.json()["errors"][0]["code"] == "unsupported_by_format"
    response = client.post("/v1/intersect", body, headers={"Accept": "image/svg+xml"})
    assert response.status_code == 406
    accept_both = {"Accept": "image/svg+xml, application/json;q=0.1"}
    assert client.post("/v1/intersect", body, headers=accept_both).json()["counts"] == [1]


def test_sections_are_within_the_tolerance(client: Client) -> None:
    arc = {"control_net": [[[1, 0, 0], [1, 0, 2]], [[1, 1, 0], [1, 1, 2]], [[0, 1, 0], [0, 1, 2]]],
           "weights": [[1, 1], [0.5**0.5] * 2, [1, 1]]}  # fmt: skip
    for tolerance in (1e-2, 1e-6):
        result = intersect(
            client,
            surface=arc,
            planes={"normals": [[0, 0.6, 0.8]], "points": [[0, 0, 1]]},
            tolerance=tolerance,
        )
        assert result["report"]["deviation_bound"] <= tolerance
        (line,) = result["sections"][0]["polylines"]
        points = np.array(line["points"])
        assert np.hypot(*points[:, :2].T) == pytest.approx(1, abs=1e-11)
        middles = (points[1:] + points[:-1]) / 2
        assert np.abs(np.hypot(*middles[:, :2].T) - 1).max() <= tolerance


PLANES_AND_RAYS = {"planes": PLANES, "rays": {"origins": [[0, 0, 1]], "directions": [[0, 0, 1]]}}


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({}, "missing_field", "/rays"),  # or planes; the error names the first of the two
        (PLANES_AND_RAYS, "conflicting_options", "/planes"),
        ({"planes": PLANES, "hits": "all"}, "conflicting_options", "/hits"),
        ({"rays": PLANES_AND_RAYS["rays"], "tolerance": 1}, "conflicting_options", "/tolerance"),
        ({"planes": PLANES, "tolerance": 1, "relative_tolerance": 0.1},
         "conflicting_options", "/relative_tolerance"),
        ({"planes": PLANES, "tolerance": 1e-12}, "tolerance_too_small", "/tolerance"),
    ],
)  # fmt: skip
def test_invalid_requests_are_refused(client: Client, fields: Any, code: str, pointer: str) -> None:
    response = client.post("/v1/intersect", {"surface": SQUARE, **fields})
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["pointer"]) == (code, pointer)


def test_too_many_planes_too_many_points_and_tubes_are_refused() -> None:
    """The sections by 500 planes have more than 2,000 points."""
    bumps = {"surface": {"type": "bspline", "degree": 2, "control_net": _build_bumps()}}
    with start_client(create_app(Settings(max_vertices=2000))) as client:
        many_planes = client.post(
            "/v1/intersect", {**bumps, "planes": _build_horizontal_planes(MAX_PLANES + 1)}
        )
        many_points = client.post(
            "/v1/intersect", {**bumps, "planes": _build_horizontal_planes(500)}
        )
        tube = client.get("/v1/surfaces/trefoil-tube").json()["surface"]
        sections_of_tube = client.post("/v1/intersect", {"surface": tube, "planes": PLANES})
    errors = [each.json()["errors"][0] for each in (many_planes, many_points, sections_of_tube)]
    assert [error["code"] for error in errors] == [
        "too_many_planes", "too_many_vertices", "not_parametric",
    ]  # fmt: skip
    assert [error["pointer"] for error in errors] == ["/planes", "/planes", "/surface"]


def _build_horizontal_planes(count: int) -> Any:
    """Horizontal planes at `count` heights."""
    return {"normals": [[0, 0, 1]], "offsets": np.linspace(-1, 1, count).tolist()}


def _build_bumps() -> Any:
    """A control net of 9 × 9 points with hills and valleys."""
    x, y = np.meshgrid(range(9), range(9), indexing="ij")
    return np.stack([x, y, np.sin(2 * x) * np.cos(2 * y)], axis=-1).tolist()


def test_sections_of_breps_are_closed_in_every_format(client: Client) -> None:
    fields: dict[str, Any] = {
        "surface": build_box((2, 3, 4)) | {"up": "z", "name": "block"},
        "planes": {"normals": [[0, 0, 1], [1, 0, 0]], "offsets": [1, 2]},
    }
    result = intersect(client, **fields)
    (line,), (border,) = (section["polylines"] for section in result["sections"])
    assert line["closed"]
    assert border["closed"]
    assert sorted({tuple(point) for point in line["points"]}) == [
        (0, 0, 1), (0, 3, 1), (2, 0, 1), (2, 3, 1),
    ]  # fmt: skip
    assert len(result["sections"][1]["coplanar"]) == 1
    for fmt in SECTION_FORMATS:
        response = client.post(f"/v1/intersect?format={fmt.name}", fields)
        assert response.status_code == 200


def test_members_of_a_group_count_their_faces_and_patches(client: Client) -> None:
    group = {
        "type": "group",
        "up": "z",
        "members": [{"surface": SQUARE | {"up": "z"}}, {"surface": build_box() | {"up": "z"}}],
    }
    plane = {"normals": [[0, 0, 1]], "offsets": [0]}
    (section,) = intersect(client, surface=group, planes=plane)["sections"]
    assert section["coplanar"][0] == 0
    assert len(section["coplanar"]) == 2
