"""JSON texts become values, or are refused with a position; and budgets of memory."""

import json
import tracemalloc
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest, MalformedJson, SurfaceError
from service.schemas.budget import DocumentBudget
from service.schemas.document import DocumentLimits, parse_document
from service.schemas.request import MeshRequest
from service.schemas.scan import MAX_PREFIX, find_pointer, find_repeated_key, is_deeper
from service.schemas.validation import validate_document

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-99, 99) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=20,
)


@given(VALUES, st.sampled_from([None, 2]))
def test_documents_are_parsed_like_the_json_module(value: Any, indent: int | None) -> None:
    assert parse_document(json.dumps(value, indent=indent).encode()) == value


@given(VALUES)
def test_documents_with_distinct_keys_have_no_repeated_key(value: Any) -> None:
    assert find_repeated_key(json.dumps(value).encode()) is None


@given(VALUES, st.text(max_size=4), VALUES)
def test_repeated_keys_are_refused_also_if_one_is_escaped(
    value: Any, key: str, second_value: Any
) -> None:
    name = json.dumps(key)
    body = f'{{"x":[{json.dumps(value)}],"y":{{{name}:1,{name}:{json.dumps(second_value)}}}}}'
    with pytest.raises(InvalidRequest) as refusal:
        parse_document(body.encode())
    assert refusal.value.issues[0].code == "repeated_key"
    assert refusal.value.issues[0].pointer.startswith("/y/")
    if all(ord(c) < 1 << 16 for c in key):  # an escape has four hexadecimal digits
        escaped_key = "".join(f"\\u{ord(c):04x}" for c in key)
        body = f'{{{name}:1,"{escaped_key}":2}}'
        with pytest.raises(InvalidRequest):
            parse_document(body.encode())


def list_pointers(value: Any, pointer: str = "") -> list[str]:
    """The JSON pointers of all values in a document, to compare with `find_pointer`."""
    result = [pointer]
    if isinstance(value, dict):
        for key, child in value.items():
            result += list_pointers(child, f"{pointer}/{key.replace('~', '~0').replace('/', '~1')}")
    elif isinstance(value, list):
        for index, child in enumerate(value):
            result += list_pointers(child, f"{pointer}/{index}")
    return result


@given(VALUES)
def test_a_byte_has_the_pointer_of_its_value(value: Any) -> None:
    """Each value in turn is replaced by a mark; the position of the mark gives the pointer."""
    for pointer in list_pointers(value):
        text = json.dumps(_insert_mark(value, pointer, "")).encode()
        position = text.index(b'"\\u0000mark"')
        assert find_pointer(text, position) == pointer


def _insert_mark(value: Any, target: str, pointer: str) -> Any:
    """The value at `pointer` of a document, with a mark in place of the value at `target`."""
    if pointer == target:
        return "\0mark"
    if isinstance(value, dict):
        return {
            k: _insert_mark(v, target, f"{pointer}/{k.replace('~', '~0').replace('/', '~1')}")
            for k, v in value.items()
        }
    if isinstance(value, list):
        return [_insert_mark(v, target, f"{pointer}/{i}") for i, v in enumerate(value)]
    return value


def test_the_pointer_of_nan_is_right_after_letters_of_several_bytes() -> None:
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


MARK = b"\xef\xbb\xbf"
"""A byte order mark in UTF-8."""


def test_a_byte_order_mark_before_the_text_is_skipped() -> None:
    assert parse_document(MARK + b'{"a": [1]}') == {"a": [1]}


@pytest.mark.parametrize(
    "body",
    [b'{"a": 1,\n "b": [1, 2;]}', b'{"a": {"b": 1, "b": 2}}', b'{"a": [1, NaN]}', b"[" * 40],
)
def test_errors_have_the_same_position_after_a_byte_order_mark(body: bytes) -> None:
    issues = []
    for text in (body, MARK + body):
        with pytest.raises(SurfaceError) as refusal:
            parse_document(text)
        issues.append(refusal.value.issues)
    assert issues[0] == issues[1]


def test_bytes_that_are_not_utf8_are_counted_with_the_byte_order_mark() -> None:
    with pytest.raises(MalformedJson) as refusal:
        parse_document(MARK + b'["\xff"]')
    assert refusal.value.issues[0].message == "The text is not in UTF-8 (byte 6)."


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
        (b"\xef\xbb\xbf", "an empty text"),
        (b"\xef\xbb\xbf\xef\xbb\xbf[1]", "a character that cannot stand here"),
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
    """The number of lists and objects around the most deeply nested value of a document."""
    if isinstance(value, dict):
        value = list(value.values())
    return 1 + max(map(measure_depth, value), default=0) if isinstance(value, list) else 0


_TEXTS = st.text('[]{}",\\a', max_size=6)
_NESTED = st.recursive(
    st.integers() | _TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_TEXTS, inner, max_size=4),
    max_leaves=30,
)


@given(_NESTED, st.integers(0, 2))
def test_brackets_in_strings_do_not_count_as_depth(value: object, margin: int) -> None:
    text = json.dumps([value]).encode()
    depth = measure_depth([value])
    assert not is_deeper(text, depth + margin)
    assert is_deeper(text, depth - 1 - margin) or depth - 1 - margin < 0


@pytest.mark.parametrize(("begin", "end"), [("[", "]"), ('{"a":', "}"), ('[{"[":', "}]")])
@pytest.mark.parametrize("levels", [17, 2000])
def test_documents_nested_too_deeply_are_refused(begin: str, end: str, levels: int) -> None:
    brackets = len(end)  # that one repetition opens: one or two
    text = (begin * levels + "0" + end * levels).encode()
    with pytest.raises(InvalidRequest) as refusal:
        parse_document(text, 16)
    assert refusal.value.issues[0].code == "too_deep"
    text = (begin * (16 // brackets) + "0" + end * (16 // brackets)).encode()
    assert parse_document(text, 16) == json.loads(text)


def test_the_issue_names_the_position_of_a_byte_that_is_not_utf8() -> None:
    with pytest.raises(MalformedJson, match=r"not in UTF-8 \(byte 8\)"):
        parse_document(b'{"a": "\xff"}')


def test_the_pointer_is_empty_if_the_text_before_the_fault_is_too_long() -> None:
    text = b"[" + b" " * MAX_PREFIX + b"NaN]"
    assert find_pointer(text, text.index(b"N")) == ""


@pytest.mark.parametrize("number", ["1e308", "-1e308", "5e-324", "1e-400", "123456789012345678901"])
def test_numbers_within_the_range_of_float64_are_rounded_to_it(number: str) -> None:
    assert parse_document(f"[{number}]".encode()) == [float(number)]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (b"[" * 1001, "too_many_values"),
        (b"1," * 1001, "too_many_values"),
        (b'""' * 50_001, "too_many_strings"),
        (b"{}" * 400_001, "too_many_strings"),  # the code for too many objects, too
    ],
)
def test_the_budget_is_exceeded_however_the_text_is_divided_into_pieces(
    text: bytes, code: str
) -> None:
    for size in (1, 7, 4096, len(text)):
        if len(text) // size > 5000:  # would take long
            continue
        pieces = [text[start : start + size] for start in range(0, len(text), size)]
        with pytest.raises(InvalidRequest) as refusal:
            _count_pieces(pieces, 1000 if code == "too_many_values" else 10**6)
        assert refusal.value.issues[0].code == code


def _count_pieces(pieces: list[bytes], max_values: int) -> None:
    """Counts the pieces of a text in one budget, which raises if it is exceeded."""
    budget = DocumentBudget(DocumentLimits(max_values=max_values))
    for piece in pieces:
        budget.take(piece)


DENSE = ",".join(["[0,1]"] * 5000)


@pytest.mark.parametrize("head", ['{\n  "a": [', '{ \t"a":[', ' \n{\r\n\r\n"a":[', "[   [["])
def test_dense_numbers_after_an_indented_beginning_are_read(head: str) -> None:
    """orjson 3.11.0 to 3.13.0 raise an error of memory for some of these texts.

    The service then moves the blanks and calls orjson again; errors keep their positions.
    """
    end = "]}" if "a" in head else "]]]"
    text = f"{head}{DENSE}{end}"
    assert parse_document(text.encode()) == json.loads(text)
    with pytest.raises(MalformedJson) as refusal:
        parse_document(f"{head}{DENSE},x{end}".encode())
    # The `x` is after the comma, and columns count from 1.
    line, column = 1 + head.count("\n"), len(head.rpartition("\n")[2]) + len(DENSE) + 2
    assert f"line {line}, column {column}" in refusal.value.issues[0].message


def test_orjson_still_raises_an_error_of_memory() -> None:
    """If this test fails with a newer orjson, `_parse` in the service is not needed any more."""
    with pytest.raises(orjson.JSONDecodeError, match="memory"):
        orjson.loads(b"[  " + b"0," * 5000 + b"0]")


def test_a_budget_counts_the_memory_of_parsed_values() -> None:
    """The budget is at least the memory of text, document and surface, and at most 3 times that."""
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
        # The parser reserves more memory than it uses; this peak is not counted.
        tracemalloc.reset_peak()
        validate_document(MeshRequest, document).to_surface()
        memory = len(body) + tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert memory <= budget.memory <= 3 * memory
