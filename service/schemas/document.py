"""Parses a JSON text, with checks that the parser does not make.

`orjson` refuses NaN, Infinity, 1e400, lone surrogates and text that is not UTF-8. If an object has
two equal keys, orjson silently keeps the last; this module refuses such an object. A short text can
become many objects in memory, so `service.schemas.budget` counts values while the text is still
arriving.
"""

import re
from dataclasses import dataclass

import orjson

from service.errors import InvalidRequest, Issue, MalformedJson, pointer
from service.schemas.scan import MAX_PREFIX, find_pointer, find_repeated_key, is_deeper, shorten
from service.surface.checks import MAX_DEGREE

MAX_BYTES = 16 << 20
"""The most bytes of the JSON text of a request, by default."""

MAX_VALUES = 1_500_000
"""The most commas and opening brackets of the JSON text of a request. A surface of some 370,000
control points has this number."""

MAX_STRINGS = 50_000
"""The most strings (keys included) of the JSON text of a request, and the most keys of all objects
with more than `LONG_OBJECT` keys. A usual request has some twenty strings, and two for each named
part. The search for repeated keys takes 1 µs for each string."""

MAX_OBJECTS = 400_000
"""The most objects of the JSON text of a request: a brep has some ten for each face."""

STRINGS_PER_OBJECT, VALUES_PER_OBJECT = 12, 32
"""How many more strings and values are allowed for each object: a curve has up to 7 strings. A brep
of 20,000 faces has more than `MAX_STRINGS` strings, and it has very many objects."""

LONG_OBJECT = 64
"""No model has as many fields; only objects whose keys are names have more keys."""

MAX_DEPTH, PARSED_DEPTH = 32, 1024
"""The most brackets that may be open at once: in a request, which needs some ten; and in any text
that orjson can parse."""

MAX_FACES = 20_000
"""The most faces of all breps of a surface, by default."""

MAX_MEMBERS, MEMBERS_FACTOR = 4096, 16
"""The most surfaces of a group, by default: those of members, and those among its definitions; a
surface takes at least 0.5 ms, a tube 2 ms. A group may have `MEMBERS_FACTOR` times as many members,
because a member that names a definition, or places others, takes some microseconds."""

_UTF_16_OR_32 = re.compile(rb"\xff\xfe|\xfe\xff|[^\0]\0|\0{1,3}[^\0]")
"""The beginning of UTF-16 and UTF-32: a byte order mark, or a zero byte before or after the first
letter."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""The character U+FEFF in UTF-8: some editors and PowerShell write it before a text, and parsers
may skip it (RFC 8259, section 8.1). Lines and columns in errors do not count it."""

_NEEDED = "one JSON document in UTF-8 (RFC 8259)"

_PARSER_ERRORS = (
    ("surrogate", "half of a surrogate pair"),
    ("control character", "a control character in a string"),
    ("escape", "an escape that JSON does not have"),
    ("trailing comma", "a comma with nothing behind it"),
    ("leading zero", "a number with a leading zero"),
    ("no digit", "a number that lacks digits"),
    ("after document", "more text after the document"),
    ("string key", "something else than a key in quotes"),
    ("after key", "no colon after a key"),
    ("empty", "an empty text"),
    ("end of data", "the end of the text"),
)
"""Parts of orjson's error messages, and the text for the client if a message contains the part. So
clients get the same texts after orjson changes its messages."""

_INDENTED = re.compile(rb"\A([ \t\r\n]*[\[{])([ \t\r\n]+)")

_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class DocumentLimits:
    """The limits of one document; they do not depend on the memory of the machine.

    `max_values` applies only to JSON that arrives over HTTP, not to stored surfaces and files.
    """

    max_control_points: int = 1_000_000
    max_degree: int = MAX_DEGREE
    max_depth: int = MAX_DEPTH
    max_values: int = MAX_VALUES
    max_faces: int = MAX_FACES
    max_members: int = MAX_MEMBERS


DEFAULT_LIMITS = DocumentLimits()


def too_many_strings() -> InvalidRequest:
    """The error of a document with more strings or objects than any request needs."""
    return InvalidRequest(
        Issue(
            "too_many_strings",
            "The document has more strings or objects than any request needs.",
            "",
            f"more than {MAX_STRINGS} strings, and {STRINGS_PER_OBJECT} for each object; or more "
            f"than {MAX_OBJECTS} objects",
            "fewer, keys included",
        )
    )


def parse_document(body: bytes, max_depth: int = MAX_DEPTH) -> object:
    """Parse a JSON text to a value of dict, list, str, int, float, bool and None.

    A byte order mark before the text is skipped. `max_depth` limits the nesting of brackets, which
    RFC 8259, section 9, allows.

    Raises
    ------
    MalformedJson
        If the text is not one JSON document (RFC 8259) in UTF-8.
    InvalidRequest
        `not_finite` for NaN, Infinity and numbers beyond float64; `repeated_key`; `too_deep`;
        `too_many_strings` for too many keys of long objects.
    """
    received, body = body, body.removeprefix(_BYTE_ORDER_MARK)
    try:
        value = _parse(body)
    except orjson.JSONDecodeError as error:
        # `from None`: the exception of the parser contains the whole text, and must not go further.
        if "depth" in error.msg:
            raise _too_deep(max_depth) from None
        raise _refusal(error, body, len(received) - len(body)) from None
    if body.count(b"[") + body.count(b"{") > max_depth and is_deeper(body, max_depth):
        raise _too_deep(max_depth)
    # Usually the text has exactly one colon for each key that is counted. If not, a key is
    # repeated, a string contains a colon, or a list has other values before an object (invalid in
    # all requests). Only then search the text for a repeated key.
    if body.count(b":") != _count_keys(value):
        _refuse_repeated_key(body)
    return value


def _parse(text: bytes) -> object:
    """Parse a text with orjson, and avoid an error of orjson 3.11.0 to 3.13.0.

    If two blanks follow the first bracket, these versions expect that the whole text is indented;
    if it is not, they fail for lack of memory. In this case the blanks are moved before the
    bracket, and the text is parsed again. Moving them does not change the positions of later
    errors.
    """
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError as error:
        if "memory" not in error.msg:
            raise
    try:
        return orjson.loads(_INDENTED.sub(rb"\2\1", text))
    except orjson.JSONDecodeError as error:
        raise orjson.JSONDecodeError(error.msg, text.decode(), error.pos) from None


def _count_keys(value: object) -> int:
    """The number of keys of all objects, except objects in lists whose first item is no object.

    So the long lists, which contain only numbers, are not searched. A list of pcurves may begin
    with null.
    """
    count, long_count, stack = 0, 0, [value]
    while stack:
        item = stack.pop()
        if isinstance(item, dict):
            count += len(item)
            if len(item) > LONG_OBJECT:
                long_count += len(item)
                if long_count > MAX_STRINGS:
                    raise too_many_strings()
            stack += [child for child in item.values() if type(child) in (dict, list)]
        elif isinstance(item, list) and item and (type(item[0]) is dict or item[0] is None):
            stack += [child for child in item if child and type(child) is dict]
    return count


def _too_deep(max_depth: int) -> InvalidRequest:
    """The error for a text in which more than `max_depth` brackets are open at once."""
    return InvalidRequest(
        Issue(
            "too_deep",
            "The brackets of the document are nested more deeply than this service reads.",
            "",
            f"more than {max_depth} levels",
            f"at most {max_depth}; no request needs as many",
        )
    )


def _refuse_repeated_key(body: bytes) -> None:
    """Raise the error `repeated_key` if an object of the text has a key twice."""
    repetition = find_repeated_key(body)
    if repetition is None:
        return
    offset, key = repetition
    # Beyond `MAX_PREFIX` the search for the pointer would take too long.
    raise InvalidRequest(
        Issue(
            "repeated_key",
            "An object has this key more than once.",
            find_pointer(body, offset) + pointer([shorten(key)]) if offset <= MAX_PREFIX else "",
            "the key again",
            "each key once",
        )
    )


def _refusal(error: orjson.JSONDecodeError, body: bytes, skipped: int) -> Exception:
    """The error for a text that the parser refused, of which `skipped` bytes were not parsed."""
    if issue := _not_utf8(body, skipped):
        return MalformedJson(issue)
    # `error.pos` counts characters; `find_pointer` needs a number of bytes.
    where = ""
    if error.pos <= MAX_PREFIX:
        where = find_pointer(body, len(error.doc[: error.pos].encode()))
    # A sign before NaN or Infinity belongs to the number.
    start = error.pos - (error.doc[error.pos - 1 : error.pos] in ("-", "+"))
    if "infinity" in error.msg or _NOT_FINITE.match(error.doc, start):
        return InvalidRequest(
            Issue(
                "not_finite",
                f"Every number must be finite (line {error.lineno}, column {error.colno}).",
                where,
                "NaN, Infinity or a number beyond double precision",
                "a finite number",
            )
        )
    return MalformedJson(
        Issue(
            "malformed_json",
            f"The text is not JSON at line {error.lineno}, column {error.colno}.",
            where,
            next(
                (words for part, words in _PARSER_ERRORS if part in error.msg),
                "a character that cannot stand here",
            ),
            _NEEDED,
        )
    )


def _not_utf8(body: bytes, skipped: int) -> Issue | None:
    """The issue for a text that is not in UTF-8, or looks like UTF-16 or UTF-32; else None."""
    if _UTF_16_OR_32.match(body):
        return Issue("malformed_json", "The text is not in UTF-8.", "", "UTF-16 or UTF-32", _NEEDED)
    try:
        body.decode()
    except UnicodeDecodeError as error:
        return Issue(
            "malformed_json",
            f"The text is not in UTF-8 (byte {skipped + error.start + 1}).",
            "",
            "bytes that are not UTF-8",
            _NEEDED,
        )
    return None
