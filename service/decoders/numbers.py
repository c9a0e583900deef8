"""Reads numbers from a text in pieces, which takes little memory.

Each word is converted by Python's `float`, which rounds correctly. Words that are not plain decimal
numbers are refused: then the piece is read a second time, to find the line of the word.
"""

import re
from collections.abc import Callable
from itertools import islice
from math import isfinite

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import build_malformed_error
from service.errors import InvalidRequest, Issue, SurfaceError

PIECE_BYTES = 1 << 16
"""The bytes of one piece, which is split into words at once."""

MAX_NUMBER_CHARS = 100
"""The most characters of a number; all digits of a float64 need 24."""

_GAP = re.compile(rb"[\s,]")
_WORD = re.compile(rb"[^\s,]+")

# `_NUMBER` is a plain decimal number; `_NUMERIC` may also be a name of a number that is not finite.
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_NUMERIC = re.compile(_NUMBER.pattern + rb"|[-+]?(?:nan|inf|infinity)", re.IGNORECASE)


def read_numbers(
    text: bytes, start: int, end: int, max_count: int, build_error: Callable[[], SurfaceError]
) -> FloatArray:
    """Read all numbers of `text[start:end]`; blanks, line feeds and commas separate them.

    Parameters
    ----------
    text : bytes
    start, end : int
        Indices of bytes; words may touch them.
    max_count : int
        The most numbers that are allowed.
    build_error : callable
        Returns the error for more than `max_count` numbers, which is raised before all are read.

    Returns
    -------
    ndarray of float64, shape (N,)

    Raises
    ------
    MalformedBody, InvalidRequest
        A word is not a number, or the number is not finite; the message names its line.
    """
    # Count first if the text is long enough for too many words: each takes a byte and a gap.
    if (end - start) // 2 >= max_count and _count_words(text, start, end) > max_count:
        raise build_error()
    pieces: list[FloatArray] = []
    count = 0
    while start < end:
        cut = _find_cut(text, start, end)
        words = text[start:cut].replace(b",", b" ").split()
        count += len(words)
        if count > max_count:
            raise build_error()
        pieces.append(_parse_words(words, text, start, cut))
        start = cut
    return np.concatenate(pieces) if pieces else np.empty(0)


def line_of_number(text: bytes, start: int, index: int) -> int:
    """The line (from 1) of number `index` (from 0) of the numbers in `text[start:]`."""
    word = next(islice(_WORD.finditer(text, start), index, None))
    return line_at(text, word.start())


def line_at(text: bytes, position: int) -> int:
    """The line (from 1) of the byte `text[position]`."""
    return text.count(b"\n", 0, position) + 1


def _count_words(text: bytes, start: int, end: int) -> int:
    """The number of words in `text[start:end]`: of runs of characters that are no gaps.

    Counting takes 1/10 of the time of splitting the text into words. Control characters count as
    gaps, so the count may be wrong if words have them; such words are no numbers, and are refused.
    """
    count, was_printed = 0, False
    for position in range(start, end, PIECE_BYTES):
        letters = np.frombuffer(text, np.uint8, min(PIECE_BYTES, end - position), position)
        is_printed = (letters > ord(" ")) & (letters != ord(","))
        count += int(np.count_nonzero(is_printed[1:] & ~is_printed[:-1]))
        count += bool(is_printed[0]) and not was_printed
        was_printed = bool(is_printed[-1])
    return count


def _find_cut(text: bytes, start: int, end: int) -> int:
    """The end of the piece that begins at `start`: a gap between two words, or `end`."""
    first = start + PIECE_BYTES
    last = first + MAX_NUMBER_CHARS
    if first < end and (gap := _GAP.search(text, first, min(last, end))):
        return gap.start()
    if last < end:  # no gap: the word at `first` is too long for a number
        raise build_word_error(text, first)
    return end


def _parse_words(words: list[bytes], text: bytes, start: int, cut: int) -> FloatArray:
    """Convert the words of the piece `text[start:cut]` to numbers."""
    try:
        values = np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        raise _find_word_error(text, start, cut) from None
    # Refuse words such as 1_000, which `float` accepts.
    is_plain = (
        text.find(b"_", start, cut) < 0 and max(map(len, words), default=0) <= MAX_NUMBER_CHARS
    )
    if not is_plain or not np.isfinite(values).all():
        raise _find_word_error(text, start, cut)
    return values


def build_word_error(text: bytes, position: int) -> SurfaceError:
    """The error for the word around `text[position]`, which is not a finite number."""
    start = position
    while start > max(0, position - MAX_NUMBER_CHARS) and not _GAP.match(text, start - 1):
        start -= 1
    word = _WORD.match(text, start, start + MAX_NUMBER_CHARS + 1)
    if word is None or len(word[0]) > MAX_NUMBER_CHARS or not _NUMERIC.fullmatch(word[0]):
        return build_malformed_error(
            f"A number is needed here (line {line_at(text, start)}).",
            "something else",
            f"a decimal number of at most {MAX_NUMBER_CHARS} characters",
        )
    return InvalidRequest(
        Issue(
            "not_finite",
            f"Every number must be finite (line {line_at(text, start)}).",
            "",
            "NaN, Infinity or a number beyond double precision",
            "a finite number",
        )
    )


def _find_word_error(text: bytes, start: int, cut: int) -> SurfaceError:
    """The error for the first word of the piece `text[start:cut]` that is not a finite number."""
    for word in _WORD.finditer(text, start, cut):
        is_plain = len(word[0]) <= MAX_NUMBER_CHARS and _NUMBER.fullmatch(word[0])
        if not is_plain or not isfinite(float(word[0])):
            return build_word_error(text, word.start())
    raise AssertionError("all words of the refused piece are numbers")
