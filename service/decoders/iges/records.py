"""The parameters of an entity: from its text to words, and from words to values.

A word that is left out has its default. A string is written with the number of its characters,
`4Htext` (Hollerith), and may contain delimiters. Numbers may have the exponent letter D of Fortran.

References
----------
IGES 5.3, sections 2.2.2 and 2.2.3: data types, and rules for free formatted data.
"""

import math
import re

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.iges.faults import Fault

MAX_NUMBER = 1e12
"""The largest coordinate; larger numbers are damage."""

MAX_TEXT = 1000
"""The most characters of a text that are kept."""

_STRING = re.compile(r" *(\d{1,8})H")
_EXPONENT = str.maketrans("Dd", "EE")


def split_words(text: str, delimiters: tuple[str, str]) -> list[str]:
    """The words of a record, without the blanks around them; strings without their counts.

    Parameters
    ----------
    text : str
    delimiters : tuple of two str
        The sign between parameters and the sign at the end of a record, such as ("," and ";").
    """
    between, end = delimiters
    if "H" not in text:
        return [word.strip() for word in text.split(end, 1)[0].split(between)]
    words: list[str] = []
    find_delimiter = re.compile(f"[{re.escape(between + end)}]").search
    position, length = 0, len(text)
    while True:
        string = _STRING.match(text, position)
        first = position
        if string:
            first = string.end()
            position = min(first + int(string[1]), length)
        delimiter = find_delimiter(text, position)
        stop = delimiter.start() if delimiter else length
        if string and text[first:position].isascii():
            stop = position
        # Some systems count characters beyond ASCII as one, though they have several bytes; so a
        # string with such characters ends at the next delimiter.
        words.append(text[first:stop].strip())
        if delimiter is None or delimiter[0] == end:
            return words
        position = delimiter.end()


class Parameters:
    """The words of one entity, the number of its type left out, by position from 0."""

    __slots__ = ("_words",)

    def __init__(self, words: list[str]) -> None:
        self._words = words

    def __len__(self) -> int:
        return len(self._words)

    def word(self, position: int) -> str:
        """A word; empty if it is left out."""
        return self._words[position] if 0 <= position < len(self._words) else ""

    def integer(self, position: int, default: int | None = None) -> int:
        """A whole number.

        Raises
        ------
        Fault
            The word is no whole number, or is left out and has no default.
        """
        word = self.word(position)
        if not word:
            if default is None:
                raise Fault("a parameter is missing")
            return default
        try:
            return int(word[:20])
        except ValueError:
            number = _read_number(word)
        if number != int(number):
            raise Fault("a parameter is not a whole number")
        return int(number)

    def count(self, position: int, size: int = 1) -> int:
        """A number of items with `size` words each; there are at least as many words."""
        count = self.integer(position, 0)
        if not 0 <= count * size <= len(self._words):
            raise Fault("it has fewer parameters than it says")
        return count

    def number(self, position: int, default: float | None = None) -> float:
        """A finite number of at most 1e12."""
        word = self.word(position)
        if not word:
            if default is None:
                raise Fault("a parameter is missing")
            return default
        return _read_number(word)

    def numbers(self, start: int, count: int) -> FloatArray:
        """Numbers from a position on, shape (count,); those left out are 0.

        Raises
        ------
        Fault
            There are fewer words, or one is not a finite number of at most 1e12.
        """
        words = self._words[start : start + count]
        if start < 0 or count < 0 or len(words) < count:
            raise Fault("it has fewer parameters than it says")
        try:
            values = np.array([float(word) for word in words])
        except ValueError:
            return np.array([_read_number(word) if word else 0.0 for word in words])
        if count and not np.abs(values).max() <= MAX_NUMBER:
            raise Fault("a number is not finite or too large")
        return values

    def pointer(self, position: int) -> int:
        """The number of the entry of another entity; 0 if there is none."""
        return abs(self.integer(position, 0))

    def pointers(self, start: int, count: int, stride: int = 1) -> list[int]:
        """Numbers of entries at every `stride`-th position."""
        return [self.pointer(start + stride * item) for item in range(count)]

    def text(self, position: int) -> str:
        """A text; bytes beyond ASCII are UTF-8, or else Latin-1."""
        word = self.word(position)[:MAX_TEXT]
        if not word.isascii():
            try:
                return word.encode("latin-1").decode("utf-8")
            except UnicodeError:
                pass
        return word


def _read_number(word: str) -> float:
    try:
        number = float(word[:100].translate(_EXPONENT))
    except ValueError:
        raise Fault("a parameter is not a number") from None
    if not abs(number) <= MAX_NUMBER or math.isnan(number):
        raise Fault("a number is not finite or too large")
    return number
