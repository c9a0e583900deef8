"""POST /v1/curve: polylines in every format, tolerances, limits, and errors."""

import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oracles.gltf import read_glb
from service.api.app import create_app
from service.encoders.polylines.format import CurveFormat, PolylineSize
from service.encoders.polylines.registry import CURVE_FORMATS, CURVES_BY_NAME
from service.encoders.registry import FORMATS
from service.engine.curves.polyline import CurveOptions
from service.errors import TooLarge
from service.pipeline.limits import Limits
from service.pipeline.polylines import plan_curve
from service.settings.values import Settings
from service.surface.curve import BezierCurve, BsplineCurve
from tests.clients.gltf_validator import list_issues
from tools.client import Client, start_client
from tools.programs import find_program

QUARTER = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, math.sqrt(0.5), 1]}
LOOP = {
    "type": "bspline",
    "control_points": [[2, 0, 0], [0, 2, 1], [-2, 0, 0], [0, -2, 1]],
    "knots": "periodic",
    "up": "z",
    "name": "loop",
}


def fetch_curve(fmt: str, client: Client, document: Any) -> bytes:
    """The file of this request in the format of this name."""
    response = client.post(f"/v1/curve?format={fmt}", document)
    assert response.status_code == 200, response.text
    return response.content


def test_json_has_points_tangents_parameters_and_arc_lengths(client: Client) -> None:
    response = client.post("/v1/curve", {"curve": QUARTER, "resolution": 4}).json()
    points = np.array(response["points"])
    assert points.shape == (5, 2)
    assert np.hypot(*points.T) == pytest.approx(1, abs=1e-15)
    assert (np.array(response["tangents"]) * points).sum(axis=1) == pytest.approx(0, abs=1e-15)
    assert response["parameters"] == [0, 0.25, 0.5, 0.75, 1]
    assert response["arc_lengths"][-1] == response["report"]["length"] == pytest.approx(math.pi / 2)
    report = response["report"]
    assert (report["points"], report["pieces"], report["closed"]) == (5, 1, False)
    assert report["bounds"] == {"min": [0, 0], "max": [1, 1]}
    sagitta = 1 - math.cos(math.pi / 16)  # the distance of a chord of 1/4 of the arc
    assert sagitta < report["deviation_bound"] < 1.5 * sagitta


def test_columns_can_be_left_out(client: Client) -> None:
    document = {"curve": QUARTER, "tangents": False, "arc_lengths": False}
    assert set(client.post("/v1/curve", document).json()) == {"points", "parameters", "report"}


def test_the_deviation_bound_is_within_the_tolerance(client: Client) -> None:
    response = client.post("/v1/curve", {"curve": LOOP, "tolerance": 1e-4}).json()
    assert response["report"]["deviation_bound"] <= 1e-4
    assert response["report"]["closed"]
    assert response["points"][0] == response["points"][-1]


@pytest.mark.parametrize("fmt", CURVE_FORMATS, ids=lambda fmt: fmt.name)
def test_formats_by_name_and_by_media_type_are_equal(client: Client, fmt: CurveFormat) -> None:
    document = {"curve": LOOP, "resolution": 3}
    by_name = client.post(f"/v1/curve?format={fmt.name}", document)
    by_media_type = client.post("/v1/curve", document, {"Accept": fmt.media_type})
    assert by_name.status_code == by_media_type.status_code == 200
    assert by_name.content == by_media_type.content
    assert by_name.headers["content-type"].partition(";")[0] == fmt.media_type
    disposition = by_name.headers.get("content-disposition")
    expected = None if fmt.name == "json" else f'attachment; filename="loop.{fmt.suffix}"'
    assert disposition == expected


@pytest.mark.parametrize("curve", [QUARTER, LOOP], ids=["plane", "space"])
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_the_gltf_validator_finds_no_issue(
    client: Client, tmp_path: Path, suffix: str, curve: Any
) -> None:
    content = fetch_curve(suffix, client, {"curve": curve, "resolution": 5})
    assert list_issues(content, tmp_path / f"curve.{suffix}") == []


def test_the_gltf_is_one_strip_with_the_requested_attributes(client: Client) -> None:
    content = fetch_curve("glb", client, {"curve": LOOP, "resolution": 5})
    glb = read_glb(content)
    (node,) = glb.document["nodes"]
    assert node["name"] == "loop"
    assert "rotation" in node
    (primitive,) = glb.document["meshes"][0]["primitives"]
    assert primitive["mode"] == 3  # LINE_STRIP
    assert set(primitive["attributes"]) == {"POSITION", "_TANGENT", "_PARAMETER", "_ARC_LENGTH"}
    points = glb.array(primitive["attributes"]["POSITION"])
    assert len(points) == 4 * 5 + 1  # `LOOP` has 4 spans
    assert np.array_equal(points[0], points[-1])
    assert glb.document["asset"]["extras"]["report"]["closed"] is True


def test_a_curve_far_from_zero_has_the_right_position(client: Client) -> None:
    """Positions are relative to a local origin; the node adds it, and rotates z up to y up."""
    points = [[1e6, 2e6, 3e6], [1e6 + 1, 2e6, 3e6], [1e6 + 1, 2e6 + 1, 3e6 + 2]]
    glb = read_glb(fetch_curve("glb", client, {"curve": {"control_points": points, "up": "z"}}))
    (node,) = glb.document["nodes"]
    x, y, z = glb.array(0)[0].astype(float)
    position = np.array([x, z, -y]) + node["translation"]
    assert position == pytest.approx([1e6, 3e6, -2e6], abs=1e-3)


@pytest.mark.parametrize("curve", [QUARTER, LOOP], ids=["plane", "space"])
def test_geomview_reads_the_oogl_file(client: Client, tmp_path: Path, curve: Any) -> None:
    content = fetch_curve("oogl", client, {"curve": curve, "resolution": 5})
    words = content.split()
    is_closed = curve is LOOP
    count = 4 * 5 if is_closed else 5 + 1  # the first point of a closed curve is not repeated
    # After the word VECT: polylines, vertices, colours; vertices of the polyline, negative if it is
    # closed; its colours. Then the vertices follow, and one colour of 4 numbers.
    assert [int(word) for word in words[1:6]] == [1, count, 1, -count if is_closed else count, 1]
    assert len(words) == 6 + 3 * count + 4
    path = tmp_path / "curve.vect"
    path.write_bytes(content)
    process = subprocess.run(
        [find_program("anytooff"), str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert process.stderr == ""


def test_the_obj_has_one_line_element(client: Client) -> None:
    lines = fetch_curve("obj", client, {"curve": LOOP, "resolution": 2}).decode().splitlines()
    assert lines[0] == "o loop"
    assert sum(line.startswith("v ") for line in lines) == 8
    assert lines[-1] == "l 1 2 3 4 5 6 7 8 1"
    lines_of_plane_curve = (
        fetch_curve("obj", client, {"curve": QUARTER, "resolution": 2}).decode().splitlines()
    )
    assert lines_of_plane_curve[1] == "v 1.0 0.0 0.0"
    assert lines_of_plane_curve[-1] == "l 1 2 3"


@pytest.mark.parametrize("fmt", ["stl", "ply", "off"])
def test_the_refusal_of_another_format_lists_those_of_curves(client: Client, fmt: str) -> None:
    response = client.post(f"/v1/curve?format={fmt}", {"curve": QUARTER})
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["parameter"]) == ("unsupported_by_format", "format")
    assert error["needed"] == "one of glb, gltf, json, oogl, obj"
    media_type = next(each.media_type for each in FORMATS if each.name == fmt)
    response = client.post("/v1/curve", {"curve": QUARTER}, {"Accept": media_type})
    assert response.status_code == 406


@pytest.mark.parametrize(
    "options", [{"resolution": 65536}, {"tolerance": 1e-7}], ids=["resolution", "tolerance"]
)
def test_too_many_points_are_refused(options: dict[str, Any]) -> None:
    with start_client(create_app(Settings(max_vertices=1000))) as client:
        response = client.post("/v1/curve", {"curve": QUARTER, **options})
    assert response.status_code == 422
    assert response.json()["code"] == "result_too_large"
    assert response.json()["errors"][0]["pointer"] == "/" + next(iter(options))


def test_the_limit_of_points_falls_with_the_degree() -> None:
    """Arc lengths of `max_vertices` points would take too long, and longer for higher degrees."""
    # A thousandth of the default limits, because the resolution has a limit of its own.
    small_limits = Limits(max_vertices=4_500, max_multiplications=5_000_000)
    max_points = []
    for degree in (2, 8, 64):
        curve = BezierCurve(np.eye(degree + 1)[:, :3])
        with pytest.raises(TooLarge) as refused:
            plan_curve(curve, CurveOptions(10_000), CURVE_FORMATS[0], small_limits)
        max_points.append(int(refused.value.issues[0].needed.removeprefix("at most ")))
    assert max_points == sorted(max_points, reverse=True)
    assert max_points[0] < small_limits.max_vertices
    assert max_points[-1] > 5, "the limit of the highest degree must still be useful"


@pytest.mark.parametrize("fmt", CURVE_FORMATS, ids=lambda fmt: fmt.name)
def test_no_file_is_longer_than_its_bound(fmt: CurveFormat) -> None:
    points = np.array([[1 / 3, 1e-300, -2e30], [-1e-5, 7 / 9, 3.3e38], [1 / 7, 1, 2]])
    for resolution in (1, 300):
        curve = BezierCurve(points, name='"' * 100)  # a quote has two bytes in JSON
        work = plan_curve(curve, CurveOptions(resolution=resolution), fmt)
        size = PolylineSize(resolution + 1, len(curve.name.encode()))
        assert len(work.run()) <= fmt.byte_bound(size)


def test_points_at_parameters_have_derivatives_and_bends(client: Client) -> None:
    document = {"curve": LOOP, "parameters": [4, 0.5, 0.5, 1], "derivatives": 3}
    response = client.post("/v1/curve", document).json()
    assert response["parameters"] == [4, 0.5, 0.5, 1]
    assert response["points"][1] == response["points"][2]
    assert len(response["dt"][0]) == 3
    assert len(response["torsion"]) == len(response["curvature"]) == 4
    report = response["report"]
    assert (report["points"], report["pieces"], report["closed"]) == (4, 4, True)
    assert "deviation_bound" not in report
    # Lengths are those up to each point, whatever their order.
    full = client.post("/v1/curve", {"curve": LOOP, "resolution": 2}).json()
    lengths = full["arc_lengths"]
    expected = [lengths[8], lengths[1], lengths[1], lengths[2]]
    assert response["arc_lengths"] == pytest.approx(expected, rel=1e-12)
    assert report["length"] == pytest.approx(full["report"]["length"], rel=1e-12)
    assert response["tangents"][3] == full["tangents"][2]


def test_derivatives_may_be_at_the_points_of_a_resolution(client: Client) -> None:
    plain = client.post("/v1/curve", {"curve": QUARTER, "resolution": 4}).json()
    response = client.post(
        "/v1/curve", {"curve": QUARTER, "resolution": 4, "derivatives": 2}
    ).json()
    assert response["curvature"] == pytest.approx([1] * 5, rel=1e-14)
    assert {name: response[name] for name in plain} == plain
    assert response.keys() - plain.keys() == {"dt", "degenerate", "dtt", "curvature"}


def test_infinite_numbers_are_null(client: Client) -> None:
    cusp = {"control_points": [[0, 0], [0, 0], [1, 0], [1, 1]]}
    document = {"curve": cusp, "parameters": [0], "derivatives": 2}
    response = client.post("/v1/curve", document).json()
    assert (response["degenerate"], response["curvature"]) == ([True], [None])


@pytest.mark.parametrize(
    ("options", "pointer"),
    [({"parameters": [0.5]}, "/parameters"), ({"derivatives": 1}, "/derivatives")],
)
@pytest.mark.parametrize("fmt", ["glb", "gltf", "oogl", "obj"])
def test_only_json_has_columns(
    client: Client, fmt: str, options: dict[str, Any], pointer: str
) -> None:
    response = client.post(f"/v1/curve?format={fmt}", {"curve": QUARTER, **options})
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["pointer"]) == ("unsupported_by_format", pointer)
    assert error["needed"] == "json"


def test_the_end_of_the_domain_may_be_missed_by_roundings(client: Client) -> None:
    document = {"curve": QUARTER, "parameters": [1 + 2**-50, -(2**-50)], "arc_lengths": False}
    response = client.post("/v1/curve", document).json()
    assert response["points"] == [[0, 1], [1, 0]]
    document["parameters"] = [0, 1 + 1e-13]
    (error,) = client.post("/v1/curve", document).json()["errors"]
    assert (error["code"], error["pointer"]) == ("outside_domain", "/parameters/1")
    assert error["needed"] == "0 to 1"


def test_columns_are_not_longer_than_their_bound() -> None:
    rng = np.random.default_rng(3)
    points = -rng.random((300, 3)) * 1e-7
    curve = BsplineCurve(points, knots=np.cumsum(rng.random(304)))
    fmt = CURVES_BY_NAME["json"]
    low, high = curve.lower().breaks[[0, -1]]
    for order in range(4):
        options = CurveOptions(parameters=rng.uniform(low, high, 500), order=order)
        size = PolylineSize(500, len(curve.name), order=order)
        assert len(plan_curve(curve, options, fmt).run()) <= fmt.byte_bound(size)
