"""Bytes to one JSON document, with a sharp eye for what parsers let pass.

`orjson` refuses NaN, Infinity, 1e400, lone surrogates and text that is not UTF-8.
It keeps the last of two equal keys without a word; here that is an error. And because a short
text can mean many objects in memory, a `Budget` counts them while the text is still arriving.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import orjson

from service.errors import InvalidRequest, Issue, MalformedJson, pointer
from service.schemas.numbers import Listed
from service.schemas.pieces import is_long, loads
from service.schemas.scan import MAX_PREFIX, is_deeper, pointer_at, repeated_key, shortened
from service.surface.checks import MAX_DEGREE

MAX_STRINGS = 50_000
"""Strings in a document, keys included; a request has some twenty, and two a named part."""

MAX_DEPTH, PARSED_DEPTH = 32, 1024
"""Brackets that may be open at once; what is asked for has some ten. The parser has its own bound,
for texts of any kind."""

BYTES_PER_VALUE = 256
"""Bytes that a number may take with its indentation; all its digits need 25."""

PARSED = 16
"""Bytes that the parser needs for a value while it reads, beside a copy of the text."""

PLACE, NUMBER, LIST, OBJECT, STRING = 8, 24, 80, 1500, 100
"""Bytes of what a text becomes: the place of a value in a list; a number; a list; an object and
what is made of it; a string."""

ARRAYS = 32
"""Bytes for each number while lists become arrays, and these are checked."""

FREE_BYTES = 1 << 20
FREE_VALUES = 1000
"""What every document may have, however little it asks for."""

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
"""What a refusal of the parser means, by a part of its message. Clients get these words, which
stay the same when the parser finds others."""

_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE)


Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class DocumentLimits:
    """What one document may ask for, whatever the memory of the machine."""

    max_control_points: int = 1_000_000
    max_degree: int = MAX_DEGREE
    max_depth: int = MAX_DEPTH


@dataclass(slots=True)
class Budget:
    """Counts what a text will become, so that a bomb is refused before it is whole.

    A surface of n control points is written with at most n points of three coordinates, n
    weights and n indices, hence fewer than 6 n commas and 2 n opening brackets. Colours and the
    like share this: a surface that carries them has fewer points than the very largest. Each of
    `queries` parameters beside it, with its patch's number, has 4 commas and a bracket at most.
    """

    limits: DocumentLimits = field(default_factory=DocumentLimits)
    queries: int = 0
    received: int = 0
    commas: int = 0
    brackets: int = 0
    braces: int = 0
    quotes: int = 0

    def take(self, chunk: bytes) -> None:
        """Counts the next piece of the text.

        Raises
        ------
        InvalidRequest
            `too_many_values`, `too_many_strings` or `too_sparse`.
        """
        self.received += len(chunk)
        self.commas += chunk.count(b",")
        braces = chunk.count(b"{")
        self.braces += braces
        self.brackets += chunk.count(b"[") + braces
        self.quotes += chunk.count(b'"')
        points = self.limits.max_control_points
        commas = 6 * points + 4 * self.queries + FREE_VALUES
        brackets = 2 * points + self.queries + FREE_VALUES
        if self.commas > commas or self.brackets > brackets:
            raise InvalidRequest(
                Issue(
                    "too_many_values",
                    "The document has more values than the largest surface allowed.",
                    got=f"more than {self.commas + self.brackets - 1} values",
                    needed=self._needed(),
                )
            )
        if self.quotes > 2 * MAX_STRINGS:
            raise InvalidRequest(
                Issue(
                    "too_many_strings",
                    "The document has more strings than any request needs.",
                    got=f"more than {MAX_STRINGS} strings",
                    needed=f"at most {MAX_STRINGS}, keys included",
                )
            )
        if self.received > FREE_BYTES + BYTES_PER_VALUE * (self.commas + self.brackets):
            raise InvalidRequest(
                Issue(
                    "too_sparse",
                    "The document has very many bytes for the few values in it.",
                    got=f"{self.commas + self.brackets} values in {self.received} bytes",
                    needed=f"at most {BYTES_PER_VALUE} bytes a value beyond the first MiB",
                )
            )

    @property
    def memory(self) -> int:
        """Bytes that the text so far takes at most until it has become a surface, its own too."""
        # Before each value but the first of its list stands a comma, before each list a bracket.
        numbers, lists = self.commas + 1, self.brackets - self.braces
        values = numbers + self.brackets
        made = PLACE * values + NUMBER * numbers + LIST * lists
        made += OBJECT * self.braces + STRING * self.quotes // 2
        # First the parser has a copy of the text, then lists become arrays.
        beside = max(self.received + PARSED * values, ARRAYS * numbers)
        return self.received + made + beside

    def _needed(self) -> str:
        needed = (
            f"a surface of at most {self.limits.max_control_points} control points, fewer if it "
            "carries colours, texture coordinates or attributes"
        )
        return needed + (f" and at most {self.queries} points to query" if self.queries else "")


def understood(
    body: bytes, understand: Callable[[object], Result], max_depth: int = MAX_DEPTH
) -> Result:
    """What `understand` makes of the value of a JSON text; raises what that or `parse_document` do.

    Of a long text it is shown arrays of numbers, and lists only where it refuses those for a type:
    all numbers of an array have one, and lists tell which of them has another. What is refused for
    its lengths has the same everywhere, so it is refused at the first place alone.
    """
    document = parse_document(body, max_depth, arrays=is_long(body))
    try:
        return understand(document)
    except InvalidRequest as error:
        if all(issue.code != "wrong_type" for issue in error.issues) or not _has_arrays(document):
            raise
    del document
    return understand(parse_document(body, max_depth))


def parse_document(body: bytes, max_depth: int = MAX_DEPTH, *, arrays: bool = False) -> object:
    """The value of a JSON text, made of dict, list, str, int, float, bool and None.

    With `arrays`, also of arrays of float64 and int64 in the place of long lists of numbers.
    RFC 8259, section 9, leaves it to a parser how deeply it lets brackets be nested.

    Raises
    ------
    MalformedJson
        If the text is not one JSON document (RFC 8259) in UTF-8.
    InvalidRequest
        `not_finite` for NaN, Infinity and numbers beyond float64; `repeated_key`; `too_deep`.
    """
    try:
        value = loads(body, arrays=arrays)
    except orjson.JSONDecodeError as error:
        # Only the message and the position go on: the exception holds the whole text.
        if "depth" in error.msg:
            raise _too_deep(max_depth) from None
        raise _refusal(error, body) from None
    if is_deeper(body, max_depth):
        raise _too_deep(max_depth)
    # Colons are as many as keys, unless a key is repeated, a string holds one, or an object
    # hides in a list of other things, where nothing is valid: only then is the text scanned.
    if body.count(b":") != _count_keys(value):
        _refuse_repeated_key(body)
    return value


def _count_keys(value: object) -> int:
    """Keys of all objects that are reached."""
    return sum(map(len, _objects(value)))


def _has_arrays(value: object) -> bool:
    """Whether there is an array of numbers in one of the objects that are reached."""
    return any(Listed in map(type, item.values()) for item in _objects(value))


def _objects(value: object) -> Iterator[dict[str, object]]:
    """All objects that are reached through objects and lists that begin with one."""
    waiting = [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict):
            yield item
            waiting.extend(child for child in item.values() if type(child) in (dict, list))
        elif isinstance(item, list) and item and type(item[0]) is dict:
            waiting.extend(item)


def _too_deep(most: int) -> InvalidRequest:
    return InvalidRequest(
        Issue(
            "too_deep",
            "The brackets of the document are nested more deeply than this service reads.",
            got=f"more than {most} levels",
            needed=f"at most {most}; no request needs as many",
        )
    )


def _refuse_repeated_key(body: bytes) -> None:
    found = repeated_key(body)
    if found is None:
        return
    offset, key = found
    where = pointer_at(body, offset) + pointer([shortened(key)]) if offset <= MAX_PREFIX else ""
    raise InvalidRequest(
        Issue(
            "repeated_key",
            "An object has this key more than once.",
            where,
            "the key again",
            "each key once",
        )
    )


def _refusal(error: orjson.JSONDecodeError, body: bytes) -> Exception:
    """What to raise for text that the parser refused."""
    if issue := _not_utf8(body):
        return MalformedJson(issue)
    # The position counts characters.
    where = ""
    if error.pos <= MAX_PREFIX:
        where = pointer_at(body, len(error.doc[: error.pos].encode()))
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
            _found(error.msg),
            _NEEDED,
        )
    )


def _not_utf8(body: bytes) -> Issue | None:
    """The issue of bytes that are no UTF-8, or that begin like UTF-16 or UTF-32; else None."""
    if _WIDE.match(body):
        return Issue("malformed_json", "The text is not in UTF-8.", "", "UTF-16 or UTF-32", _NEEDED)
    try:
        body.decode()
    except UnicodeDecodeError as error:
        message = f"The text is not in UTF-8 (byte {error.start + 1})."
        return Issue("malformed_json", message, "", "bytes that are no UTF-8", _NEEDED)
    return None


def _found(message: str) -> str:
    """Our words for the parser's."""
    fitting = (words for part, words in _FOUND if part in message)
    return next(fitting, "a character that cannot stand here")
