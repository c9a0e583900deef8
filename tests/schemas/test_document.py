"""JSON texts to values: refusals, their places, and their cost."""

import json
import tracemalloc
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest, MalformedJson
from service.schemas.document import DocumentBudget, DocumentLimits, parse_document
from service.schemas.request import MeshRequest
from service.schemas.scan import MAX_PREFIX, find_pointer, find_repeated_key, is_deeper
from service.schemas.validation import validate_document

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=20,
)


@given(VALUES, st.sampled_from([None, 2]))
def test_documents_are_parsed_as_json_says(value: Any, indent: int | None) -> None:
    assert parse_document(json.dumps(value, indent=indent).encode()) == value


@given(VALUES)
def test_distinct_keys_are_never_called_repeated(value: Any) -> None:
    assert find_repeated_key(json.dumps(value).encode()) is None


@given(VALUES, st.text(max_size=4), VALUES)
def test_repeated_keys_are_always_found(value: Any, key: str, other: Any) -> None:
    name, escaped = json.dumps(key), "".join(f"\\u{ord(c):04x}" for c in key if ord(c) < 1 << 16)
    body = f'{{"x":[{json.dumps(value)}],"y":{{{name}:1,{name}:{json.dumps(other)}}}}}'
    with pytest.raises(InvalidRequest) as refusal:
        parse_document(body.encode())
    assert refusal.value.issues[0].code == "repeated_key"
    assert refusal.value.issues[0].pointer.startswith("/y/")
    if all(ord(c) < 1 << 16 for c in key):
        body = f'{{{name}:1,"{escaped}":2}}'
        with pytest.raises(InvalidRequest):
            parse_document(body.encode())


def list_paths(value: Any, pointer: str = "") -> dict[str, Any]:
    """Every value of a document by its pointer (an oracle for `find_pointer`)."""
    result = {pointer: value}
    if isinstance(value, dict):
        for key, child in value.items():
            result |= list_paths(child, f"{pointer}/{key.replace('~', '~0').replace('/', '~1')}")
    elif isinstance(value, list):
        for index, child in enumerate(value):
            result |= list_paths(child, f"{pointer}/{index}")
    return result


@given(VALUES)
def test_pointers_lead_back_to_their_field(value: Any) -> None:
    """Each value in turn is replaced by NaN, whose place the error must name."""
    for pointer, child in list_paths(value).items():
        marked = json.dumps(_insert_mark(value, child, pointer, "")).encode()
        at = marked.index(b'"\\u0000mark"')
        assert find_pointer(marked, at) == pointer


def _insert_mark(value: Any, child: Any, target: str, pointer: str) -> Any:
    if pointer == target:
        return "\0mark"
    if isinstance(value, dict):
        return {
            k: _insert_mark(
                v, child, target, f"{pointer}/{k.replace('~', '~0').replace('/', '~1')}"
            )
            for k, v in value.items()
        }
    if isinstance(value, list):
        return [_insert_mark(v, child, target, f"{pointer}/{i}") for i, v in enumerate(value)]
    return value


def test_position_of_nan_counts_bytes_behind_other_letters() -> None:
    with pytest.raises(InvalidRequest) as refusal:
        parse_document('{"größe":"€€€€","net":[1,NaN]}'.encode())
    issue = refusal.value.issues[0]
    assert (issue.code, issue.pointer) == ("not_finite", "/net/1")


def test_malformed_text_is_located_by_line_and_column() -> None:
    with pytest.raises(MalformedJson) as refusal:
        parse_document(b'{"a": 1,\n "b": [1, 2;]}')
    issue = refusal.value.issues[0]
    assert issue.pointer == "/b/1"
    assert "line 2, column 12" in issue.message


@pytest.mark.parametrize(
    ("body", "got"),
    [
        (b'{"a": "\xff"}', "bytes that are not UTF-8"),
        (b'{"a": "\xed\xa0\x80"}', "bytes that are not UTF-8"),
        ("[1]".encode("utf-16"), "UTF-16 or UTF-32"),
        ("[1]".encode("utf-16-le"), "UTF-16 or UTF-32"),
        ("[1]".encode("utf-16-be"), "UTF-16 or UTF-32"),
        ("[1]".encode("utf-32"), "UTF-16 or UTF-32"),
        ("[1]".encode("utf-32-be"), "UTF-16 or UTF-32"),
        ("[1]".encode("utf-8-sig"), "a byte order mark"),
        (b"", "an empty text"),
        (b" ", "an empty text"),
        (b"[1", "the end of the text"),
        (b"[1] 2", "more text after the document"),
        (b"[1,]", "a comma with nothing behind it"),
        (b"[01]", "a number with a leading zero"),
        (b"[1.]", "a number that lacks digits"),
        (b"[-]", "a number that lacks digits"),
        (b"{a: 1}", "something else than a key in quotes"),
        (b'{"a" 1}', "no colon after a key"),
        (b'["\\x"]', "an escape that JSON does not have"),
        (b'["\\ud800"]', "half of a surrogate pair"),
        (b'["\1"]', "a control character in a string"),
        (b"[tru]", "a character that cannot stand here"),
        (b"\0", "a character that cannot stand here"),
    ],
)
def test_invalid_json_has_error_messages_of_the_service(body: bytes, got: str) -> None:
    with pytest.raises(MalformedJson) as refusal:
        parse_document(body)
    assert refusal.value.issues[0].got == got


def measure_depth(value: object) -> int:
    """Brackets that are open at the deepest place of a document."""
    if isinstance(value, dict):
        value = list(value.values())
    return 1 + max(map(measure_depth, value), default=0) if isinstance(value, list) else 0


_TEXTS = st.text('[]{}",\\a', max_size=6)
_NESTED = st.recursive(
    st.integers() | _TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_TEXTS, inner, max_size=4),
    max_leaves=30,
)


@given(_NESTED, st.integers(0, 2), st.booleans())
def test_depth_is_counted_outside_of_strings(value: object, within: int, is_long: bool) -> None:
    blank = " " * (300_000 * is_long)  # longer than one step of the scan
    text = json.dumps([value]).encode().replace(b"[", b"[" + blank.encode(), 1)
    depth = measure_depth([value])
    assert not is_deeper(text, depth + within)
    assert is_deeper(text, depth - 1 - within) or depth - 1 - within < 0


@pytest.mark.parametrize(("opened", "closed"), [("[", "]"), ('{"a":', "}"), ('[{"[":', "}]")])
@pytest.mark.parametrize("levels", [17, 2000])
def test_documents_nested_too_deeply_are_refused(opened: str, closed: str, levels: int) -> None:
    per_level = len(closed)
    text = (opened * levels + "0" + closed * levels).encode()
    with pytest.raises(InvalidRequest) as refusal:
        parse_document(text, 16)
    assert refusal.value.issues[0].code == "too_deep"
    fitting = (opened * (16 // per_level) + "0" + closed * (16 // per_level)).encode()
    assert parse_document(fitting, 16) == json.loads(fitting)


def test_byte_that_is_no_utf8_is_located() -> None:
    with pytest.raises(MalformedJson, match=r"not in UTF-8 \(byte 8\)"):
        parse_document(b'{"a": "\xff"}')


def test_no_pointer_is_looked_for_out_of_sight() -> None:
    text = b"[" + b" " * MAX_PREFIX + b"NaN]"
    assert find_pointer(text, text.index(b"N")) == ""


@pytest.mark.parametrize("number", ["1e308", "-1e308", "5e-324", "1e-400", "123456789012345678901"])
def test_numbers_within_double_precision_are_taken(number: str) -> None:
    assert parse_document(f"[{number}]".encode()) == [float(number)]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (b"[" * 1001, "too_many_values"),
        (b"1," * 1001, "too_many_values"),
        (b'{"":' * 1001, "too_many_values"),
        (b'""' * 50_001, "too_many_strings"),
        (b"{}" * 50_001, "too_many_strings"),
    ],
)
def test_the_budget_holds_for_any_division_into_pieces(text: bytes, code: str) -> None:
    for size in (1, 7, 4096, len(text)):
        if len(text) // size > 5000:
            continue
        pieces = [text[start : start + size] for start in range(0, len(text), size)]
        with pytest.raises(InvalidRequest) as refusal:
            _take(pieces, 1000 if code == "too_many_values" else 10**6)
        assert refusal.value.issues[0].code == code


def _take(pieces: list[bytes], max_values: int) -> None:
    budget = DocumentBudget(DocumentLimits(max_values=max_values))
    for piece in pieces:
        budget.take(piece)


DENSE = ",".join(["[0,1]"] * 5000)


@pytest.mark.parametrize("head", ['{\n  "a": [', '{ \t"a":[', ' \n{\r\n\r\n"a":[', "[   [["])
def test_dense_numbers_behind_an_indented_beginning_are_read(head: str) -> None:
    """orjson 3.11.0 to 3.13.0 have no memory for some of these; errors stay where they are."""
    end = "]}" if "a" in head else "]]]"
    text = f"{head}{DENSE}{end}"
    assert parse_document(text.encode()) == json.loads(text)
    with pytest.raises(MalformedJson) as refusal:
        parse_document(f"{head}{DENSE},x{end}".encode())
    line, column = 1 + head.count("\n"), len(head.rpartition("\n")[2]) + len(DENSE) + 2
    assert f"line {line}, column {column}" in refusal.value.issues[0].message


def test_the_parser_still_needs_a_second_try() -> None:
    """If a newer orjson passes this test, `_parse` is not needed any more."""
    with pytest.raises(orjson.JSONDecodeError, match="memory"):
        orjson.loads(b"[  " + b"0," * 5000 + b"0]")


def test_a_budget_counts_the_memory_of_parsed_values() -> None:
    """The document and the surface made of it, and the text itself; not ten times as much."""
    net = np.random.default_rng(1).normal(size=(100, 100, 3))
    for decimals in (17, 3):
        body = orjson.dumps(
            {"surface": {"type": "bspline", "control_net": net.round(decimals)}},
            option=orjson.OPT_SERIALIZE_NUMPY,
        )
        budget = DocumentBudget()
        budget.take(body)
        tracemalloc.start()
        document = parse_document(body)
        # The parser reserves far more than it uses.
        tracemalloc.reset_peak()
        validate_document(MeshRequest, document).to_surface()
        most = len(body) + tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most <= budget.memory <= 3 * most
