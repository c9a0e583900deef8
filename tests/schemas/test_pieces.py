"""JSON that is parsed in pieces is JSON that is parsed at once."""

import random
from collections.abc import Iterator
from typing import Any

import orjson
import pytest

from service.schemas import pieces

ODD = (
    b"\x0b",
    b"[",
    b"]",
    b",",
    b"",
    b"1",
    b'"',
    b"{",
    b"}",
    b"\\",
    b",,",
    b"[]",
    b" ",
    b"],[",
    b"\xff",
)
TEXTS = ('quoted \\" [[1], [2]]', "array 0", "\\\\", "]" * 200)


@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "PIECE", 48)


def nested(source: random.Random, depth: int) -> Any:
    if depth == 0:
        return source.choice([1, 2.5, -3e-7, 0])
    return [nested(source, depth - 1) for _ in range(source.randint(1, 7))]


def documents(count: int) -> Iterator[bytes]:
    source = random.Random(7)
    for _ in range(count):
        makers = (
            lambda: nested(source, source.randint(1, 4)),
            lambda: source.choice(TEXTS),
            lambda: [{"m": nested(source, 3)}, {"m": nested(source, 2)}],
        )
        document = {f"k{i}": source.choice(makers)() for i in range(source.randint(1, 5))}
        text = orjson.dumps(document, option=source.choice([0, orjson.OPT_INDENT_2]))
        yield text
        for _ in range(2):
            at = source.randrange(len(text))
            yield text[:at] + source.choice(ODD) + text[at + source.randint(0, 1) :]


def outcome(parse: Any, text: bytes) -> str:
    try:
        return repr(parse(text))
    except orjson.JSONDecodeError as error:
        return str(error)


def test_whatever_the_text_is_the_value_or_the_error_is_the_parsers() -> None:
    for text in documents(1000):
        assert outcome(pieces.loads, text) == outcome(orjson.loads, text), text


def test_arrays_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    text = orjson.dumps({"a": [[[i, j] for i in range(40)] for j in range(40)], "b": "]" * 99})
    parsed: list[int] = []
    parse = orjson.loads

    def loads(piece: bytes) -> object:
        parsed.append(len(piece))
        return parse(piece)

    expected = parse(text)
    monkeypatch.setattr(orjson, "loads", loads)
    assert pieces.loads(text) == expected
    assert len(parsed) > len(text) // 60
    assert max(parsed) < 200


def test_white_space_is_that_of_json() -> None:
    rows = orjson.dumps([[i, i] for i in range(99)])
    for cut in range(1, 98):
        text = rows.replace(b"],[%d," % cut, b"],\x0b[%d," % cut)
        assert outcome(pieces.loads, text) == outcome(orjson.loads, text)


def test_a_name_that_stands_for_an_array_may_be_somebodys_own() -> None:
    array = [[i, i] for i in range(99)]
    text = orjson.dumps({"mine": "array 0", "other": array})
    assert pieces.loads(text) == {"mine": "array 0", "other": array}
    hidden = {"mine": "array 0", "other": ["text", array]}
    assert pieces.loads(orjson.dumps(hidden)) == hidden
