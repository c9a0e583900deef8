"""Colours, texture coordinates and attributes in documents are read, refused and written."""

from typing import Any

import numpy as np
import orjson
import pytest

from service.errors import InvalidRequest
from service.schemas.document import DocumentLimits
from service.schemas.request import MeshRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.kinds import Surface
from tools.examples import lower_patches

NET = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}
PATCHES = {
    "type": "patches",
    "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1]],
    "patches": [[[0, 1], [2, 3]]],
}
SPLINE = {"type": "bspline", "control_net": [[[i, j, i * j] for j in range(4)] for i in range(5)]}
LIMITS = DocumentLimits(max_control_points=100)

CHANNELS: list[tuple[dict[str, Any], dict[str, Any]]] = [
    (NET, {"colors": [[[1, 0, 0.5]]], "uvs": [[[0, 0], [0, 1], [0, 3]]]}),
    (NET, {"attributes": {"t": [[[1], [2]], [[3], [4]]], "flow": [[[1, 2, 3, 4, 5]]]}}),
    (PATCHES, {"colors": [[1, 0, 0, 1]] * 4, "uvs": [[0, 0], [0, 1], [1, 0], [1, 1]]}),
    (PATCHES, {"attributes": {"t": [[1], [2], [3], [4]]}}),
    (SPLINE, {"colors": [[[1, 0, j / 4] for j in range(4)] for i in range(5)]}),
    (SPLINE, {"uvs": [[[0, 0], [0, 1]]], "attributes": {"t": [[[1], [2], [3]]]}}),
]


def parse_surface(document: dict[str, Any]) -> Surface:
    """The surface of a request with this document as its surface."""
    return validate_document(MeshRequest, {"surface": document}, LIMITS).to_surface()


@pytest.mark.parametrize(("surface", "channels"), CHANNELS)
def test_channels_are_written_as_they_were_read(
    surface: dict[str, Any], channels: dict[str, Any]
) -> None:
    result = parse_surface(surface | channels)
    document = orjson.loads(orjson.dumps(definition(result), option=orjson.OPT_SERIALIZE_NUMPY))
    assert {key: document[key] for key in channels} == channels
    assert lower_patches(parse_surface(document)).batches[0].channels[0].nets.tolist() == (
        lower_patches(result).batches[0].channels[0].nets.tolist()
    )


def test_a_surface_without_channels_is_written_without_their_fields() -> None:
    assert set(definition(parse_surface(NET))) == {"type", "control_net", "up", "name"}
    assert "attributes" not in definition(parse_surface(NET | {"attributes": {}}))


@pytest.mark.parametrize(
    ("channel", "code", "pointer"),
    [
        ({"colors": [[[1, 0, 0], [1, 0, 0, 1]]]}, "ragged", "/colors/0/1"),
        ({"colors": [[[1, 0, 0]], [[1, 0, 0], [0, 0, 0]]]}, "ragged", "/colors/1"),
        ({"colors": [[[1, 0, 256]]]}, "out_of_range", "/colors/0/0/2"),
        ({"colors": [[[1, 0, True]]]}, "wrong_type", "/colors/0/0/2"),
        ({"colors": [[1]]}, "wrong_type", "/colors/0/0"),
        ({"colors": [[]]}, "empty_list", "/colors/0"),
        ({"colors": None}, "null_value", "/colors"),
        ({"colors": [[[0, 0, 0]] * 11] * 11}, "too_many_control_points", "/colors"),
        ({"uvs": [[[1, 0, 0]]]}, "wrong_dimension", "/uvs/0/0"),
        ({"attributes": None}, "null_value", "/attributes"),
        ({"attributes": [1]}, "wrong_type", "/attributes"),
        ({"attributes": {"t": None}}, "null_value", "/attributes/t"),
        ({"attributes": {"t": [[1]]}}, "wrong_type", "/attributes/t/0/0"),
        ({"attributes": {"t": [[[1]], [["1"]]]}}, "wrong_type", "/attributes/t/1/0/0"),
        ({"attributes": {"t": [[[]]]}}, "empty_list", "/attributes/t/0/0"),
        # Pydantic's paths have the kind of surface after a field `surface`, and pointers omit it.
        # Here `surface` is the name of an attribute, so nothing is omitted.
        ({"attributes": {"surface": [[["1"]]]}}, "wrong_type", "/attributes/surface/0/0/0"),
        ({"attributes": {"a~b/c": [[[1]]]}}, "wrong_value", "/attributes/a~0b~1c"),
    ],
)
def test_issues_of_channels_have_the_pointer_of_the_invalid_value(
    channel: dict[str, Any], code: str, pointer: str
) -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_surface(NET | channel)
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == (code, f"/surface{pointer}")
    assert issue.got
    assert issue.needed


def test_channels_of_patches_need_one_value_for_each_vertex() -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_surface(PATCHES | {"uvs": [[0, 0]] * 3})
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("channel_shape", "/surface/uvs")
    assert (issue.got, issue.needed) == ("3 values", "4 values")


def test_at_most_20_issues_of_channels_are_returned() -> None:
    with pytest.raises(InvalidRequest) as caught:
        parse_surface(NET | {"attributes": {f"{k}": [[["x"]]] for k in range(5000)}})
    assert len(caught.value.issues) == 20


def test_channels_of_integers_become_float64() -> None:
    (channel,) = lower_patches(parse_surface(NET | {"uvs": [[[1, 2]]]})).batches[0].channels
    assert channel.nets.dtype == np.float64
