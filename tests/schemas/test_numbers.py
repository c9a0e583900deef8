"""Long arrays of numbers that are read without lists are those that the lists would have been."""

import json
import random
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.schemas import pieces
from service.schemas.document import DocumentLimits, parse_document, understood
from service.schemas.numbers import read_numbers
from service.schemas.points import points_request
from service.schemas.request import surface_request
from tests.schemas.test_pieces import documents

LIMITS = DocumentLimits()

NUMBERS = st.one_of(
    st.integers(-(10**4), 10**4),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(["-0", "-0.0", "1e5", "1E-7", "9007199254740993", "9223372036854775807"]),
)
SHAPES = st.lists(st.integers(1, 4), min_size=1, max_size=4)
BLANKS = st.sampled_from(["", " ", "\n\t", "\r\n  "])


def as_lists(value: object) -> object:
    """The value with lists in the place of arrays."""
    if isinstance(value, dict):
        return {key: as_lists(child) for key, child in value.items()}
    if isinstance(value, list):
        return [as_lists(child) for child in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def outcome(parse: Callable[[bytes], object], text: bytes) -> tuple[object, str]:
    try:
        return as_lists(parse(text)), ""
    except orjson.JSONDecodeError as error:
        return None, str(error)


def counted(value: object) -> int:
    """Arrays in a document."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return sum(map(counted, value))
    return isinstance(value, np.ndarray)


def written(numbers: Iterator[str], shape: list[int], blank: str) -> str:
    """Numbers in lists in lists."""
    if not shape:
        return f"{blank}{next(numbers)}{blank}"
    inner = ",".join(written(numbers, shape[1:], blank) for _ in range(shape[0]))
    return f"{blank}[{inner}]{blank}"


@given(SHAPES, st.data(), BLANKS, st.integers(8, 60))
def test_an_array_of_numbers_is_read_as_its_lists(
    shape: list[int], data: st.DataObject, blank: str, piece: int
) -> None:
    count = int(np.prod(shape))
    numbers = [str(n) for n in data.draw(st.lists(NUMBERS, min_size=count, max_size=count))]
    text = written(iter(numbers), shape, blank).strip()
    before, behind = b'{"a":', b',"b":[1]}'
    body = before + text.encode() + behind
    found = read_numbers(body, len(before), len(body), piece)
    if found is None:  # a number longer than a piece
        assert max(map(len, numbers)) + 2 * len(blank) + 2 * len(shape) > piece - 2
        return
    array, stop = found
    lists = orjson.loads(text)
    assert array.shape == tuple(shape)
    assert body[stop:] == behind
    kind = np.int64 if all(type(n) is int for n in np.ravel(np.array(lists, object))) else float
    assert array.dtype == kind
    expected = np.array(lists, np.float64)
    assert array.astype(np.float64).tobytes() == expected.tobytes(), "-0 and -0.0, too"


MISPLACED = (
    "[[1,2],3]", "[1,[2,3]]", "[[1,2],[3]]", "[[1],[[2]]]", "[[],[1]]", "[[1],[]]", "[]", "[[]]",
    "[1[,2]]", "[[1,]2]", "[1,2", "[[1,2],[3,4]", "[1,2]]", "[,1]", "[1,]", "[1,,2]", "[1 2]",
    "[[1]2]", "[1[2]]", "[[1][2]]", "[[1,2][,3,4]]", "[[1,2,]3,4]", "[true]", "[null,1]", "[01]",
    "[1,2,NaN]", "[+1]", "[1.]", "[.5]", "[1e]", "[1e400]", "[18446744073709551616]",
    "[9223372036854775808]", "[1,2,3][4]", "[1,2,3]4", "[[1,2],[3,4],]", "[[[1]],[[2]],[3]]",
)  # fmt: skip


@pytest.mark.parametrize("text", MISPLACED)
@pytest.mark.parametrize("blank", ["", " "])
def test_whatever_else_it_is_the_value_or_the_error_is_the_parsers(
    text: str, blank: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spaced = text.replace("[", f"[{blank}").replace("]", f"{blank}]").replace(",", f"{blank},")
    for piece in (3, 4, 5, 7, 9, 99):
        monkeypatch.setattr(pieces, "PIECE", piece)
        for body in (f'{{"a":{spaced}}}'.encode(), f'{{"b":0,"a": {spaced} }}'.encode()):
            got = outcome(lambda body: pieces.loads(body, arrays=True), body)
            assert got == outcome(orjson.loads, body)


def test_so_it_is_for_whatever_document(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "PIECE", 48)
    for text in documents(600):
        got = outcome(lambda text: pieces.loads(text, arrays=True), text)
        assert got == outcome(orjson.loads, text), text


def test_changed_anywhere_it_is_read_or_refused_as_by_the_parser(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pieces, "PIECE", 40)
    chance = random.Random(5)
    arrays = 0
    for _ in range(4000):
        shape = [chance.randint(1, 5) for _ in range(chance.randint(1, 4))]
        count = int(np.prod(shape))
        numbers = (str(chance.choice([0, 1.5, -2e-7, 31])) for _ in range(count))
        text = written(numbers, shape, chance.choice(["", " "]))
        at = chance.randrange(len(text))
        change = chance.choice(["", "[", "]", ",", "1", " ", "],[", "e", "-", "t", "[]"])
        body = f'{{"a":{text[:at]}{change}{text[at + chance.randint(0, 1) :]}}}'.encode()
        got = outcome(lambda body: pieces.loads(body, arrays=True), body)
        assert got == outcome(orjson.loads, body), body
        if not got[1]:
            arrays += counted(pieces.loads(body, arrays=True))
    assert arrays > 300


def request(**surface: Any) -> bytes:
    return json.dumps({"surface": surface}).encode()


def grid(rows: int, columns: int) -> list[list[list[float]]]:
    return [[[i, j, i * j % 7 / 7] for j in range(columns)] for i in range(rows)]


SURFACES = {
    "a net": request(type="bspline", degree=2, control_net=grid(9, 8)),
    "whole numbers": request(control_net=[[[i, j, i * j] for j in range(9)] for i in range(9)]),
    "weights": request(control_net=grid(9, 9), weights=[[1 + i] * 9 for i in range(9)]),
    "knots": request(
        type="bspline", degree=1, control_net=grid(30, 2), knots=[[0, *range(30), 29], [0, 0, 1, 1]]
    ),
    "patches": request(
        type="patches",
        vertices=[[i, j, 0] for i in range(9) for j in range(9)],
        patches=[[[9 * i + j, 9 * i + j + 1], [9 * i + j + 9, 9 * i + j + 10]]
                 for i in range(8) for j in range(8)],
    ),
    "a triangle": request(type="triangle", control_net=[
        [[i, j, 0] for j in range(9 - i)] for i in range(9)]),
}  # fmt: skip
FAULTS = {
    "an index that is none": SURFACES["patches"].replace(b"[40, 41]", b"[40, 41.0]"),
    "an index too large": SURFACES["patches"].replace(b"[40, 41]", b"[40, 410]"),
    "a ragged row": SURFACES["a net"].replace(b"[3, 4, ", b"[3, 4, 5, "),
    "a weight of zero": SURFACES["weights"].replace(b"[5, 5,", b"[5, 0,"),
    "a net too flat": request(control_net=[[i, j] for i in range(9) for j in range(9)]),
    "somewhere else": request(control_net=grid(2, 2), name=[[1] * 9] * 9),
    "of a field that is none": request(control_net=grid(2, 2), names=[[1] * 9] * 9),
    "no numbers": SURFACES["a net"].replace(b"[3, 4, ", b"[3, true, "),
    "a triangle without rows": request(type="triangle", control_net=grid(1, 36)[0]),
    "a triangle of equal rows": request(type="triangle", control_net=grid(6, 6)),
    "triangles without rows": request(
        type="patches", vertices=grid(1, 36)[0], triangles=[[k, k + 1, k + 2] for k in range(34)]
    ),
}
AGAIN = (
    "an index that is none",
    "somewhere else",
    "a triangle without rows",
    "a triangle of equal rows",
    "triangles without rows",
)
"""Refused for a type."""


@pytest.mark.parametrize("name", [*SURFACES, *FAULTS])
def test_a_request_means_the_same_however_it_is_read(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = (SURFACES | FAULTS)[name]

    def surface(document: object) -> str:
        return repr(surface_request(document, LIMITS).to_surface())

    try:
        expected = surface(parse_document(body))
    except InvalidRequest as error:
        expected = repr(error.issues)
    monkeypatch.setattr(pieces, "PIECE", 60)
    shown: list[int] = []

    def counting(document: object) -> str:
        shown.append(counted(document))
        return surface(document)

    try:
        got = understood(body, counting)
    except InvalidRequest as error:
        got = repr(error.issues)
    assert got == expected
    assert shown[0] > 0 or name in ("a triangle", "a ragged row", "no numbers")
    assert len(shown) == (2 if name in AGAIN else 1)


def test_points_that_are_asked_for_may_be_an_array(monkeypatch: pytest.MonkeyPatch) -> None:
    document: dict[str, Any] = {
        "surface": {"control_net": grid(2, 2)},
        "uv": [[k / 40, 0.5] for k in range(40)],
    }
    document["patch"] = [0] * 40
    monkeypatch.setattr(pieces, "PIECE", 60)
    shown: list[int] = []

    def query(value: object) -> object:
        shown.append(counted(value))
        return points_request(value, LIMITS).to_query()

    body = json.dumps(document).encode()
    assert repr(understood(body, query)) == repr(query(document))
    assert shown == [2, 0]


def test_a_number_longer_than_a_piece_is_left_to_the_parser() -> None:
    text = b"[[1, 0.%s], [3, 4]]" % (b"0" * 99)
    assert read_numbers(text, 0, len(text), 20) is None
