"""Numbers as text, quickly: the shortest digits that round-trip, and C's `%g`.

Shortest digits come from orjson, which writes a whole array in C; swapping JSON's brackets and
commas for the separators of another format is cheaper than formatting a row at a time.
"""

from collections.abc import Iterable, Iterator, Mapping

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

CHUNK_NUMBERS = 1 << 16
"""Numbers that become text at a time: what is made of them on the way stays small."""


def json_text(value: object) -> bytes:
    """JSON (RFC 8259) of a value that may hold contiguous NumPy arrays."""
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def json_document(value: object) -> bytes:
    """The same, written piece by piece: it takes twice its length, and not four times.

    Bytes in the value are JSON already.
    """
    return b"".join(_pieces(value))


def _pieces(value: object) -> Iterator[bytes]:
    """The text of a value, cut where large arrays are, and within them."""
    if isinstance(value, Mapping):
        opening = b"{"
        for key, item in value.items():
            yield opening + json_text(key) + b":"
            yield from _pieces(item)
            opening = b","
        yield b"}" if value else b"{}"
    elif isinstance(value, list | tuple) and any(map(_holds_arrays, value)):
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


def _holds_arrays(value: object) -> bool:
    """Whether there are arrays below."""
    return isinstance(value, Mapping) and any(
        isinstance(item, np.ndarray | Mapping) for item in value.values()
    )


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


def rows(array: RealArray | IndexArray | NDArray[np.int64], start: bytes = b"") -> bytes:
    """Lines of blank-separated numbers, one a row, each beginning with `start`.

    Parameters
    ----------
    array : ndarray of float or integer, shape (N, K), K >= 1
        Floats are written with the fewest digits that read back as the same value.
    """
    return b"".join(_lines(array[chunk], start) for chunk in row_chunks(array))


def joined_rows(*arrays: RealArray, start: bytes = b"") -> bytes:
    """Lines of arrays of as many rows side by side, each array in its own precision."""
    return b"".join(
        _side_by_side([_lines(array[chunk], b"" if k else start) for k, array in enumerate(arrays)])
        for chunk in row_chunks(arrays[0])
    )


def row_chunks(array: NDArray[np.generic]) -> Iterator[slice]:
    """Rows of an array, so many at a time as are written at once."""
    return chunks(len(array), array.shape[1], CHUNK_NUMBERS)


def _lines(array: NDArray[np.generic], start: bytes) -> bytes:
    """The lines of few rows, one at least."""
    inside = json_array(array)[2:-2]
    return start + inside.replace(b"],[", b"\n" + start).replace(b",", b" ") + b"\n"


def _side_by_side(columns: Iterable[bytes]) -> bytes:
    """Lines of several texts of as many lines, each with the lines of the others behind it."""
    lines = zip(*(column.splitlines() for column in columns), strict=True)
    return b"\n".join(map(b" ".join, lines)) + b"\n"


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
