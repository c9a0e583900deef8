"""Parses a JSON text, with checks that parsers leave out.

`orjson` refuses NaN, Infinity, 1e400, lone surrogates and text that is not UTF-8. Of two equal keys
it silently keeps the last; this module refuses them. A short text can become many objects in
memory, so a `DocumentBudget` counts values while the text is still arriving.
"""

import re
from dataclasses import dataclass, field

import orjson

from service.errors import InvalidRequest, Issue, MalformedJson, pointer
from service.schemas.scan import MAX_PREFIX, find_pointer, find_repeated_key, is_deeper, shorten
from service.surface.checks import MAX_DEGREE

MAX_BYTES = 16 << 20
"""Bytes of a JSON text that arrives in a request, by default."""

MAX_VALUES = 1_500_000
"""Commas and opening brackets of such a text: a surface of some 370,000 control points."""

MAX_STRINGS = 50_000
"""Strings of such a text, keys included, and objects; a request has some twenty strings, and two
for each named part. Each string costs 1 µs while a repeated key is searched."""

MAX_DEPTH, PARSED_DEPTH = 32, 1024
"""Brackets that may be open at once; requests need some ten. The parser has a bound of its own, for
texts of any kind."""

BYTES_PER_VALUE, BYTES_PER_STRING, BYTES_PER_OBJECT = 100, 800, 1500
"""Bytes of memory: of a value as a Python object and while it becomes part of an array; of a
string, or of the error for an unknown key; of an object and the model made from it."""

_WIDE = re.compile(rb"\xff\xfe|\xfe\xff|[^\0]\0|\0{1,3}[^\0]")
"""How UTF-16 and UTF-32 begin: with a byte order mark, or with a zero around the first letter."""

_NEEDED = "one JSON document in UTF-8 (RFC 8259)"

_FOUND = (
    ("byte order mark", "a byte order mark"),
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
"""Texts for the parser's errors, by a part of its message. Clients get these texts, which stay
the same if the parser changes its own."""

_INDENTED = re.compile(rb"\A([ \t\r\n]*[\[{])([ \t\r\n]+)")

_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class DocumentLimits:
    """The limits of one document, independent of the memory of the machine.

    `max_values` bounds JSON that arrives over HTTP; stored surfaces and files have no such bound.
    """

    max_control_points: int = 1_000_000
    max_degree: int = MAX_DEGREE
    max_depth: int = MAX_DEPTH
    max_values: int = MAX_VALUES


DEFAULT_LIMITS = DocumentLimits()


@dataclass(slots=True)
class DocumentBudget:
    """Counts the values in a JSON text, to refuse a harmful text while it arrives."""

    limits: DocumentLimits = field(default_factory=DocumentLimits)
    received: int = 0
    values: int = 0
    objects: int = 0
    quotes: int = 0

    def take(self, chunk: bytes) -> None:
        """Counts the next chunk of the text.

        Raises
        ------
        InvalidRequest
            `too_many_values` or `too_many_strings`.
        """
        self.received += len(chunk)
        objects = chunk.count(b"{")
        self.objects += objects
        self.values += chunk.count(b",") + chunk.count(b"[") + objects
        self.quotes += chunk.count(b'"')
        if self.values > self.limits.max_values:
            message = (
                "The document has more values than this service reads as JSON. A larger net can be "
                "sent as a .npy file."
            )
            most = self.limits.max_values
            got, needed = f"more than {most} commas and brackets", f"at most {most}, or a .npy file"
            raise InvalidRequest(Issue("too_many_values", message, "", got, needed))
        if max(self.quotes // 2, self.objects) > MAX_STRINGS:
            message = "The document has more strings or objects than any request needs."
            got = f"more than {MAX_STRINGS} strings or objects"
            needed = f"at most {MAX_STRINGS} of each, keys included"
            raise InvalidRequest(Issue("too_many_strings", message, "", got, needed))

    @property
    def memory(self) -> int:
        """The most bytes of the text so far, and of its objects until these become arrays."""
        parsed = BYTES_PER_VALUE * (self.values + 1) + BYTES_PER_OBJECT * self.objects
        return 3 * self.received + BYTES_PER_STRING * (self.quotes // 2) + parsed


def parse_document(body: bytes, max_depth: int = MAX_DEPTH) -> object:
    """The value of a JSON text, made of dict, list, str, int, float, bool and None.

    RFC 8259, section 9, allows a parser to limit the nesting of brackets.

    Raises
    ------
    MalformedJson
        If the text is not one JSON document (RFC 8259) in UTF-8.
    InvalidRequest
        `not_finite` for NaN, Infinity and numbers beyond float64; `repeated_key`; `too_deep`.
    """
    try:
        value = _parse(body)
    except orjson.JSONDecodeError as error:
        # Only the message and the position go on: the exception holds the whole text.
        if "depth" in error.msg:
            raise _too_deep(max_depth) from None
        raise _refusal(error, body) from None
    if body.count(b"[") + body.count(b"{") > max_depth and is_deeper(body, max_depth):
        raise _too_deep(max_depth)
    # There is one colon for each key, unless a key is repeated, a string holds a colon, or an
    # object stands in a list of other values, which is invalid: only then is the text scanned.
    if body.count(b":") != _count_keys(value):
        _refuse_repeated_key(body)
    return value


def _parse(text: bytes) -> object:
    """The value that orjson makes of a text.

    If two blanks follow the first bracket of a text, orjson 3.11.0 to 3.13.0 expect the whole text
    to be indented, and fail for lack of memory if it is not. So these blanks are moved before the
    bracket, which keeps the positions of errors.
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
    """Keys of all objects that are reached through objects and lists that begin with one."""
    count, waiting = 0, [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict):
            count += len(item)
            waiting += [child for child in item.values() if type(child) in (dict, list)]
        elif isinstance(item, list) and item and type(item[0]) is dict:
            waiting += [child for child in item if child and type(child) is dict]
    return count


def _too_deep(most: int) -> InvalidRequest:
    message = "The brackets of the document are nested more deeply than this service reads."
    got, needed = f"more than {most} levels", f"at most {most}; no request needs as many"
    return InvalidRequest(Issue("too_deep", message, "", got, needed))


def _refuse_repeated_key(body: bytes) -> None:
    repeated = find_repeated_key(body)
    if repeated is None:
        return
    offset, key = repeated
    where = find_pointer(body, offset) + pointer([shorten(key)]) if offset <= MAX_PREFIX else ""
    message = "An object has this key more than once."
    raise InvalidRequest(Issue("repeated_key", message, where, "the key again", "each key once"))


def _refusal(error: orjson.JSONDecodeError, body: bytes) -> Exception:
    """The error for a text that the parser refused."""
    if issue := _not_utf8(body):
        return MalformedJson(issue)
    # The position counts characters.
    where = ""
    if error.pos <= MAX_PREFIX:
        where = find_pointer(body, len(error.doc[: error.pos].encode()))
    start = error.pos - (error.doc[error.pos - 1 : error.pos] in ("-", "+"))
    if "infinity" in error.msg or _NOT_FINITE.match(error.doc, start):
        message = f"Every number must be finite (line {error.lineno}, column {error.colno})."
        got = "NaN, Infinity or a number beyond double precision"
        return InvalidRequest(Issue("not_finite", message, where, got, "a finite number"))
    message = f"The text is not JSON at line {error.lineno}, column {error.colno}."
    fitting = (words for part, words in _FOUND if part in error.msg)
    got = next(fitting, "a character that cannot stand here")
    return MalformedJson(Issue("malformed_json", message, where, got, _NEEDED))


def _not_utf8(body: bytes) -> Issue | None:
    """The issue of bytes that are not UTF-8, or that begin like UTF-16 or UTF-32; else None."""
    if _WIDE.match(body):
        return Issue("malformed_json", "The text is not in UTF-8.", "", "UTF-16 or UTF-32", _NEEDED)
    try:
        body.decode()
    except UnicodeDecodeError as error:
        message = f"The text is not in UTF-8 (byte {error.start + 1})."
        return Issue("malformed_json", message, "", "bytes that are not UTF-8", _NEEDED)
    return None
