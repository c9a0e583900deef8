"""Tubes about lines and arcs as patches: questions to them have the answers of closed forms."""

import json
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest

from oracles.distance import Soup
from oracles.sweeps import sample_tube
from service.encoders.polylines.registry import SECTIONS_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.measures.values import MeasureQuery
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.measure import plan_measure
from service.pipeline.mesh import plan_mesh
from service.pipeline.polylines import plan_sections
from service.pipeline.queries import plan_intersect, plan_project
from service.schemas.intersect import IntersectRequest
from service.schemas.queries import ProjectRequest
from service.schemas.validation import validate_document

HALF = sqrt(0.5)
LINE: dict[str, Any] = {"control_points": [[0, 0, 0], [0, 0, 2]]}
QUARTER = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, HALF, 1]}
CIRCLE = {
    "type": "bspline", "degree": 2, "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
    "control_points": [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1],
                       [1, 0]],
    "weights": [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
}  # fmt: skip
BEND = {"type": "bspline", "degree": 1, "control_points": [[0, 0, 0], [2, 0, 0], [3, 1, 0]]}
LOOP = {
    "type": "bspline", "degree": 1, "knots": "periodic",
    "control_points": [[2, 0, 0], [1, 2, 0.3], [-1, 2, 0.9], [-2, 0, 0.1], [-1, -2, 0],
                       [1, -2, 0.2]],
}  # fmt: skip
WAVE = {"control_points": [[0, 0, 0], [1, 1, 0], [2, 0, 1]]}


def tube(curve: Any, radius: Any = 0.25, **fields: Any) -> dict[str, Any]:
    return {"type": "tube", "curve": curve, "radius": radius, **fields}


def parse(surface: dict[str, Any]) -> Any:
    """The surface as a value."""
    return validate_document(ProjectRequest, {"surface": surface, "points": [[0, 0, 0]]}).to_shape()


def measure(surface: dict[str, Any]) -> dict[str, Any]:
    result: dict[str, Any] = json.loads(plan_measure(parse(surface), MeasureQuery()).run())
    return result


def is_inside(interval: dict[str, float], value: float) -> bool:
    """Whether a value is in an interval, which is narrow."""
    is_narrow = interval["high"] - interval["low"] <= 1e-5 * max(1, abs(value))
    return is_narrow and interval["low"] <= value <= interval["high"]


@pytest.mark.parametrize(
    ("surface", "area", "volume"),
    [
        (tube(LINE), 2 * pi * 0.25 * 2 + 2 * pi * 0.25**2, pi * 0.25**2 * 2),
        (tube(LINE, [0.25, 0]), pi * 0.25 * sqrt(4 + 0.25**2) + pi * 0.25**2, pi * 0.25**2 * 2 / 3),
        (tube(CIRCLE), 4 * pi**2 * 0.25, 2 * pi**2 * 0.25**2),
        (tube(QUARTER), pi**2 * 0.25 + 2 * pi * 0.25**2, pi**2 / 2 * 0.25**2),
        (
            tube(BEND),
            2 * pi * 0.25 * (2 + sqrt(2)) + 2 * pi * 0.25**2,
            pi * 0.25**2 * (2 + sqrt(2)),
        ),
    ],
    ids=["cylinder", "cone", "torus", "quarter of a torus", "mitre"],
)
def test_areas_and_volumes_are_those_of_closed_forms(
    surface: dict[str, Any], area: float, volume: float
) -> None:
    result = measure(surface)
    assert result["closed"]
    assert is_inside(result["area"], area)
    assert is_inside(result["volume"], volume)


def test_without_caps_a_tube_has_two_circles_as_borders() -> None:
    result = measure(tube(LINE, caps=False))
    assert not result["closed"]
    assert result["boundary_count"] == 2
    assert is_inside(result["boundary_length"], 4 * pi * 0.25)


@pytest.mark.parametrize("curve", [LINE, CIRCLE], ids=["cylinder", "torus"])
def test_closest_points_have_the_distance_of_the_closed_form(curve: dict[str, Any]) -> None:
    points = np.random.default_rng(7).uniform(-2, 3, (20, 3))
    request = {"surface": tube(curve), "points": points.tolist(), "sign": True}
    query = validate_document(ProjectRequest, request)
    result = json.loads(plan_project(query.to_shape(), query.to_query()).run())
    if curve is LINE:
        radial, height = np.hypot(*points.T[:2]) - 0.25, np.abs(points[:, 2] - 1) - 1
        outside = np.hypot(np.maximum(radial, 0), np.maximum(height, 0))
        expected = np.where((radial < 0) & (height < 0), np.minimum(-radial, -height), outside)
        is_within = (radial < 0) & (height < 0)
    else:
        signed = np.hypot(np.hypot(*points.T[:2]) - 1, points[:, 2]) - 0.25
        expected, is_within = np.abs(signed), signed < 0
    np.testing.assert_allclose(result["distances"], expected, atol=1e-9)
    assert (np.array(result["signs"]) == np.where(is_within, -1, 1)).all()


def test_rays_hit_tubes_and_their_caps() -> None:
    rays = {"origins": [[0.1, 0.05, -3], [-3, 0, 0.5]], "directions": [[0, 0, 1], [1, 0, 0]]}
    body = {"surface": tube(LINE), "rays": rays, "hits": "all"}
    query = validate_document(IntersectRequest, body)
    result = json.loads(plan_intersect(query.to_surface(), query.to_query()).run())
    np.testing.assert_allclose(result["t"], [3, 5, 2.75, 3.25], atol=1e-9)


def test_the_section_of_a_torus_is_two_circles() -> None:
    body = {"surface": tube(CIRCLE), "planes": {"normals": [[0, 1, 0]], "offsets": [0]}}
    query = validate_document(IntersectRequest, body)
    work = plan_sections(query.to_surface(), query.to_sections(), SECTIONS_BY_NAME["json"])
    (section,) = json.loads(work.run())["sections"]
    assert len(section["polylines"]) == 2
    for line in section["polylines"]:
        x, _, z = np.array(line["points"]).T
        np.testing.assert_allclose(np.hypot(np.abs(x) - 1, z), 0.25, atol=1e-3)


@pytest.mark.parametrize(
    "curve", [LINE, CIRCLE, QUARTER, BEND], ids=["line", "circle", "arc", "bend"]
)
def test_patches_are_the_round_tube(curve: dict[str, Any]) -> None:
    surface = parse(tube(curve))
    options = MeshOptions(accuracy=Accuracy(tolerance=1e-3))
    document = json.loads(
        bytes(plan_mesh(surface.exact_patches(), options, BY_NAME["json"]).run().content)
    )
    corners = np.array(document["vertices"])[np.array(document["faces"])]
    assert document["report"]["watertight"]
    assert Soup(corners).farthest(sample_tube(surface, 40, 48))[1] <= 1e-3


@pytest.mark.parametrize(
    ("surface", "reason"),
    [
        (tube(WAVE), "neither straight nor a circular arc"),
        (tube({"type": "bspline", "degree": 1,
               "control_points": [[0, 0, 0], [2, 0, 0], [0, 1, 0]]}), "sharper than 90°"),
        (tube(QUARTER, 1.5), "not below the radius of an arc"),
        (tube(QUARTER, [0.2, 0.1]), "radius changes"),
        (tube(LINE, [0.2, 0.1, 0.3]), "radius changes"),
        (tube(LOOP, 0.05), "turns the rings"),
        ({"type": "ribbon", "curve": WAVE, "width": 1}, "Ribbons"),
    ],
)  # fmt: skip
def test_other_sweeps_are_refused_with_the_reason(surface: dict[str, Any], reason: str) -> None:
    for body, where in (
        (surface, "/surface"),
        ({"type": "group", "members": [{"surface": tube(LINE)}, {"surface": surface}]},
         "/surface/members/1/surface"),
    ):  # fmt: skip
        with pytest.raises(InvalidRequest) as caught:
            measure(body)
        issue = caught.value.issues[0]
        assert (issue.code, issue.pointer) == ("not_parametric", where)
        assert reason in issue.message
        assert "patches" in issue.needed


def test_a_group_with_a_tube_is_measured() -> None:
    sheet = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
    moved = [[2, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]
    members = [{"surface": sheet}, {"surface": tube(CIRCLE), "matrix": moved}]
    result = measure({"type": "group", "members": members})
    assert is_inside(result["area"], 1 + 4 * 4 * pi**2 * 0.25)
