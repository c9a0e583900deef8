"""Questions to breps and to groups with breps: closest points, rays, sections and measures."""

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from tests.api.test_brep_requests import skip_all
from tests.breps import PLATE, build_box
from tools.client import Client

NET = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
SHIFT = [[1, 0, 0, 20], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
BOX = build_box((2, 3, 4))
GROUP: dict[str, Any] = {
    "type": "group",
    "up": "z",
    "members": [
        {"surface": NET | {"up": "z"}, "matrix": [[1, 0, 0, 50], *SHIFT[1:]]},
        {"surface": BOX | {"up": "z"}},
        {"surface": BOX | {"up": "z"}, "matrix": SHIFT},
    ],
}
"""A patch far away, number 0, and two copies of a box: the faces 1 to 6 and 7 to 12."""


def ask(client: Client, path: str, surface: Any, **fields: Any) -> Any:
    response = client.post(f"/v1/{path}", {"surface": surface, **fields})
    assert response.status_code == 200, response.text
    return response.json()


def refuse(client: Client, path: str, surface: Any, **fields: Any) -> tuple[str, str]:
    response = client.post(f"/v1/{path}", {"surface": surface, **fields})
    assert response.status_code == 422, response.text
    error = response.json()["errors"][0]
    return error["code"], error["pointer"]


def list_skipped(answer: Any) -> Any:
    """The faces that an answer lists as left out; None if it has no such list."""
    return answer.get("report", answer).get("skipped_faces")


def spoil(document: dict[str, Any], face: int) -> dict[str, Any]:
    """The brep with a face that is left out, because its loop runs the wrong way."""
    spoiled = deepcopy(document) | {"invalid_faces": "skip"}
    spoiled["faces"][face]["reversed"] = True
    return spoiled


def test_closest_points_of_a_plate_with_a_hole(client: Client) -> None:
    """Above the face; beside it; above the middle of the hole."""
    points = [[1, 2, 3], [12, 5, 0], [5, 5, 1], [9, 9, 0]]
    result = ask(client, "project", PLATE, points=points)
    distances = [3, 2, np.hypot(2, 1), 0]
    np.testing.assert_allclose(result["distances"], distances, atol=1e-6)
    for (low, high), distance in zip(result["distance_bounds"], distances, strict=True):
        assert low - 1e-12 <= distance <= high + 1e-12
    assert result["near_edge"] == [False, True, True, False]
    assert result["on_boundary"] == [False, True, True, False]
    assert result["patch"] == [0] * 4
    np.testing.assert_allclose(result["uv"][0], [0.1, 0.2], atol=1e-9)
    np.testing.assert_allclose(result["normals"], [[0, 0, 1]] * 4, atol=1e-12)
    assert result["tied"] == [False, False, True, False]


def test_the_answer_of_a_projection_to_a_group_names_the_same_point(client: Client) -> None:
    points = [[1, 1, 1], [21, 1, 1], [10, 1, 1], [1, 1, -1], [50.5, 0.25, 3]]
    result = ask(client, "project", GROUP, points=points)
    np.testing.assert_allclose(result["distances"], [1, 1, 8, 1, 3], atol=1e-9)
    places = [
        ask(client, "points", GROUP, uv=[uv], patch=patch, derivatives=1)
        for uv, patch in zip(result["uv"], result["patch"], strict=True)
    ]
    positions = [place["positions"][0] for place in places]
    np.testing.assert_allclose(positions, result["positions"], atol=1e-9)
    assert [place["inside"] for place in places] == [[True]] * 5
    assert result["patch"][4] == 0


def test_points_are_inside_or_outside_of_closed_solids(client: Client) -> None:
    points = [[1, 1, 1], [21, 1, 1], [10, 1, 1], [1, 1, -1], [2, 1, 1]]
    group = GROUP | {"members": GROUP["members"][1:]}
    assert ask(client, "project", group, points=points, sign=True)["signs"] == [-1, -1, 1, 1, None]
    assert ask(client, "project", BOX, points=points, sign=True)["signs"] == [-1, 1, 1, 1, None]
    open_box = spoil(BOX, 3)
    assert ask(client, "project", open_box, points=points, sign=True)["signs"] == [None] * 5
    signs = [-1, -1, None, None, None]  # beside an open patch no point is outside
    assert ask(client, "project", GROUP, points=points, sign=True)["signs"] == signs


def test_rays_hit_trimmed_faces_alone(client: Client) -> None:
    rays = {"origins": [[1, 1, 5], [5, 5, 5], [7, 5, 5], [11, 5, 5]], "directions": [[0, 0, -1]]}
    result = ask(client, "intersect", PLATE, rays=rays, hits="all")
    assert result["counts"] == [1, 0, 1, 0]
    assert result["near_edge"] == [False, True]
    assert result["kind"][0] == "crossing"
    assert result["entering"][0] is True
    np.testing.assert_allclose(result["positions"], [[1, 1, 0], [7, 5, 0]], atol=1e-6)


def test_sections_of_closed_solids_are_loops(client: Client) -> None:
    planes = {"normals": [[0, 0, 1]], "offsets": [1, 3.5, 9]}
    sections = ask(client, "intersect", BOX, planes=planes)["sections"]
    assert [len(section["polylines"]) for section in sections] == [1, 1, 0]
    for section in sections[:2]:
        (line,) = section["polylines"]
        assert line["closed"]
        points = np.array(line["points"])
        x, y, _ = points.T
        area = (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2  # counter-clockwise: positive
        assert area == pytest.approx(6)
    (through_plate,) = ask(
        client, "intersect", PLATE, planes={"normals": [[1, 0, 0]], "offsets": [5]}
    )["sections"]
    ends = sorted(
        sorted(point[1] for point in line["points"]) for line in through_plate["polylines"]
    )
    np.testing.assert_allclose(ends, [[0, 3], [7, 10]], atol=1e-6)


def test_a_ray_through_an_edge_of_a_box_has_one_hit_there(client: Client) -> None:
    ends = {"origins": [[-5, 1, 2], [-1, -1, 2]], "directions": [[1, 0, 0], [1, 1, 0]]}
    result = ask(client, "intersect", BOX, rays=ends, hits="all")
    assert result["counts"] == [2, 2]
    assert result["entering"][:2] == [True, False]
    np.testing.assert_allclose(result["t"], [5, 7, 1, 3], atol=1e-6)
    assert result["near_edge"] == [False, False, True, False]
    normals = np.array(result["normals"])[:2]
    np.testing.assert_allclose(normals, [[-1, 0, 0], [1, 0, 0]], atol=1e-12)


QUESTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "project": ("project", {"points": [[1, 1, 9]]}),
    "rays": ("intersect", {"rays": {"origins": [[1, 1, 9]], "directions": [[0, 0, -1]]}}),
    "planes": ("intersect", {"planes": {"points": [[1, 1, 1]], "normals": [[0, 0, 1]]}}),
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_faces_that_take_no_part_are_listed(client: Client, name: str) -> None:
    """Once for each brep, with the number in its first copy."""
    path, fields = QUESTIONS[name]
    spoiled = spoil(BOX, 3) | {"up": "z"}
    assert list_skipped(ask(client, path, BOX, **fields)) is None
    (skipped,) = list_skipped(ask(client, path, spoiled, **fields))
    assert skipped.keys() == {"patch", "code", "got", "needed"}
    assert (skipped["patch"], skipped["code"]) == (3, "used_twice_same_direction")
    group = deepcopy(GROUP)
    group["members"][1]["surface"] = group["members"][2]["surface"] = spoiled
    (skipped,) = list_skipped(ask(client, path, group, **fields))
    assert skipped["patch"] == 4


@pytest.mark.parametrize("name", QUESTIONS)
def test_surfaces_without_any_valid_face_are_refused(client: Client, name: str) -> None:
    path, fields = QUESTIONS[name]
    for surface in skip_all():
        assert refuse(client, path, surface, **fields) == ("no_faces", "/surface")
        group: dict[str, Any] = {"type": "group", "members": [{"surface": surface}]}
        assert refuse(client, path, group, **fields) == ("no_faces", "/surface")
        group["members"].append({"surface": NET})
        assert list_skipped(ask(client, path, group, **fields))


@pytest.mark.parametrize("name", QUESTIONS)
def test_straight_tubes_beside_parts_are_asked_with_them_and_others_are_refused(
    client: Client, name: str
) -> None:
    path, fields = QUESTIONS[name]
    points = [[0, 0, 0], [1, 0, 0], [2, 1, 0]]
    line, curve = ({"type": "tube", "curve": {"control_points": points[:k]}, "radius": 1}
                   for k in (2, 3))  # fmt: skip
    group, wrong = (
        {"type": "group", "members": [{"surface": BOX}, {"surface": each}]}
        for each in (line, curve)
    )
    assert ask(client, path, group, **fields)
    where = "/surface/members/1/surface"
    assert refuse(client, path, wrong, **fields) == ("not_parametric", where)


@pytest.mark.parametrize("name", QUESTIONS)
def test_the_same_question_has_the_same_bytes(client: Client, name: str) -> None:
    path, fields = QUESTIONS[name]
    contents = {client.post(f"/v1/{path}", {"surface": GROUP, **fields}).content for _ in range(3)}
    assert len(contents) == 1
