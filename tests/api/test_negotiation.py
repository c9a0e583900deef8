"""The format of a response is the one that the header `Accept` prefers."""

import pytest

from service.api.errors import NotAcceptable
from service.api.negotiation import format_by_accept
from service.encoders.registry import FORMATS


@pytest.mark.parametrize(
    ("header", "name"),
    [
        (None, "json"),
        ("", "json"),
        ("*/*", "json"),
        ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", "json"),
        ("application/json", "json"),
        ("application/*", "json"),
        ("model/gltf-binary", "glb"),
        ("Model/GLTF-Binary", "glb"),
        ("model/*", "glb"),
        ("model/stl", "stl"),
        ("model/stl;q=0.5, model/obj", "obj"),
        ("model/stl;q=0.5, model/obj;q=0.4", "stl"),
        ("model/stl;q=0.5, */*;q=0.1", "stl"),
        ("model/stl;q=0.1, */*;q=0.5", "json"),
        ("*/*, application/json;q=0.2", "glb"),
        ("application/json;q=0, */*", "glb"),
        ("model/*;q=0.5, model/gltf-binary;q=0.1, model/obj;q=0.6", "obj"),
        ("model/stl, */*", "stl"),
        ("image/png, model/x-oogl;q=0.001", "oogl"),
        ("model/stl; charset=utf-8; q=0.3, model/x-ply;q=0.2", "stl"),
        ("model/gltf+json;q=1.000", "gltf"),
        ("model/stl;q=2, model/obj;q=0.1", "obj"),  # a quality value above 1 counts as 0
        ("nonsense, model/stl", "stl"),
    ],
)
def test_the_preferred_format_is_chosen(header: str | None, name: str) -> None:
    """Among equal quality values the more specific range wins, then JSON, then GLB."""
    assert format_by_accept(header, FORMATS).name == name


@pytest.mark.parametrize(
    "header",
    [
        "image/png",
        "video/*",
        "*/*;q=0",
        "model/stl;q=0",
        "json",
        "*/json",
        "model/stl;q=x",
        ";;;,,,",
        "image/png," * 200 + "model/stl",  # the service reads only the first 100 items
    ],
)
def test_headers_that_accept_no_format_are_refused(header: str) -> None:
    with pytest.raises(NotAcceptable) as error:
        format_by_accept(header, FORMATS)
    assert "model/gltf-binary" in error.value.issues[0].needed
