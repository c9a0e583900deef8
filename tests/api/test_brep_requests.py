"""Each call answers to breps: with a result, or with a refusal that says what to send."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest

from service.encoders.registry import FORMATS
from tests.breps import PLATE, build_box
from tools.client import Client

PATCH = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
GROUP = {"type": "group", "members": [{"surface": PATCH}, {"surface": PLATE}]}


def skip_all() -> Iterator[dict[str, Any]]:
    """Breps of which all faces are left out: on creation, and when the geometry is checked."""
    plate = deepcopy(PLATE) | {"invalid_faces": "skip"}
    plate["faces"][0]["loops"][0]["edges"] = [0, 1, 2]
    yield plate
    plate = {key: value for key, value in plate.items() if key != "vertex_uncertainties"}
    yield plate | {"vertices": []}
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
    corners = [[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]]  # clockwise
    loop = {"pcurves": [{"control_points": corners[k : k + 2]} for k in range(4)]}
    face = {"surface": {"control_net": net}, "loops": [loop]}
    yield {"type": "brep", "faces": [face], "invalid_faces": "skip"}


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "elevate", "degree": 3},
        {"op": "split", "u": 0.5},
        {"op": "restrict", "u": [0, 0.5]},
        {"op": "transpose"},
        {"op": "reverse", "direction": "u"},
        {"op": "bezier"},
        {"op": "triangle", "half": "lower"},
    ],
)
def test_conversions_of_nets_refuse_breps_and_name_untrim(
    client: Client, operation: dict[str, Any]
) -> None:
    body = {"surface": PLATE, "operations": [operation]}
    error = client.post("/v1/convert", body).json()["errors"][0]
    assert (error["code"], error["pointer"]) == ("not_parametric", "/operations/0")
    assert "`untrim`" in error["needed"]


def test_faces_that_are_taken_out_are_surfaces_for_every_call(client: Client) -> None:
    body = {"surface": GROUP, "operations": [{"op": "untrim", "face": 0, "member": 1}]}
    surface = client.post("/v1/convert", body).json()["surface"]
    assert surface == {
        "type": "bezier",
        "control_net": PLATE["faces"][0]["surface"]["control_net"],
        "up": "z",
        "name": "top",
    }
    area = client.post("/v1/measure", {"surface": surface}).json()["area"]["value"]
    assert area == pytest.approx(100)
    body = {"surface": build_box(), "operations": [{"op": "select", "faces": [2, 4]}]}
    brep = client.post("/v1/convert", body).json()["surface"]
    report = client.post("/v1/mesh", {"surface": brep}).json()["report"]
    assert (report["triangles"], report["boundary_edges"], report["watertight"]) == (4, 6, False)


def test_a_stored_brep_is_returned_as_it_was_sent(client: Client) -> None:
    stored = client.post("/v1/surfaces", {"surface": PLATE}).json()
    content = client.get(stored["links"]["self"]).json()["surface"]
    again = client.post("/v1/surfaces", {"surface": content}).json()
    assert again["id"] == stored["id"]
    report = client.get(stored["links"]["mesh"]["json"]).json()["report"]
    assert (report["complete"], report["triangles"] > 8) == (True, True)


@pytest.mark.parametrize("number", range(3))
def test_breps_of_which_all_faces_are_left_out_have_an_empty_mesh(
    client: Client, number: int
) -> None:
    surface = [*skip_all()][number]
    for fmt in FORMATS:
        response = client.post(f"/v1/mesh?format={fmt.name}", {"surface": surface})
        assert response.status_code == (422 if fmt.name == "oogl" else 200), fmt.name
    report = client.post("/v1/mesh", {"surface": surface}).json()["report"]
    assert (report["triangles"], report["complete"]) == (0, False)
    assert [face["face"] for face in report["skipped_faces"]] == [0]
    group = {"type": "group", "members": [{"surface": surface}, {"surface": PLATE}]}
    assert client.post("/v1/mesh?format=glb", {"surface": group}).status_code == 200


def test_the_report_lists_faces_that_are_left_out(client: Client) -> None:
    document = build_box() | {"invalid_faces": "skip"}
    document["faces"][3]["reversed"] = True
    report = client.post("/v1/mesh", {"surface": document}).json()["report"]
    assert (report["complete"], report["watertight"], report["boundary_edges"]) == (False, False, 4)
    (skipped,) = report["skipped_faces"]
    assert (skipped["face"], skipped["code"]) == (3, "used_twice_same_direction")
    assert skipped["got"]
    assert skipped["needed"]


def test_a_loop_that_is_there_twice_touches_itself_everywhere(client: Client) -> None:
    """However short the sides of its polygon are, all are in conflict: halving them must end."""
    document = deepcopy(PLATE)
    document["faces"][0]["loops"].append(deepcopy(document["faces"][0]["loops"][1]))
    document["edges"].append(deepcopy(document["edges"][4]))
    document["faces"][0]["loops"][2]["edges"] = [5]
    error = client.post("/v1/mesh", {"surface": document}).json()["errors"][0]
    assert error["code"] in ("loops_touch", "loops_cross")
    assert error["pointer"] == "/surface/faces/0/loops/1"


SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
SIDES = [{"control_points": SQUARE[k : k + 2]} for k in range(4)]
BACK = {"control_points": [[0, 1], [1, 1]]}


@pytest.mark.parametrize(
    ("loop", "jump"),
    [
        ({"pcurves": SIDES}, None),
        ({"pcurves": [*SIDES[:2], BACK, SIDES[3]], "reversed": [False, False, True, False]}, None),
        ({"pcurves": SIDES[:3]}, "a jump of 1 behind parameter curve 2"),
        ({"pcurves": [*SIDES[:2], BACK, SIDES[3]]}, "a jump of 1.41421 behind parameter curve 1"),
        ({"pcurves": SIDES[:1]}, "a jump of 1 behind parameter curve 0"),
    ],
)
def test_parameter_curves_alone_follow_each_other(
    client: Client, loop: dict[str, Any], jump: str | None
) -> None:
    surface = {"type": "brep", "faces": [{"surface": PATCH, "loops": [loop]}]}
    response = client.post("/v1/mesh", {"surface": surface}).json()
    if jump is None:
        assert response["report"]["boundary_edges"] >= 4
        return
    (error,) = response["errors"]
    assert (error["code"], error["pointer"]) == ("loop_open", "/surface/faces/0/loops/0")
    assert error["got"] == jump


def test_the_parameter_curves_of_a_pole_need_not_join_in_parameters(client: Client) -> None:
    """The side v = 1 is one point: a loop that leaves it out jumps there, but not in space."""
    net = [[[0, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0, 1]]]
    sides = [SIDES[0], SIDES[1], SIDES[3]]
    surface = {
        "type": "brep",
        "faces": [{"surface": {"control_net": net}, "loops": [{"pcurves": sides}]}],
    }
    report = client.post("/v1/mesh", {"surface": surface}).json()["report"]
    assert (report["complete"], report["triangles"], report["boundary_edges"]) == (True, 1, 3)


def test_a_parameter_curve_goes_around_a_thousand_times_at_most(client: Client) -> None:
    """It is cut at each turn: a curve of a million turns would take minutes."""
    ring = [[1, 0], [1, 2], [-1, 2], [-1, -2], [1, -2], [1, 0]]
    net = [[[x, y, z] for z in (0, 1)] for x, y in ring]
    sides = [[[0, 0], [9, 0]], [[9, 0], [9, 1]], [[9, 1], [0, 1]], [[0, 1], [0, 0]]]
    for turns, code in ((1, None), (1e6, "pcurve_outside")):
        curves = [{"control_points": [[u * turns / 9, v] for u, v in side]} for side in sides]
        face = {"surface": {"control_net": net}, "loops": [{"pcurves": curves}]}
        response = client.post("/v1/mesh", {"surface": {"type": "brep", "faces": [face]}}).json()
        assert response.get("errors", [{"code": None}])[0]["code"] == code
