"""The answer of a child is checked before anything looks at it."""

from typing import Any

import pytest

from service.decoders.answers import parse_decoded
from service.framing import UNREADABLE

READING = {"format": "step", "faces": 7, "skipped_faces": []}


def test_the_answer_of_a_reader_is_taken() -> None:
    tree = {"type": "group", "members": [{"definition": 0}], "definitions": [{"type": "brep"}]}
    reading = READING | {"edge_gap": 0.5, "units": ["inch"], "skipped_entities": {"LINE": 1}}
    reading["skipped_faces"] = [{"entity": "#1", "reason": "it is open"}]
    decoded = parse_decoded({"tree": tree, "reading": reading})
    assert (decoded.tree, decoded.reading) == (tree, reading)


@pytest.mark.parametrize(
    "tree",
    [
        7,
        {"type": 7},
        {"type": "group", "members": [7]},
        {"type": "group", "members": {}},
        {"type": "group", "members": [{"surface": {}}]},
        {"type": "group", "definitions": [{"type": []}]},
        {"type": "brep", "faces": {}},
        {"type": "group", "definitions": [{"type": "brep", "edges": {}, "faces": {}}]},
    ],
)
def test_other_documents_are_refused(tree: object) -> None:
    with pytest.raises(UNREADABLE):
        parse_decoded({"tree": tree, "reading": READING})


@pytest.mark.parametrize(
    "reading",
    [
        {"faces": -1},
        {"faces": True},
        {"secret": "text"},
        {"system": "x" * 501},
        {"edge_gap": "0"},
        {"edge_gap": float("inf")},
        {"units": "inch"},
        {"skipped_entities": {"LINE": "1"}},
        {"skipped_faces": [{"entity": "#1"}]},
    ],
)
def test_other_reports_are_refused(reading: dict[str, Any]) -> None:
    with pytest.raises(UNREADABLE):
        parse_decoded({"tree": {"type": "brep"}, "reading": READING | reading})


@pytest.mark.parametrize("name", READING)
def test_incomplete_reports_are_refused(name: str) -> None:
    reading = {key: value for key, value in READING.items() if key != name}
    with pytest.raises(UNREADABLE):
        parse_decoded({"tree": {"type": "brep"}, "reading": reading})
