"""Loops that cross, touch or run the wrong way refuse a brep, or leave out its face."""

from copy import deepcopy
from typing import Any

import pytest

from service.engine.brep.preparation.prepare import prepare
from service.errors import InvalidRequest, Issue
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface
from service.surface.brep_model import BrepModel
from tests.breps import PLATE


def _lower(document: dict[str, Any]) -> BrepModel:
    surface = validate_document(SurfaceRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    return surface.lower()


def _add_plate(document: dict[str, Any], holes: list[list[tuple[float, float]]]) -> None:
    """A second plate, 5 above the first, with holes that are polygons."""
    vertices, edges = document["vertices"], document["edges"]
    loops: list[dict[str, Any]] = []
    border = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]
    for points in [border, *holes]:
        first, count = len(vertices), len(points)
        vertices += [[x, y, 5] for x, y in points]
        loops.append({"edges": [len(edges) + k for k in range(count)]})
        edges += [{"vertices": [first + k, first + (k + 1) % count]} for k in range(count)]
    net = [[[0, 0, 5], [0, 10, 5]], [[10, 0, 5], [10, 10, 5]]]
    document["faces"].append({"surface": {"control_net": net}, "loops": loops})
    document["shells"][0]["faces"].append(len(document["faces"]) - 1)
    document["vertex_uncertainties"] = [1e-6] * len(vertices)


def _list_issues(holes: list[list[tuple[float, float]]]) -> list[Issue]:
    """The issues of a brep with such a plate; with `skip` they are those of this face alone."""
    document = deepcopy(PLATE)
    _add_plate(document, holes)
    with pytest.raises(InvalidRequest) as caught:
        prepare(_lower(document))
    prepared = prepare(_lower(document | {"invalid_faces": "skip"}))
    (skipped,) = prepared.skipped_faces
    assert skipped.face == 1
    assert skipped.issue == caught.value.issues[0]
    assert set(prepared.loop_faces.tolist()) == {0}
    return list(caught.value.issues)


CROSSING = [
    ("/faces/1/loops/0", "loops_cross", "a loop that crosses loop 1 near (5.25, 0, 5)"),
    ("/faces/1/loops/1", "loops_cross", "a loop that crosses loop 0 near (4.75, 0, 5)"),
]
TWISTED = [("/faces/1/loops/1", "loops_cross", "a loop that crosses itself near (3, 3, 5)")]
BACKWARD = [
    ("/faces/1/loops/1", "loop_reversed", "a loop with the material on its right near (4, 2, 5)")
]


@pytest.mark.parametrize(
    ("holes", "expected"),
    [
        ([[(5, -1), (4, 3), (6, 3)]], CROSSING),
        ([[(2, 2), (4, 4), (4, 2), (2, 4)]], TWISTED),
        ([[(2, 2), (4, 2), (3, 4)]], BACKWARD),
    ],
)
def test_invalid_loops_are_refused_or_left_out(
    holes: list[list[tuple[float, float]]], expected: list[tuple[str, str, str]]
) -> None:
    issues = _list_issues(holes)
    assert [(issue.pointer, issue.code, issue.got) for issue in issues] == expected


def test_holes_that_touch_at_a_corner_are_valid() -> None:
    document = deepcopy(PLATE)
    _add_plate(document, [[(5, 0), (4, 3), (6, 3)]])
    assert not prepare(_lower(document)).skipped_faces
