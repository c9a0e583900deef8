"""Long arrays of numbers in a JSON text, read piece by piece into arrays of NumPy.

Lists of Python's numbers take several times the memory of the numbers, and once they are gone,
whatever small was made meanwhile keeps a part of it from being used for anything else. So they are
not made:

    [[[1, 2], [3, 4]], [[5, 6], [7, 8]]]    the text
    1, 2, 3, 4, 5, 6, 7, 8                  its numbers, which the parser reads
    [[[,],[,]],[[,],[,]]]                   what is around them, of which the lengths are found

Only what is an array of equal lengths on every level, of nothing but numbers, is read so. What is
made of it is told from other arrays by its type, since those may have the rows of a triangle as one
axis, which no text has.
"""

import re
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.schemas.parser import parse

MAX_LEVELS = 8
"""Levels of what is read here; nets have three."""

_FOREIGN = re.compile(rb"[^0-9eE+\-., \t\r\n\[\]]")
_BLANK_BRACKETS = bytes.maketrans(b"[]", b"  ")
Numbers: TypeAlias = NDArray[Any]
"""Of float64 or int64."""


class Listed(np.ndarray[tuple[int, ...], np.dtype[Any]]):
    """Numbers of a text: each axis is a level of its lists."""


_OTHERS = bytes(set(range(256)) - set(b"[],"))
_OPEN, _CLOSE, _COMMA = b"[],"


class _Levels:
    """The lengths of the lists on each level, as far as the text was read."""

    def __init__(self) -> None:
        self.depth = 0
        self.commas = np.zeros(MAX_LEVELS + 1, np.int64)
        self.lists = np.zeros(MAX_LEVELS + 1, np.int64)
        self.lengths: list[int | None] = [None] * (MAX_LEVELS + 1)

    def depths(self, signs: NDArray[np.uint8]) -> NDArray[np.int64]:
        """How many brackets are open behind each of the next brackets and commas."""
        steps = (signs == _OPEN).view(np.int8) - (signs == _CLOSE).view(np.int8)
        return self.depth + np.cumsum(steps, dtype=np.int64)

    def take(self, signs: NDArray[np.uint8], depths: NDArray[np.int64]) -> bool:
        """Goes on with these; whether all lists of a level are still of one length."""
        if not len(signs):
            return True
        deepest = int(depths.max(initial=self.depth))
        if deepest > MAX_LEVELS:
            return False
        commas, closed = signs == _COMMA, signs == _CLOSE
        for level in range(1, deepest + 1):
            before = self.commas[level] + np.cumsum(commas & (depths == level))
            at_ends = before[closed & (depths == level - 1)]
            if len(at_ends):
                if self.lengths[level] is None:
                    self.lengths[level] = int(at_ends[0]) + 1
                length = self.lengths[level] or 0
                ends = np.arange(1, len(at_ends) + 1) + self.lists[level]
                if (at_ends != (length - 1) * ends).any():
                    return False
                self.lists[level] += len(at_ends)
            self.commas[level] = before[-1]
        self.depth = int(depths[-1])
        return True

    def shape(self, count: int) -> tuple[int, ...] | None:
        """Of so many numbers, if all of them are on the last level."""
        shape: list[int] = []
        lists = 1
        for level in range(1, MAX_LEVELS + 1):
            length = self.lengths[level]
            if length is None:
                break
            if self.lists[level] != lists:
                return None
            shape.append(length)
            lists *= length
        return tuple(shape) if lists == count else None


def read_numbers(body: bytes, start: int, end: int, piece: int) -> tuple[Listed, int] | None:
    """The array that begins at `start`, and where its text ends; None for any other value.

    It is of int64 where no number has a point or an exponent, else of float64: the numbers are
    those that the parser makes of their digits.

    Parameters
    ----------
    end : int
        Where the text ends, at the latest.
    piece : int
        Bytes that are read at once.

    Raises
    ------
    orjson.JSONDecodeError
        Where the text is no JSON.
    """
    levels = _Levels()
    parts: list[Numbers] = []
    while start < end:
        stop = min(start + piece, end)
        if stop < end:  # between two numbers
            stop = body.rfind(b",", start, stop)
            if stop <= start:
                return None
        text = body[start:stop]
        signs = np.frombuffer(text.translate(None, _OTHERS), np.uint8)
        depths = levels.depths(signs)
        closed = np.flatnonzero(depths == 0)
        if len(closed):
            stop = start + _behind_bracket(text, int(closed[0]) + 1)
            text, signs, depths = body[start:stop], signs[: closed[0] + 1], depths[: closed[0] + 1]
        values = _flat(text) if _is_nested_well(body[max(start - 1, 0) : stop + 1]) else None
        if values is None or not levels.take(signs, depths):
            return None
        parts.append(values)
        if len(closed):
            shape = levels.shape(sum(map(len, parts)))
            if shape is None:
                return None
            return np.concatenate(parts).reshape(shape).view(Listed), stop
        if not levels.take(np.frombuffer(b",", np.uint8), np.array([levels.depth])):
            return None
        start = stop + 1
    return None


def _flat(text: bytes) -> Numbers | None:
    """The numbers of a piece, whatever the brackets; None where there is something else."""
    if _FOREIGN.search(text) is not None:
        return None
    bare = text.translate(_BLANK_BRACKETS).lstrip(b" \t\r\n")  # with blanks it takes longer
    values = np.array(parse(b"[" + bare + b"]"))
    return values if values.dtype in (np.float64, np.int64) else None  # beyond 64 bits


def _is_nested_well(text: bytes) -> bool:
    """Whether no bracket stands where it would be missed by none but itself.

    Others cannot be taken away without two numbers coming together, or two commas.
    """
    bare = text.translate(None, b" \t\r\n")
    return b"[," not in bare and b",]" not in bare and b"[]" not in bare


def _behind_bracket(text: bytes, number: int) -> int:
    """Where the text goes on behind so many brackets and commas."""
    bytes_ = np.frombuffer(text, np.uint8)
    marks = np.flatnonzero((bytes_ == _OPEN) | (bytes_ == _CLOSE) | (bytes_ == _COMMA))
    return int(marks[number - 1]) + 1
