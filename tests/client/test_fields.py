"""The client knows every field of the interface, by the OpenAPI document, and every file."""

import inspect
from typing import Any, get_args, get_type_hints

import pytest

from service.api.app import create_app
from service.api.openapi.document import build_full_settings
from service.client import answers, fields
from service.client.call import Call
from service.client.clients import Calls
from service.client.given_mesh import MEDIA_TYPES as MESH_TYPES
from service.client.records import Answer
from service.client.surfaces import FILE_FIELDS, MEDIA_TYPES
from service.decoders.mesh_registry import MESH_BY_NAME
from service.decoders.registry import DECODERS
from service.schemas import file_fields

DOCUMENT: dict[str, Any] = create_app(build_full_settings()).openapi()
SCHEMAS = DOCUMENT["components"]["schemas"]

ANSWERS: dict[type[Answer], tuple[str, ...]] = {
    answers.Points: ("Points",),
    answers.ClosestPoints: ("ClosestPoints",),
    answers.Intersections: ("RayHits", "Sections"),
    answers.Curve: ("Curve",),
    answers.Measures: ("SurfaceMeasures",),
    answers.Interval: ("Interval",),
    answers.MeshCheck: ("MeshCheck",),
    answers.Deviation: ("Deviation",),
    answers.CheckedMesh: ("CheckedMesh",),
    answers.Estimate: ("Estimate",),
    answers.MeshReport: ("MeshReport",),
    answers.Converted: ("SurfaceDocument",),
    answers.Stored: ("StoredSurface",),
    answers.Signed: ("SignedAddress",),
}

REQUESTS = {
    fields.MeshFields: "MeshRequest",
    fields.ImageFields: "PictureRequest",
    fields.PointsFields: "PointsRequest",
    fields.CurveFields: "CurveRequest",
    fields.ProjectFields: "ProjectRequest",
    fields.IntersectFields: "IntersectRequest",
    fields.MeasureFields: "MeasureRequest",
    fields.CheckFields: "CheckRequest",
    fields.ConvertFields: "ConvertRequest",
    fields.SignFields: "SignRequest",
}

IGNORED = {"surface", "mesh", "url", "reading", "orientation"}
"""The first arguments of calls, and fields of answers that calls ignore."""


def test_every_answer_is_compared() -> None:
    own = {value for value in vars(answers).values() if inspect.isclass(value)}
    assert {cls for cls in own if cls.__module__ == answers.__name__} == set(ANSWERS)


@pytest.mark.parametrize("cls", ANSWERS, ids=lambda cls: cls.__name__)
def test_answers_have_the_fields_of_the_interface(cls: type[Answer]) -> None:
    schemas = [SCHEMAS[name] for name in ANSWERS[cls]]
    hints = get_type_hints(cls)
    assert set(hints) == {name for schema in schemas for name in schema["properties"]}
    optional = {name for name, hint in hints.items() if type(None) in get_args(hint)}
    required = set.intersection(*(set(schema["required"]) for schema in schemas))
    if cls is answers.Stored:
        required -= {"links"}  # `Local` has none
    assert set(hints) - optional == required


@pytest.mark.parametrize("typed", REQUESTS, ids=lambda typed: typed.__name__)
def test_calls_have_the_fields_of_the_interface(typed: Any) -> None:
    expected = set(SCHEMAS[REQUESTS[typed]]["properties"]) - IGNORED
    known = set(get_type_hints(typed))
    if issubclass(typed, dict) and known >= FILE_FIELDS:
        known -= FILE_FIELDS
    assert known | {"curve"} == expected | {"curve"}, "service/client/fields.py"


def test_the_calls_of_the_table_exist() -> None:
    paths = {call.path for call in vars(Calls).values() if isinstance(call, Call)}
    assert len(paths) == 12
    assert paths <= {path for path, item in DOCUMENT["paths"].items() if "post" in item}


def test_files_are_those_of_the_service() -> None:
    assert dict(MEDIA_TYPES) == {
        suffix: decoder.media_type for decoder in DECODERS for suffix in decoder.suffixes
    }
    assert set(file_fields.FIELDS) == FILE_FIELDS == set(get_type_hints(fields.FileFields))
    assert dict(MESH_TYPES) == {name: each.media_type for name, each in MESH_BY_NAME.items()}
