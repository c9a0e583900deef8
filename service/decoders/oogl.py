"""Reads Bézier patches from OOGL files: BEZ and BBP objects, alone or in LISTs.

The decoder reads these objects as Geomview does: keywords with letters for texture coordinates and
colours, `BEZ p q d` with blanks, braces, `=`, names, appearances, comments. It skips lines (SKEL
and VECT), because the service writes overlays as lines with `oogl=bez`. It refuses all other
objects, with an error that names the line of the file.

References
----------
Geomview manual, "OOGL File Formats": Bezier surfaces; object references.
"""

import re
from itertools import islice

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import Tree, build_malformed_error, build_too_many_error, check_kind
from service.decoders.numbers import build_word_error, line_at, line_of_number, read_numbers
from service.decoders.oogl_patches import Form, Group, build_surface
from service.errors import InvalidRequest, Issue, count_nouns

KINDS = ("patches",)
"""The kinds of surface that a client may request. Requested or not, a file becomes `patches`, or a
`group` of several `patches`."""

MAX_DEPTH = 16
"""The most objects inside each other: braces, lists and the innermost object all count."""

MAX_PREFIXES = 16
"""The most signs `=`, definitions and appearances before an object, together."""

FREE_COMMENTS = 1000
"""A file may have one sign `#` for each allowed control point, and this number more: to remove a
comment takes up to 180 bytes of memory."""

FREE_OBJECTS = 1000
"""A file may have two objects for each allowed patch (the braces, and the object in them), and this
number more."""

MAX_BRACES = 1000
"""The most braces inside an appearance."""

STEP = 1 << 20
"""How many bytes are searched without a pause in which other threads can run."""

HIGHEST_DEGREE = 12
"""The highest degree that Geomview reads."""

_COMMENT = re.compile(rb"#[^\r\n]*")
_WORD = re.compile(rb"\s*+([{}=]|[^\s{}=]+)")
# Numbers and blanks. An "e" is part of a number only after a digit or a point.
_NUMBERS = re.compile(rb"[\s0-9.+-]*+(?:(?<=[0-9.])[eE][\s0-9.+-]*+)*+")
_BEZIER = re.compile(rb"(ST)?(C)?(?:BBP|BEZ(?:([1-9])([1-9])([34]))?)(_ST)?")
_DEGREES = re.compile(rb"\s++([1-9]|1[0-2])\s++([1-9]|1[0-2])\s++([34])(?=\s|[{}])")
_BRACE = re.compile(rb"[{}]")
_LINES = re.compile(rb"C?4?n?SKEL|4?VECT")


def decode(content: bytes, kind: str | None, max_points: int) -> Tree:
    """Decode the patches of an OOGL file; each patch has vertices of its own.

    Patches of one degree become one surface, `patches`. If degrees differ, or if only some patches
    have colours or texture coordinates, the file becomes a `group` of several such surfaces.

    Raises
    ------
    MalformedBody
        The text is not an OOGL file, or has other objects.
    InvalidRequest
        A number is not finite, a weight of a corner is not positive, or the file has more than
        `max_points` control points.
    """
    check_kind(kind, KINDS)
    if not content.isascii() or b"\0" in content:
        raise build_malformed_error(
            "The service reads OOGL as text, not in its binary form.", "other bytes", "ASCII"
        )
    hash_signs = content.count(b"#")
    if hash_signs > max_points + FREE_COMMENTS:
        raise build_too_many_error("more comments", max_points)
    reader = _Reader(_COMMENT.sub(b"", content) if hash_signs else content, max_points)
    reader.read()
    surfaces = list(map(build_surface, reader.groups.values()))
    if len(surfaces) == 1:
        return surfaces[0]
    return {"type": "group", "members": [{"surface": surface} for surface in surfaces]}


class _Reader:
    """Reads the objects of a text, one after another, and collects their patches."""

    def __init__(self, text: bytes, max_points: int) -> None:
        self._text = text
        self._max_points = max_points
        self._position = 0
        self._points_left = max_points
        self._objects = 0
        self.groups: dict[tuple[tuple[int, int], bool, bool], Group] = {}

    def read(self) -> None:
        """Read the one object of which a file consists."""
        self._read_object(0)
        if word := self._next_word():
            raise self._build_error(
                "The file goes on after its object.", word, "one object, or LIST"
            )
        if self._points_left == self._max_points:
            raise self._build_error("The file has no patch.", b"", "BEZ or BBP")

    def _read_object(self, depth: int) -> None:
        """Read an object, with or without braces, that is inside `depth` other objects."""
        self._count_object()
        word = self._next_word()
        for _ in range(MAX_PREFIXES):
            if word not in (b"=", b"define", b"appearance"):
                break
            if word == b"define":
                self._next_word()
            elif word == b"appearance":
                self._skip_braces()
            word = self._next_word()
        if depth == MAX_DEPTH:
            raise self._build_error("Objects are nested too deeply.", word, f"{MAX_DEPTH} levels")
        if word == b"{":
            self._read_object(depth + 1)
            if (end_word := self._next_word()) != b"}":
                raise self._build_error("An object does not end here.", end_word, "}")
        elif word == b"LIST":
            while self._peek_word() not in (b"", b"}"):
                self._read_object(depth + 1)
        elif form := _BEZIER.fullmatch(word):
            self._read_patches(self._read_form(form))
        elif _LINES.fullmatch(word):
            self._position = self._end_of_numbers()
        else:
            raise self._build_error("No patches begin here.", word, "BEZ, BBP, or LIST of such")

    def _count_object(self) -> None:
        """Count an object, and refuse more objects than the control points could need.

        A patch has at least 4 control points, and up to two objects: its braces and itself.
        """
        self._objects += 1
        if self._objects > self._max_points // 2 + FREE_OBJECTS:
            raise build_too_many_error("more objects", self._max_points)

    def _read_form(self, header: re.Match[bytes]) -> Form:
        """The form of an object, from its keyword and from the degrees after the keyword."""
        texture, color, *digits, texture_suffix = header.groups()
        if self._peek_word() == b"BINARY":
            raise self._build_error(
                "The service reads OOGL as text.", self._next_word(), "numbers as text"
            )
        if b"BBP" in header[0]:
            digits = [b"3", b"3", b"3"]
        elif digits[0] is None:
            degrees = _DEGREES.match(self._text, self._position)
            if degrees is None:
                raise self._build_error(
                    "The degrees of the patches are missing.",
                    self._next_word(),
                    f"BEZ p q d, degrees 1 to {HIGHEST_DEGREE}, d 3 or 4",
                )
            digits = list(degrees.groups())
            self._position = degrees.end()
        p, q, dimension = map(int, digits)
        return Form((p, q), dimension, bool(texture or texture_suffix), bool(color))

    def _read_patches(self, form: Form) -> None:
        """Read the patches after a keyword, up to the end of the object."""
        start, end = self._position, self._end_of_numbers()
        max_numbers = self._points_left // form.point_count * form.number_count
        values = read_numbers(
            self._text,
            start,
            end,
            max_numbers,
            lambda: build_too_many_error("more control points", self._max_points),
        )
        self._position = end
        if not len(values) or len(values) % form.number_count:
            # The numbers end at a word that is no number, unless an object may end or begin here.
            if self._text[end : end + 1] not in (b"", b"{", b"}", b"="):
                raise build_word_error(self._text, end)
            line = line_at(self._text, start)
            raise build_malformed_error(
                f"The numbers after the keyword make no whole patches (line {line}).",
                count_nouns(len(values), "numbers"),
                f"{form.number_count} for each patch",
            )
        numbers = values.reshape(-1, form.number_count)
        self._check_weights(form, numbers, start)
        self._points_left -= len(numbers) * form.point_count
        key = form.degree, form.has_uvs, form.has_colors
        self.groups.setdefault(key, []).append((form, numbers))

    def _check_weights(self, form: Form, numbers: FloatArray, start: int) -> None:
        """Refuse corners whose weight is not positive; the numbers begin at `text[start]`."""
        weight_columns = form.corner_weights()
        is_wrong = numbers[:, weight_columns] <= 0
        if not is_wrong.any():
            return
        patch, point = np.argwhere(is_wrong)[0].tolist()
        index = patch * form.number_count + weight_columns[point]
        line = line_of_number(self._text, start, index)
        raise InvalidRequest(
            Issue(
                "weight_not_positive",
                "The weight of a corner must be above zero: the last of four numbers (line "
                f"{line}).",
                "",
                "zero or less",
                "a positive number",
            )
        )

    def _next_word(self) -> bytes:
        """Read the next word and move behind it; the word is empty at the end of the text."""
        match = _WORD.match(self._text, self._position)
        if match is None:
            return b""
        self._position = match.end()
        return match[1]

    def _peek_word(self) -> bytes:
        """The next word, without moving behind it."""
        match = _WORD.match(self._text, self._position)
        return match[1] if match else b""

    def _end_of_numbers(self) -> int:
        """The index of the first byte from here on that cannot be part of a list of numbers."""
        position = self._position
        # In steps, so that other threads can run in between.
        while match := _NUMBERS.match(self._text, position, position + STEP):
            if match.end() < position + STEP:
                return match.end()
            position = match.end()
        return position

    def _skip_braces(self) -> None:
        """Skip a pair of braces and everything between them."""
        if (word := self._next_word()) != b"{":
            raise self._build_error("An appearance must be in braces.", word, "{")
        depth = 1
        for brace in islice(_BRACE.finditer(self._text, self._position), MAX_BRACES):
            depth += 1 if brace[0] == b"{" else -1
            if not depth:
                self._position = brace.end()
                return
        # The position is still behind the first brace, so the error names the line of this brace.
        raise self._build_error("A pair of braces does not end.", word, "}")

    def _build_error(self, message: str, word: bytes, needed: str) -> Exception:
        """The error for an unexpected word, which was read last; b"" for the end of the text.

        `message` ends with a full stop; the number of the line is inserted before it.
        """
        line = line_at(self._text, self._position if word else len(self._text))
        return build_malformed_error(
            f"{message[:-1]} (line {line}).",
            "another word" if word else "the end of the text",
            needed,
        )
