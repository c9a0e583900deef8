"""Entity tags of responses, and the tags in the header `If-None-Match`."""

import re

import pytest

from service.api.caching import cached_response as module
from service.api.caching.cached_response import entity_tag, matches_all, parse_tags
from service.api.caching.codings import CODINGS, COMPRESSOR_VERSIONS


def test_a_tag_depends_on_the_content_and_on_the_coding() -> None:
    tags = {entity_tag(content, coding) for content in ("a", "b") for coding in CODINGS}
    assert len(tags) == 2 * len(CODINGS)
    assert entity_tag("a", "gzip") == entity_tag("a", "gzip")
    for tag in tags:
        assert re.fullmatch(rb'"[A-Za-z0-9_-]{22}"', tag)


def test_another_version_of_the_compressor_has_other_tags(monkeypatch: pytest.MonkeyPatch) -> None:
    old_tags = {coding: entity_tag("a", coding) for coding in CODINGS}
    other_compressors = {**COMPRESSOR_VERSIONS, "gzip": "zlib 9.9.9"}
    monkeypatch.setattr(module, "COMPRESSOR_VERSIONS", other_compressors)
    codings_with_new_tags = {
        coding for coding in CODINGS if entity_tag("a", coding) != old_tags[coding]
    }
    assert codings_with_new_tags == {"gzip"}


@pytest.mark.parametrize(
    ("header", "tags"),
    [
        (b'"a"', {b'"a"'}),
        (b'W/"a"', {b'"a"'}),
        (b'"a", W/"b" ,"c,d"', {b'"a"', b'"b"', b'"c,d"'}),
        (b'""', {b'""'}),
        (b"a", set()),
        (b'"a', set()),
        (b"*", set()),
        (b'"a b"', set()),
        (b"", set()),
    ],
)
def test_the_tags_of_a_header_are_parsed(header: bytes, tags: set[bytes]) -> None:
    assert parse_tags(header) == tags


def test_a_star_matches_every_response() -> None:
    assert matches_all(b"*")
    assert matches_all(b" * ")
    assert not matches_all(b'"*"')
    assert not matches_all(b'*, "a"')
