"""Numbers as text, quickly: the shortest digits that round-trip, and C's `%g`.

Shortest digits come from orjson, which writes a whole array in C. Formats with lines get the array
as one flat list, in which NumPy puts their separators in the places of the commas: rows of their
own would cost orjson as much again as the integers in them, and `bytes.replace` is slow at finding
more than one character.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import orjson
from numpy.typing import NDArray

from service.bases.arrays import IndexArray, RealArray
from service.bases.chunks import chunks
from service.stopping import checkpoint

FLOAT64_CHARS = 24
"""Longest shortest-round-trip float64: sign, 17 digits, point, and e-308 or 0.0000 in front."""
FLOAT32_CHARS = 16
"""The same for float32, which needs at most 9 digits."""
LONGEST_ESCAPE = 6
"""A control character, one byte of UTF-8, is six in JSON: `\\u0001`."""

CHUNK_NUMBERS = 1 << 15
"""Numbers that become text at a time: what is made of them on the way stays small."""

AT_ONCE = 1 << 20
"""Bytes in the arrays of a value that becomes JSON in one piece."""


def json_text(value: object) -> bytes:
    """JSON (RFC 8259) of a value that may hold contiguous NumPy arrays."""
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def json_document(value: object) -> bytes:
    """JSON of a value that may hold arrays, and bytes that are JSON already.

    A long text is made piece by piece: it takes twice its length, and not four times.
    """
    checkpoint()
    if _held(value) <= AT_ONCE:
        return orjson.dumps(value, default=_default, option=orjson.OPT_SERIALIZE_NUMPY)
    return b"".join(_pieces(value))


def _held(value: object) -> int:
    """Bytes of the arrays and of the JSON in a value."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, bytes):
        return len(value)
    if isinstance(value, Mapping):
        return sum(map(_held, value.values()))
    return sum(map(_held, value)) if isinstance(value, list | tuple) else 0


def _default(value: object) -> object:
    """What orjson writes where it does not know a value: JSON, or an array with gaps."""
    return orjson.Fragment(value) if isinstance(value, bytes) else np.ascontiguousarray(value)


def _pieces(value: object) -> Iterator[bytes]:
    """The text of a value, cut where large arrays are, and within them."""
    if isinstance(value, Mapping):
        opening = b"{"
        for key, item in value.items():
            yield opening + json_text(key) + b":"
            yield from _pieces(item)
            opening = b","
        yield b"}" if value else b"{}"
    elif isinstance(value, list | tuple) and _held(value):
        yield from _listed(map(_pieces, value))
    elif isinstance(value, np.ndarray) and value.size:
        each = value.size // len(value)
        yield from _listed(
            (json_array(value[k])[1:-1],) for k in chunks(len(value), each, CHUNK_NUMBERS)
        )
    elif isinstance(value, bytes):
        yield value
    else:
        yield json_text(value)


def _listed(items: Iterable[Iterable[bytes]]) -> Iterator[bytes]:
    opening = b"["
    for pieces in items:
        yield opening
        yield from pieces
        opening = b","
    yield b"]"


def json_bound(value: object) -> int:
    """Bytes of `json_text` at most, without writing any of it."""
    if isinstance(value, np.ndarray):
        # A number and a comma; each number may be a row of its own.
        return value.size * (FLOAT64_CHARS + 1 + 2 * value.ndim) + 2
    if isinstance(value, Mapping):
        return 2 + sum(json_bound(key) + json_bound(item) + 2 for key, item in value.items())
    if isinstance(value, list | tuple):
        return 2 + sum(json_bound(item) + 1 for item in value)
    if isinstance(value, str):
        return 2 + LONGEST_ESCAPE * len(value.encode())
    return FLOAT64_CHARS


def json_array(array: NDArray[np.generic]) -> bytes:
    """JSON of one array, made contiguous first where it is not."""
    checkpoint()
    return json_text(np.ascontiguousarray(array))


def rows(
    array: RealArray | IndexArray | NDArray[np.int64], start: bytes = b"", between: bytes = b" "
) -> bytes:
    """Lines of numbers, one a row, each beginning with `start`.

    Parameters
    ----------
    array : ndarray of float or integer, shape (N, K), K >= 1
        Floats are written with the fewest digits that read back as the same value.
    between : bytes
        The characters between the numbers of a row, repeated as often as they are needed.
    """
    return b"".join(_lines(array[chunk], start, between) for chunk in row_chunks(array))


def joined_rows(*arrays: RealArray, start: bytes = b"") -> bytes:
    """Lines of arrays of as many rows side by side, each array in its own precision."""
    return b"".join(
        _side_by_side([array[chunk] for array in arrays], start) for chunk in row_chunks(arrays[0])
    )


def row_chunks(array: NDArray[np.generic]) -> Iterator[slice]:
    """Rows of an array, so many at a time as are written at once."""
    return chunks(len(array), array.shape[1], CHUNK_NUMBERS)


def _lines(array: NDArray[np.generic], start: bytes = b"", between: bytes = b" ") -> bytes:
    """The lines of few rows, one at least."""
    width = array.shape[1]
    separators = (between * width)[: width - 1] + b"\n"
    text = _separated(json_array(array.reshape(-1)), b",", separators)
    return _begun(memoryview(text)[1:-1], start)


def _side_by_side(arrays: Sequence[RealArray], start: bytes) -> bytes:
    """The lines of few rows of several arrays, one at least."""
    columns = [_lines(array).splitlines() for array in arrays]
    cells = [b""] * (len(arrays) * len(columns[0]) + 1)
    for k, column in enumerate(columns):
        cells[k : -1 : len(arrays)] = column
    text = _separated(b"\n".join(cells), b"\n", b" " * (len(arrays) - 1) + b"\n")
    return _begun(memoryview(text)[:-1], start)


def _separated(text: bytes, old: bytes, new: bytes) -> bytearray:
    """The text with the characters of `new` in turn for each `old`, and for its last character."""
    changed = bytearray(text)
    changed[-1:] = old
    characters = np.frombuffer(changed, dtype=np.uint8)
    places = np.flatnonzero(characters == ord(old))
    characters[places.reshape(-1, len(new))] = np.frombuffer(new, dtype=np.uint8)
    return changed


def _begun(lines: memoryview, start: bytes) -> bytes:
    """Lines, the last of which lacks its end, each with `start` before it."""
    if not start:
        return b"".join((lines, b"\n"))
    return b"".join((start, bytes(lines).replace(b"\n", b"\n" + start), b"\n"))


def general_lines(array: RealArray, template: str) -> list[str]:
    """One string a row, without line ends: `template` holds a C conversion for every column.

    Parameters
    ----------
    array : ndarray of float, shape (N, K)
        Every number becomes a Python object: some ten thousand rows at a time are enough.
    """
    return list(map(template.__mod__, zip(*array.T.tolist(), strict=True)))


def digits(count: int) -> int:
    """Decimal digits of the largest index or number among `count` things."""
    return len(str(count))
