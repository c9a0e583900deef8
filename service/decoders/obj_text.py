"""The text of an OBJ file as statements, with their numbers, and with errors that name the line."""

import re
from collections.abc import Iterator, Sequence
from math import isfinite

from service.cancellation import checkpoint
from service.decoders.format import build_malformed_error
from service.decoders.numbers import MAX_NUMBER_CHARS, build_word_error, line_at
from service.errors import InvalidRequest, Issue, SurfaceError

_STATEMENT = re.compile(rb"[^\r\n]+")


class ObjText:
    """A text, and the position of the statement that was read last."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        # Blanks in place of line ends keep the positions of all words.
        self._text = content.replace(b"\\\r\n", b"   ").replace(b"\\\n", b"  ")
        self._has_underscores = b"_" in content
        self._position = 0

    def read_statements(self) -> Iterator[list[bytes]]:
        """The words of each statement; lines that end in a backslash go on in the next."""
        for number, statement in enumerate(_STATEMENT.finditer(self._text)):
            if not number % 4096:
                checkpoint()
            if words := statement[0].partition(b"#")[0].split():
                self._position = statement.start()
                yield words
        self._position = len(self._text)

    def parse_numbers(self, words: Sequence[bytes]) -> list[float]:
        """Finite numbers, one for each word of the last statement."""
        try:
            values = [*map(float, words)]
        except ValueError:
            raise self._build_word_error(words) from None
        if not all(map(isfinite, values)) or self._are_strange(words):
            raise self._build_word_error(words)
        return values

    def parse_indices(self, words: Sequence[bytes], count: int) -> list[int]:
        """Indices from 0, of numbers from 1, or from −1 backwards, of `count` things."""
        try:
            numbers = [*map(int, words)]
        except ValueError:
            numbers = []
        if len(numbers) != len(words) or self._are_strange(words):
            raise self.build_error("An index is a whole number", "something else", "1, 2, …")
        indices = [n - 1 if n > 0 else n + count if n else -1 for n in numbers]
        if indices and not 0 <= min(indices) <= max(indices) < count:
            raise InvalidRequest(
                Issue(
                    "index_out_of_range",
                    "Points and curves have numbers from 1, or from -1 backwards "
                    f"(line {self._line()}).",
                    "",
                    "another number",
                    f"1 to {count}, or -1 to -{count}" if count else "points, before this line",
                )
            )
        return indices

    def build_error(self, message: str, got: str, needed: str) -> SurfaceError:
        """The error for the last statement; `message` has no full stop."""
        return build_malformed_error(f"{message} (line {self._line()}).", got, needed)

    def _are_strange(self, words: Sequence[bytes]) -> bool:
        """Whether a word has a `_`, which Python reads in numbers."""
        return self._has_underscores and any(b"_" in word for word in words)

    def _build_word_error(self, words: Sequence[bytes]) -> SurfaceError:
        """The error for the first of some words that is not a finite number."""
        wrong = next(word for word in words if not _is_number(word))
        return build_word_error(self._text, self._text.index(wrong, self._position))

    def _line(self) -> int:
        return line_at(self._content, self._position)


def _is_number(word: bytes) -> bool:
    if b"_" in word or len(word) > MAX_NUMBER_CHARS:
        return False
    try:
        return isfinite(float(word))
    except ValueError:
        return False
