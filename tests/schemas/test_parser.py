"""JSON is parsed whether its blanks are spread evenly or not."""

import json
import random

import orjson
import pytest

from service.schemas.document import parse_document
from service.schemas.parser import parse

ROWS = {"pairs": [[0, 1]] * 5000, "nets": [[[0, 1], [2, 3]]] * 3000, "numbers": [7] * 50_000}


@pytest.mark.parametrize("name", ROWS)
@pytest.mark.parametrize("head", ['{\n  "a": ', '{ \t"a":', ' \n{\r\n\r\n"a":', '{"a":'])
def test_dense_numbers_behind_an_indented_beginning(name: str, head: str) -> None:
    dense = json.dumps(ROWS[name], separators=(",", ":"))
    assert parse(f"{head}{dense}}}".encode()) == {"a": ROWS[name]}
    assert parse(f"[   {dense}]".encode()) == [ROWS[name]]
    assert parse_document(f"{head}{dense}}}".encode()) == {"a": ROWS[name]}


def test_the_parser_still_needs_this() -> None:
    """When it does not, this module can go."""
    with pytest.raises(orjson.JSONDecodeError, match="memory"):
        orjson.loads(b"[  " + b"0," * 5000 + b"0]")


def test_errors_are_told_where_they_are() -> None:
    dense = b"0," * 5000
    chance = random.Random(3)
    for _ in range(50):
        at = chance.randrange(1000) * 2
        text = b"[ \n  " + dense[:at] + b"x" + dense[at:] + b"0]"
        with pytest.raises(orjson.JSONDecodeError) as found:
            parse(text)
        assert found.value.pos == 5 + at
        assert (found.value.lineno, found.value.colno) == (2, 3 + at)


@pytest.mark.parametrize("text", [b"", b"[", b"{  ", b"[  1", b"\xff", b"[  \xff]", b"[  1 2]"])
def test_other_errors_are_the_parsers(text: bytes) -> None:
    with pytest.raises(orjson.JSONDecodeError) as ours:
        parse(text)
    with pytest.raises(orjson.JSONDecodeError) as own:
        orjson.loads(text)
    assert (ours.value.msg, ours.value.pos) == (own.value.msg, own.value.pos)
