"""Searches a JSON text for facts that the parser does not return: positions, repeated keys, depth.

The functions look only at strings, brackets, colons and commas. They run only for texts that the
parser refused, or that may have repeated keys or too many levels.
"""

import re

import orjson

from service.errors import pointer

MAX_PREFIX = 1 << 19
"""The most bytes that `find_pointer` reads, which takes at most 0.1 s."""

MAX_KEY = 64
"""The most characters of a key in a pointer; all keys of the service are shorter."""

MAX_LEVELS = 32
"""The most levels of a pointer; valid documents have fewer."""

_STRING = rb'"[^"\\]*+(?:\\.[^"\\]*+)*+(?:"|\Z)'
"""A string with its quotes; if the text ends inside a string, this string up to the end."""

_BRACKET_OR_STRING = re.compile(_STRING + rb"|[][{}]", re.DOTALL)

_BRACE_OR_STRING = re.compile(rb"(" + _STRING + rb")(\s*:)?|[{}]", re.DOTALL)
"""A brace, or a string (group 1) and, if the string is a key, the colon after it (group 2)."""

_TO_SQUARE = bytes.maketrans(b"{}", b"[]")
_ALL_BUT_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))


class _Level:
    """An open bracket, with the index or key of the item that the scanner has reached in it."""

    __slots__ = ("expects_key", "is_object", "label")

    def __init__(self, is_object: bool) -> None:
        self.is_object = is_object
        self.expects_key = is_object
        self.label: int | bytes = b"" if is_object else 0

    def count_commas(self, count: int) -> None:
        """Move on by `count` commas, that is, by `count` items."""
        if isinstance(self.label, int):
            self.label += count
        elif count:
            self.expects_key = True


def find_pointer(body: bytes, end: int) -> str:
    """The JSON pointer of the value that begins at byte `end` of `body`, or contains this byte.

    The pointer is empty if `end` is above `MAX_PREFIX`.
    """
    if end > MAX_PREFIX:
        return ""
    prefix = bytes(body[:end])
    levels: list[_Level] = []
    position = 0
    for token in _BRACKET_OR_STRING.finditer(prefix):
        if levels:
            levels[-1].count_commas(prefix.count(b",", position, token.start()))
        position = token.end()
        first_byte = prefix[token.start()]
        if first_byte in b"[{":
            levels.append(_Level(first_byte == ord("{")))
        elif first_byte in b"]}":
            del levels[-1:]
        elif levels and levels[-1].expects_key:
            levels[-1].label = token.group()
            levels[-1].expects_key = False
    if levels:
        levels[-1].count_commas(prefix.count(b",", position))
    return pointer(
        level.label if isinstance(level.label, int) else shorten(decode_key(level.label))
        for level in levels[:MAX_LEVELS]
        if not level.expects_key
    )


def find_repeated_key(body: bytes) -> tuple[int, str] | None:
    """The byte offset and the text of the first repeated key: its object already has this key.

    None if no object has a key twice. RFC 8259, section 4, does not define the meaning of an object
    with equal keys; parsers silently keep one of them.
    """
    objects: list[set[str]] = []
    for token in _BRACE_OR_STRING.finditer(body):
        string, colon = token.groups()
        if string is None:
            if token.group() == b"{":
                objects.append(set())
            else:
                del objects[-1:]
        elif colon is not None and objects:
            key = decode_key(string)
            if key in objects[-1]:
                return token.start(), key
            objects[-1].add(key)
    return None


def decode_key(string: bytes) -> str:
    """The text of a JSON string, which is given with its quotes and escapes."""
    try:
        return str(orjson.loads(string))
    except orjson.JSONDecodeError:
        return string.decode(errors="replace").strip('"')


def shorten(key: str) -> str:
    """A key with at most `MAX_KEY` characters, and an ellipsis if it was shortened."""
    return key if len(key) <= MAX_KEY else key[:MAX_KEY] + "…"


def is_deeper(body: bytes, max_depth: int) -> bool:
    """Whether more than `max_depth` brackets are open at any position of a well-formed JSON text.

    First everything but brackets is removed from the text, and braces become square brackets. Then
    each `[]` is an innermost list or object, and removing all of these reduces the depth by one.
    """
    # Only strings contain escapes. After escaped quotes are removed, every second quote ends a
    # string, so of the segments between quotes the first, third, fifth … are outside of strings.
    unescaped = body.replace(b"\\\\", b"").replace(b'\\"', b"") if b"\\" in body else body
    brackets = b"".join(unescaped.split(b'"')[::2]).translate(_TO_SQUARE, _ALL_BUT_BRACKETS)
    for _ in range(max_depth):
        if not brackets:
            return False
        brackets = brackets.replace(b"[]", b"")
    return bool(brackets)
