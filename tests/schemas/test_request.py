"""Whole requests to surfaces and options; options as text."""

from dataclasses import fields, is_dataclass
from typing import Any, get_args

import numpy as np
import orjson
import pytest

from service.encoders import format as formats
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.schemas import options
from service.schemas.accuracy import ACCURACY
from service.schemas.document import DocumentLimits
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface
from service.surface.examples import EXAMPLES
from service.surface.patches import PatchSurface

LIMITS = DocumentLimits()
NET: list[list[list[float]]] = [[[0, 0, 0], [0, 1, 1.5]], [[1, 0, 1], [1, 1, 2]]]
GRIDS: dict[str, Any] = {
    "type": "patches",
    "vertices": NET[0] + NET[1],
    "patches": [[[0, 1], [2, 3]]],
}


def test_a_net_alone_is_a_bezier_surface_with_all_defaults() -> None:
    request = validate_document(MeshRequest, {"surface": {"control_net": NET}}, LIMITS)
    surface = request.to_surface()
    assert isinstance(surface, BezierSurface)
    assert surface.control_net.tolist() == NET
    assert (surface.weights, surface.up, surface.name) == (None, "y", "surface")
    assert request.mesh_options() == MeshOptions()
    assert request.oogl is None


def test_every_option_can_be_written_and_is_read() -> None:
    names = MeshOptionFields.model_fields.keys()
    engine = {field.name for field in fields(MeshOptions) if field.init}
    read = engine | {field.name for field in fields(formats.EncodeOptions)} | ACCURACY
    assert names <= read, f"service/engine/options.py lacks {names - read}"
    unsaid = engine - names - {"accuracy", "has_faces"}
    assert not unsaid, f"service/schemas/options.py lacks {unsaid}"


def test_every_field_of_a_bezier_surface_arrives() -> None:
    fields = {"control_net": NET, "weights": [[1, 2], [3, 4]], "up": "z", "name": "Segel ⛵"}
    surface = validate_document(
        MeshRequest, {"surface": {"type": "bezier", **fields}}, LIMITS
    ).to_surface()
    assert isinstance(surface, BezierSurface)
    assert surface.weights is not None
    assert surface.weights.tolist() == fields["weights"]
    assert (surface.up, surface.name) == ("z", "Segel ⛵")


def test_every_field_of_patches_arrives() -> None:
    fields = {"weights": [1, 2, 3, 4], "parts": {"a": [0]}, "up": "z", "name": "n"}
    surface = validate_document(MeshRequest, {"surface": {**GRIDS, **fields}}, LIMITS).to_surface()
    assert isinstance(surface, PatchSurface)
    assert surface.vertices.tolist() == GRIDS["vertices"]
    assert np.array_equal(surface.patches, GRIDS["patches"])
    assert surface.weights is not None
    assert surface.weights.tolist() == [1, 2, 3, 4]
    assert (surface.parts, surface.up, surface.name) == ((("a", (0,)),), "z", "n")


@pytest.mark.parametrize("example", EXAMPLES.values(), ids=lambda example: example.id)
def test_definition_and_request_are_inverse(example: Any) -> None:
    surface = example.surface()
    text = orjson.dumps({"surface": definition(surface)}, option=orjson.OPT_SERIALIZE_NUMPY)
    again = validate_document(MeshRequest, orjson.loads(text), LIMITS).to_surface()
    assert type(again) is type(surface)
    assert is_equal(again, surface)


def is_equal(one: Any, other: Any) -> bool:
    """Whether two values are equal, arrays inside them number by number."""
    if is_dataclass(one):
        names = [f.name for f in fields(one) if f.init]
        return all(is_equal(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(is_equal, one, other))
    return bool(np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other)


def test_options_have_the_defaults_of_the_engine() -> None:
    assert MeshOptionFields().mesh_options() == MeshOptions()
    assert get_args(options.OoglForm) == get_args(formats.OoglForm)


def test_values_of_a_surface_are_located_in_the_request() -> None:
    request = validate_document(
        MeshRequest, {"surface": {"control_net": NET, "weights": [[1, 1], [1, 0]]}}, LIMITS
    )
    with pytest.raises(InvalidRequest) as refusal:
        request.to_surface()
    assert refusal.value.issues[0].pointer == "/surface/weights/1/1"


def test_a_field_called_surface_is_not_a_nested_surface() -> None:
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, {"surface": {"control_net": NET, "surface": 1}}, LIMITS)
    assert refusal.value.issues[0].pointer == "/surface/surface"


def test_a_bad_member_is_the_only_fault_of_a_group() -> None:
    """A list with only invalid items does not get the error of a short list too."""
    group = {"type": "group", "members": [{"surface": {"control_net": [[[0, 0, "0"]]]}}]}
    with pytest.raises(InvalidRequest) as caught:
        validate_document(MeshRequest, {"surface": group}, LIMITS)
    assert {issue.pointer[:19] for issue in caught.value.issues} == {"/surface/members/0/"}
    with pytest.raises(InvalidRequest) as caught:
        validate_document(MeshRequest, {"surface": group | {"members": []}}, LIMITS)
    assert [issue.code for issue in caught.value.issues] == ["wrong_length"]


def test_requests_do_not_change() -> None:
    request = validate_document(MeshRequest, {"surface": {"control_net": NET}}, LIMITS)
    with pytest.raises(ValueError, match="frozen"):
        request.faces = "quads"


def test_a_limit_of_a_number_has_no_decimal_point_of_its_own() -> None:
    document = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}}
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, document | {"tolerance": 0, "crease_angle": -1})
    assert sorted(issue.needed or "" for issue in refusal.value.issues) == ["above 0", "at least 0"]
