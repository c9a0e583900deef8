"""Tolerances, budgets and cameras in documents, in queries and on the command line."""

from dataclasses import fields
from math import pi
from typing import Any

import pytest

from service.cli import mesh as command
from service.engine.accuracy import Accuracy, Camera
from service.errors import InvalidRequest
from service.schemas import accuracy
from service.schemas.accuracy import MAX_COUNT, MAX_PIXELS
from service.schemas.query import options_from_text
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.checks import MAX_COORDINATE

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}
CAMERA = {"position": [1, 2, 3], "field_of_view": 0.8, "height": 1080}
CAMERA_OPTIONS = {"camera": CAMERA, "pixel_tolerance": 0.5}


def read_accuracy(**options: Any) -> Accuracy | None:
    """The accuracy that the engine gets for a body with these options."""
    return validate_document(MeshRequest, {"surface": SURFACE, **options}).mesh_options().accuracy


def list_issues(**options: Any) -> list[tuple[str, str]]:
    """Codes and pointers of the issues of a body."""
    with pytest.raises(InvalidRequest) as refusal:
        read_accuracy(**options)
    for issue in refusal.value.issues:
        assert issue.got
        assert issue.needed
    return [(issue.code, issue.pointer) for issue in refusal.value.issues]


def test_every_field_of_an_accuracy_is_an_option_of_the_same_name() -> None:
    names = {field.name for field in fields(Accuracy)}
    assert names <= set(MeshRequest.model_fields)
    assert names == set(accuracy.ACCURACY_FIELDS) == {*command.ACCURACY, *command.CAMERA_FIELDS}
    assert accuracy.CAMERA_FIELDS == command.CAMERA_FIELDS


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, None),
        ({"resolution": 16}, None),
        ({"two_sided": False}, None),
        ({"resolution": [2, 3], "two_sided": False}, None),
        ({"tolerance": 1e-3}, Accuracy(tolerance=1e-3)),
        ({"tolerance": 1}, Accuracy(tolerance=1.0)),
        ({"tolerance": MAX_COORDINATE}, Accuracy(tolerance=MAX_COORDINATE)),
        ({"tolerance": 5e-324}, Accuracy(tolerance=5e-324)),
        ({"relative_tolerance": 1}, Accuracy(relative_tolerance=1.0)),
        ({"angle_tolerance": pi}, Accuracy(angle_tolerance=pi)),
        ({"max_triangles": 2}, Accuracy(max_triangles=2)),
        ({"max_bytes": MAX_COUNT}, Accuracy(max_bytes=MAX_COUNT)),
        (
            {"tolerance": 0.1, "angle_tolerance": 0.2, "max_triangles": 9, "two_sided": True},
            Accuracy(tolerance=0.1, angle_tolerance=0.2, max_triangles=9, two_sided=True),
        ),
        ({"max_bytes": 99, "two_sided": True}, Accuracy(max_bytes=99, two_sided=True)),
        (CAMERA_OPTIONS, Accuracy(camera=Camera((1.0, 2.0, 3.0), 0.8, 1080), pixel_tolerance=0.5)),
        (
            {**CAMERA_OPTIONS, "relative_tolerance": 0.5},
            Accuracy(
                relative_tolerance=0.5,
                camera=Camera((1.0, 2.0, 3.0), 0.8, 1080),
                pixel_tolerance=0.5,
            ),
        ),
    ],
)
def test_options_of_a_body_are_read_as_an_accuracy(
    options: dict[str, Any], expected: Accuracy | None
) -> None:
    assert read_accuracy(**options) == expected


@pytest.mark.parametrize(
    ("options", "code", "pointer"),
    [
        ({"max_triangles": MAX_COUNT + 1}, "out_of_range", "/max_triangles"),
        ({"two_sided": True}, "missing_field", "/tolerance"),
        ({"tolerance": 1, "relative_tolerance": 0.1}, "conflicting_options", "/relative_tolerance"),
        ({"camera": CAMERA}, "missing_field", "/pixel_tolerance"),
        ({"pixel_tolerance": 1}, "missing_field", "/camera"),
        ({**CAMERA_OPTIONS, "pixel_tolerance": MAX_PIXELS + 1}, "out_of_range", "/pixel_tolerance"),
    ],
)
def test_conflicting_and_too_large_options_are_refused(
    options: dict[str, Any], code: str, pointer: str
) -> None:
    assert list_issues(**options)[0] == (code, pointer)


@pytest.mark.parametrize("name", accuracy.ACCURACY_FIELDS)
def test_null_is_refused_and_so_is_a_resolution_beside_an_accuracy(name: str) -> None:
    assert list_issues(**{name: None})[0] == ("null_value", f"/{name}")
    values: dict[str, Any] = {"two_sided": True, "relative_tolerance": 0.5, **CAMERA_OPTIONS}
    option = {name: values.get(name, 1)}
    assert list_issues(resolution=16, **option) == [("conflicting_options", "/resolution")]


@pytest.mark.parametrize("name", accuracy.CAMERA_FIELDS)
def test_a_camera_in_a_query_is_refused_and_the_issue_names_post(name: str) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        options_from_text([(name, "1"), ("tolerance", "0.1")])
    (issue,) = refusal.value.issues
    assert (issue.code, issue.pointer) == ("unknown_field", f"/{name}")
    assert "POST" in issue.needed


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        ({}, {"surface", "resolution", "tolerance", "camera", "uvs"}),
        ({"uvs": "true"}, {"surface", "resolution", "tolerance", "camera", "uvs"}),
        ({"resolution": "3"}, {"surface", "resolution", "uvs"}),
        ({"relative_tolerance": "0.1"}, {"surface", "camera", "uvs"}),
        ({"max_bytes": "9"}, {"surface", "tolerance", "camera", "uvs"}),
    ],
)
def test_options_of_the_file_that_conflict_with_flags_are_dropped(
    flags: dict[str, str], expected: set[str]
) -> None:
    # Only the names of the options matter.
    document = {"surface": 1, "resolution": 2, "tolerance": 0.1, "camera": {}, "uvs": True}
    assert set(command.drop_replaced(document, flags)) == expected
