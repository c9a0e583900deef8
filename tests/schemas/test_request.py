"""Documents of requests become surfaces and options; surfaces are written as documents."""

from dataclasses import fields, is_dataclass
from typing import Any, get_args

import numpy as np
import orjson
import pytest

from service.encoders import format as formats
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.schemas import options
from service.schemas.accuracy import ACCURACY_FIELDS
from service.schemas.document import DocumentLimits
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import EXAMPLES
from service.surface.patches import PatchSurface

LIMITS = DocumentLimits()
NET: list[list[list[float]]] = [[[0, 0, 0], [0, 1, 1.5]], [[1, 0, 1], [1, 1, 2]]]
PATCHES: dict[str, Any] = {
    "type": "patches",
    "vertices": NET[0] + NET[1],
    "patches": [[[0, 1], [2, 3]]],
}


def test_a_document_with_only_a_net_is_a_bezier_surface_with_default_options() -> None:
    request = validate_document(MeshRequest, {"surface": {"control_net": NET}}, LIMITS)
    surface = request.to_surface()
    assert isinstance(surface, BezierSurface)
    assert surface.control_net.tolist() == NET
    assert (surface.weights, surface.up, surface.name) == (None, "y", "surface")
    assert request.mesh_options() == MeshOptions()
    assert request.oogl is None


def test_requests_have_the_options_of_the_engine_and_of_the_formats() -> None:
    """In a request, each field of the accuracy is an option, and `has_faces` is a value of `faces`.

    Other options have the same name in the request and in the engine, or in `EncodeOptions`.
    """
    names = MeshOptionFields.model_fields.keys()
    mesh_options = {field.name for field in fields(MeshOptions) if field.init}
    attributes = (
        mesh_options | {field.name for field in fields(formats.EncodeOptions)} | {*ACCURACY_FIELDS}
    )
    assert names <= attributes, f"service/engine/options.py lacks {names - attributes}"
    missing = mesh_options - names - {"accuracy", "has_faces", "has_resolution", "places"}
    assert not missing, f"service/schemas/options.py lacks {missing}"


def test_every_field_of_a_bezier_surface_is_read() -> None:
    fields = {"control_net": NET, "weights": [[1, 2], [3, 4]], "up": "z", "name": "Segel ⛵"}
    surface = validate_document(
        MeshRequest, {"surface": {"type": "bezier", **fields}}, LIMITS
    ).to_surface()
    assert isinstance(surface, BezierSurface)
    assert surface.weights is not None
    assert surface.weights.tolist() == fields["weights"]
    assert (surface.up, surface.name) == ("z", "Segel ⛵")


def test_every_field_of_patches_is_read() -> None:
    fields = {"weights": [1, 2, 3, 4], "parts": {"a": [0]}, "up": "z", "name": "n"}
    surface = validate_document(
        MeshRequest, {"surface": {**PATCHES, **fields}}, LIMITS
    ).to_surface()
    assert isinstance(surface, PatchSurface)
    assert surface.vertices.tolist() == PATCHES["vertices"]
    assert np.array_equal(surface.patches, PATCHES["patches"])
    assert surface.weights is not None
    assert surface.weights.tolist() == [1, 2, 3, 4]
    assert (surface.parts, surface.up, surface.name) == ((("a", (0,)),), "z", "n")


@pytest.mark.parametrize("example", EXAMPLES.values(), ids=lambda example: example.id)
def test_reading_the_definition_of_an_example_gives_an_equal_surface(example: Any) -> None:
    surface = example.surface()
    text = orjson.dumps({"surface": definition(surface)}, option=orjson.OPT_SERIALIZE_NUMPY)
    result = validate_document(MeshRequest, orjson.loads(text), LIMITS).to_surface()
    assert type(result) is type(surface)
    assert is_equal(result, surface)


def is_equal(first: Any, second: Any) -> bool:
    """Whether two values are equal; arrays inside them must have equal numbers."""
    if is_dataclass(first):
        names = [f.name for f in fields(first) if f.init]
        return all(is_equal(getattr(first, name), getattr(second, name)) for name in names)
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(is_equal, first, second))
    return bool(np.array_equal(first, second) if isinstance(first, np.ndarray) else first == second)


def test_options_have_the_defaults_of_the_engine() -> None:
    assert MeshOptionFields().mesh_options() == MeshOptions()
    assert get_args(options.OoglForm) == get_args(formats.OoglForm)


def test_issues_of_values_have_their_pointer_in_the_request() -> None:
    request = validate_document(
        MeshRequest, {"surface": {"control_net": NET, "weights": [[1, 1], [1, -1]]}}, LIMITS
    )
    with pytest.raises(InvalidRequest) as refusal:
        request.to_surface()
    assert refusal.value.issues[0].pointer == "/surface/weights/1/1"


def test_an_unknown_field_called_surface_has_its_own_pointer() -> None:
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, {"surface": {"control_net": NET, "surface": 1}}, LIMITS)
    assert refusal.value.issues[0].pointer == "/surface/surface"


def test_a_group_with_an_invalid_member_has_only_the_issues_of_that_member() -> None:
    """The list of members is not also called too short because its only member is invalid."""
    group = {"type": "group", "members": [{"surface": {"control_net": [[[0, 0, "0"]]]}}]}
    with pytest.raises(InvalidRequest) as caught:
        validate_document(MeshRequest, {"surface": group}, LIMITS)
    assert all(issue.pointer.startswith("/surface/members/0/") for issue in caught.value.issues)
    with pytest.raises(InvalidRequest) as caught:
        validate_document(MeshRequest, {"surface": group | {"members": []}}, LIMITS)
    assert [issue.code for issue in caught.value.issues] == ["wrong_length"]


def test_requests_are_frozen() -> None:
    request = validate_document(MeshRequest, {"surface": {"control_net": NET}}, LIMITS)
    with pytest.raises(ValueError, match="frozen"):
        request.faces = "quads"


def test_issues_write_whole_limits_without_a_decimal_point() -> None:
    document = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}}
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, document | {"tolerance": 0, "crease_angle": -1})
    assert sorted(issue.needed or "" for issue in refusal.value.issues) == ["above 0", "at least 0"]
