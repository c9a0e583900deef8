"""Bézier patches from OOGL files: BEZ and BBP objects, alone or in LISTs.

What is read is what Geomview reads of such objects: keywords with the letters of texture
coordinates and colours, `BEZ p q d` with blanks, braces, `=`, names, appearances, comments. Lines
(SKEL, VECT), which the exact form has beside the patches when overlays are asked for, are passed
over: they are no surface. Any other object is refused, with its line.

References
----------
Geomview manual, "OOGL File Formats": Bezier surfaces; object references.
"""

import re
from itertools import islice

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import Tree, check_kind, malformed, too_many
from service.decoders.numbers import line_at, line_of_number, read_numbers, refused_word
from service.decoders.oogl_patches import Form, Patches
from service.errors import InvalidRequest, Issue

KINDS = ("patches",)

MAX_DEPTH = 16
"""Braces and lists within each other."""

FREE_COMMENTS = 1000
"""Comments beside one for each control point that is allowed."""

FREE_OBJECTS = 1000
"""Objects beside two for each patch that is allowed: that in the braces, and the braces."""

MAX_BRACES = 1000
"""Braces of an appearance."""

STEP = 1 << 20
"""Bytes that are looked through at a time."""

HIGHEST_DEGREE = 12
"""What Geomview reads."""

_COMMENT = re.compile(rb"#[^\r\n]*")
_WORD = re.compile(rb"\s*+([{}=]|[^\s{}=]+)")
_NUMBERS = re.compile(rb"[\s0-9.+-]*+(?:(?<=[0-9.])[eE][\s0-9.+-]*+)*+")
_BEZIER = re.compile(rb"(ST)?(C)?(?:BBP|BEZ(?:([1-9])([1-9])([34]))?)(_ST)?")
_DEGREES = re.compile(rb"\s++([1-9]|1[0-2])\s++([1-9]|1[0-2])\s++([34])(?=\s|[{}])")
_BRACE = re.compile(rb"[{}]")
_LINES = re.compile(rb"C?4?n?SKEL|4?VECT")


def decode(content: bytes, kind: str | None, most: int) -> Tree:
    """The patches in an OOGL file, each with vertices of its own.

    Patches of one degree are one surface, `patches`; where there are several degrees, or where
    some patches have colours or texture coordinates and some have none, a `group` of such.

    Raises
    ------
    MalformedBody
        If this is no OOGL file, or one of other objects.
    InvalidRequest
        If a number is not finite, a weight not positive, or there are more than `most` control
        points.
    """
    check_kind(kind, KINDS)
    _check_text(content)
    comments = content.count(b"#")
    if comments > most + FREE_COMMENTS:
        raise too_many("more comments than that", most)
    reader = _Reader(_COMMENT.sub(b"", content) if comments else content, most)
    reader.read()
    surfaces = list(reader.patches.surfaces())
    if len(surfaces) == 1:
        return surfaces[0]
    return {"type": "group", "members": [{"surface": surface} for surface in surfaces]}


def _check_text(content: bytes) -> None:
    if not content.isascii() or b"\0" in content:
        raise malformed(
            "OOGL is read as text, not in its binary form.", "other bytes than ASCII", "ASCII"
        )


class _Reader:
    """The objects of a text, one after another."""

    def __init__(self, text: bytes, most: int) -> None:
        self._text = text
        self._most = most
        self._place = 0
        self._left = most
        self._objects = 0
        self.patches = Patches()

    def read(self) -> None:
        """Reads the one object that a file is."""
        self._object(0)
        if word := self._next():
            raise self._refusal("The file goes on behind its object.", word, "one object, or LIST")
        if self._left == self._most:
            raise self._refusal("The file has no patch.", b"", "BEZ or BBP")

    def _object(self, depth: int) -> None:
        """An object, in braces or not."""
        self._count()
        word = self._next()
        for _ in range(MAX_DEPTH):
            if word not in (b"=", b"define", b"appearance"):
                break
            if word == b"define":
                self._next()
            elif word == b"appearance":
                self._skip_braces()
            word = self._next()
        if depth == MAX_DEPTH:
            raise self._refusal("Objects are nested too deeply.", word, f"{MAX_DEPTH} levels")
        if word == b"{":
            self._object(depth + 1)
            if (end := self._next()) != b"}":
                raise self._refusal("An object does not end here.", end, "}")
        elif word == b"LIST":
            while self._peek() not in (b"", b"}"):
                self._object(depth + 1)
        elif form := _BEZIER.fullmatch(word):
            self._patches(self._form(form))
        elif _LINES.fullmatch(word):
            self._place = self._end_of_numbers()
        else:
            raise self._refusal("No patches begin here.", word, "BEZ, BBP, or LIST of such")

    def _count(self) -> None:
        """Counts an object; patches have four control points and more."""
        self._objects += 1
        if self._objects > self._most // 2 + FREE_OBJECTS:
            raise too_many("more objects than these have", self._most)

    def _form(self, found: re.Match[bytes]) -> Form:
        """What a keyword announces, with the degrees behind it where they are not in it."""
        texture, color, *digits, texture_behind = found.groups()
        if self._peek() == b"BINARY":
            raise self._refusal("OOGL is read as text, not in its binary form.", b"?", "numbers")
        if b"BBP" in found[0]:
            digits = [b"3", b"3", b"3"]
        elif digits[0] is None:
            behind = _DEGREES.match(self._text, self._place)
            if behind is None:
                needed = f"BEZ p q d, degrees 1 to {HIGHEST_DEGREE}, d 3 or 4"
                raise self._refusal("The degrees of the patches are missing.", b"?", needed)
            digits = list(behind.groups())
            self._place = behind.end()
        p, q, dimension = map(int, digits)
        return Form((p, q), dimension, bool(texture or texture_behind), bool(color))

    def _patches(self, form: Form) -> None:
        """The patches behind a keyword, up to the end of the object."""
        start, end = self._place, self._end_of_numbers()
        most = self._left // form.points * form.numbers
        values = read_numbers(
            self._text, start, end, most, lambda: too_many("more of them", self._most)
        )
        self._place = end
        if not len(values) or len(values) % form.numbers:
            if self._text[end : end + 1] not in (b"", b"{", b"}", b"="):
                raise refused_word(self._text, end)
            where = line_at(self._text, start)
            raise malformed(
                f"The numbers behind the keyword make no whole patches (line {where}).",
                f"{len(values)} numbers",
                f"{form.numbers} for each patch",
            )
        numbers = values.reshape(-1, form.numbers)
        self._check_weights(form, numbers, start)
        self._left -= len(numbers) * form.points
        self.patches.add(form, numbers)

    def _check_weights(self, form: Form, numbers: FloatArray, start: int) -> None:
        """Refuses weights of zero and less, among patches that begin behind a place."""
        columns = form.weight_numbers()
        wrong = numbers[:, columns] <= 0
        if not wrong.any():
            return
        patch, weight = np.argwhere(wrong)[0].tolist()
        line = line_of_number(self._text, start, patch * form.numbers + columns[weight])
        raise InvalidRequest(
            Issue(
                "weight_not_positive",
                f"A weight must be above zero: the last of four numbers (line {line}).",
                "",
                "zero or less",
                "a positive number",
            )
        )

    def _next(self) -> bytes:
        """The next word, which is left behind; empty at the end of the text."""
        found = _WORD.match(self._text, self._place)
        if found is None:
            return b""
        self._place = found.end()
        return found[1]

    def _peek(self) -> bytes:
        """The next word."""
        found = _WORD.match(self._text, self._place)
        return found[1] if found else b""

    def _end_of_numbers(self) -> int:
        """Where something stands that is part of no number."""
        place = self._place
        # Step by step, so that other threads have their turn.
        while found := _NUMBERS.match(self._text, place, place + STEP):
            if found.end() < place + STEP:
                return found.end()
            place = found.end()
        return place

    def _skip_braces(self) -> None:
        """Leaves behind what stands in a pair of braces, and the braces."""
        if (word := self._next()) != b"{":
            raise self._refusal("An appearance stands in braces.", word, "{")
        depth = 1
        for brace in islice(_BRACE.finditer(self._text, self._place), MAX_BRACES):
            depth += 1 if brace[0] == b"{" else -1
            if not depth:
                self._place = brace.end()
                return
        raise self._refusal("A pair of braces does not end.", word, "}")

    def _refusal(self, message: str, word: bytes, needed: str) -> Exception:
        line = line_at(self._text, self._place if word else len(self._text))
        got = "another word" if word else "the end of the text"
        return malformed(f"{message[:-1]} (line {line}).", got, needed)
