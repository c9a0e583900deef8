"""Writes numbers as text: with the fewest digits that read back as the same number, or like `%g`.

orjson writes the numbers of a whole array in C. For formats with lines, it writes the array as one
flat list, and NumPy replaces the commas by separators. This is faster than writing short rows with
orjson, and faster than `bytes.replace` with more than one character.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import orjson
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint

FLOAT64_CHARS = 24
"""The most characters of a float64: sign, 17 digits, point, and e-308 or leading 0.0000."""
FLOAT32_CHARS = 16
"""The most characters of a float32: sign, leading 0.0000, and 9 digits."""
LONGEST_ESCAPE = 6
"""The most characters of one byte of UTF-8 in JSON: a control character is `\\u0001`."""

CHUNK_NUMBERS = 1 << 15
"""How many numbers are converted to text at once, to bound the memory."""

MAX_WHOLE_BYTES = 1 << 20
"""The most bytes of arrays whose JSON is written as a whole, not in chunks."""

MAX_CHUNK_BYTES = 1 << 14
"""The most bytes of arrays of an object or a list that is written as one chunk."""

ROW_NUMBERS = 32
"""How many float64 orjson gets in one row. orjson reserves 24 bytes for each number and some
spare bytes for each row, but a number of `FLOAT64_CHARS` and its comma take 25 bytes. So orjson
3.13 writes long rows of such numbers beyond the end of its memory."""

_SHORT = frozenset({int, float, str, bool, type(None)})
"""Types of values that have no bytes in the sense of `_count_bytes`."""

POWERS = np.array([float(10**k) for k in range(10)])
"""10^0 … 10^9, all exact."""


def json_text(value: object) -> bytes:
    """The JSON text (RFC 8259) of a value, which may have arrays; `bytes` must be JSON already."""
    return orjson.dumps(value, default=_convert_unknown)


def json_document(value: object) -> bytes:
    """The JSON text of a value, which may contain arrays; `bytes` must be JSON already.

    A long text is written in chunks, which takes memory for 2 times its length in place of 4 times.
    """
    checkpoint()
    if _count_bytes(value) <= MAX_WHOLE_BYTES:
        return json_text(value)
    return b"".join(_write_chunks(value))


def _count_bytes(value: object) -> int:
    """The number of bytes of all arrays, and of all `bytes`, in a value."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, bytes):
        return len(value)
    if not isinstance(value, dict | list | tuple):
        return 0
    items = value.values() if isinstance(value, dict) else value
    # A list of numbers and texts takes one pass, and no call for each of them.
    return sum([_count_bytes(item) for item in items if type(item) not in _SHORT])


def _convert_unknown(value: object) -> object:
    """Convert a value of a type that orjson does not know: `bytes`, an array, a NumPy number."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        # Not `json_array`: a cancellation raised inside orjson would become a TypeError.
        value = _array_text(value)
    if isinstance(value, bytes):
        return orjson.Fragment(value)
    raise TypeError


def _write_chunks(value: object) -> Iterator[bytes]:
    """The JSON text of a value in chunks; large arrays are written in several chunks.

    Objects and lists with few numbers are one chunk each: a brep has very many.
    """
    if isinstance(value, dict | list | tuple) and _count_bytes(value) <= MAX_CHUNK_BYTES:
        yield json_text(value)
    elif isinstance(value, dict):
        opening = b"{"
        for key, item in value.items():
            yield opening + json_text(key) + b":"
            yield from _write_chunks(item)
            opening = b","
        yield b"}" if value else b"{}"
    elif isinstance(value, list | tuple) and _count_bytes(value):
        yield from _write_list(map(_write_chunks, value))
    elif isinstance(value, np.ndarray) and value.size:
        row_size = value.size // len(value)
        yield from _write_list(
            (json_array(value[k])[1:-1],) for k in row_slices(len(value), row_size, CHUNK_NUMBERS)
        )
    elif isinstance(value, bytes):
        yield value
    else:
        yield json_text(value)


def _write_list(items: Iterable[Iterable[bytes]]) -> Iterator[bytes]:
    """The JSON text of a list in chunks, from the chunks of its items."""
    opening = b"["
    for chunks in items:
        yield opening
        yield from chunks
        opening = b","
    yield b"]"


def json_bound(value: object) -> int:
    """An upper bound of the bytes of `json_text(value)`, computed without writing the text.

    The value must not contain `bytes`.
    """
    if isinstance(value, np.ndarray):
        # A number, a comma, and the brackets of a list for each axis.
        return value.size * (FLOAT64_CHARS + 1 + 2 * value.ndim) + 2
    if isinstance(value, dict):
        return 2 + sum(json_bound(key) + json_bound(item) + 2 for key, item in value.items())
    if isinstance(value, list | tuple):
        return 2 + sum(json_bound(item) + 1 for item in value)
    return 2 + LONGEST_ESCAPE * len(value.encode()) if isinstance(value, str) else FLOAT64_CHARS


def json_array(array: NDArray[np.generic]) -> bytes:
    """The JSON text of one array; a request can be cancelled before it is written."""
    checkpoint()
    return _array_text(array)


def _array_text(array: NDArray[np.generic]) -> bytes:
    """The JSON text of one array, written by orjson in rows of at most `ROW_NUMBERS` numbers."""
    array = np.ascontiguousarray(array)
    if array.dtype != np.float64 or array.shape[-1] <= ROW_NUMBERS:
        return orjson.dumps(array, option=orjson.OPT_SERIALIZE_NUMPY)
    if array.ndim > 1:
        return b"[" + b",".join(map(_array_text, array)) + b"]"
    # A long list is written as rows, whose brackets are then removed. The last row may be empty.
    values_in_rows = array.size - array.size % ROW_NUMBERS
    text = orjson.dumps(
        array[:values_in_rows].reshape(-1, ROW_NUMBERS), option=orjson.OPT_SERIALIZE_NUMPY
    )
    text = text.replace(b"[", b"").replace(b"]", b"")
    last_row = orjson.dumps(array[values_in_rows:], option=orjson.OPT_SERIALIZE_NUMPY)
    return b"".join((b"[", text, b"," if values_in_rows < array.size else b"", last_row[1:]))


def rows(
    array: RealArray | IndexArray | NDArray[np.int64], start: bytes = b"", between: bytes = b" "
) -> bytes:
    """Write an array as lines of numbers, one line for each row.

    Parameters
    ----------
    array : ndarray of float or integer, shape (N, K), K >= 1
        Floats are written with the fewest digits that read back as the same value.
    start : bytes
        The beginning of each line.
    between : bytes
        The separators between the numbers of a row, one character each; if the row has more
        numbers, the separators are repeated.
    """
    return b"".join(_lines(array[chunk], start, between) for chunk in row_chunks(array))


def join_rows(*arrays: RealArray, start: bytes = b"") -> bytes:
    """Write several arrays, with the same number of rows, side by side as lines of numbers.

    Each line begins with `start`.
    """
    return b"".join(
        _side_by_side([array[chunk] for array in arrays], start) for chunk in row_chunks(arrays[0])
    )


def row_chunks(array: NDArray[np.generic]) -> Iterator[slice]:
    """Slices of the rows of an array; each has about `CHUNK_NUMBERS` numbers."""
    return row_slices(len(array), array.shape[1], CHUNK_NUMBERS)


def _lines(array: NDArray[np.generic], start: bytes = b"", between: bytes = b" ") -> bytes:
    """The lines of some rows of an array."""
    lines = _in_lines(json_array(array.reshape(-1)), array.shape[1], between)
    return b"".join((start, lines.replace(b"\n", b"\n" + start) if start else lines, b"\n"))


def _in_lines(text: bytes, width: int, between: bytes = b" ") -> bytes:
    """Convert a JSON list of numbers to lines of `width` numbers; the last has no line feed."""
    lines = bytearray(text)
    lines[-1:] = b","
    characters = np.frombuffer(lines, dtype=np.uint8)
    commas = np.flatnonzero(characters == ord(","))
    separators = (between * width)[: width - 1] + b"\n"
    characters[commas.reshape(-1, width)] = np.frombuffer(separators, dtype=np.uint8)
    return bytes(memoryview(lines)[1:-1])


def _side_by_side(arrays: Sequence[RealArray], start: bytes) -> bytes:
    """The lines of some rows of several arrays side by side."""
    columns = [_lines(array).splitlines() for array in arrays]
    # Each number is followed by a blank, or by a line feed and the start of the next line.
    step = 2 * len(columns)
    cells = ([b" "] * (step - 1) + [b"\n" + start]) * len(columns[0])
    for k, column in enumerate(columns):
        cells[2 * k :: step] = column
    cells[-1] = b"\n"
    return start + b"".join(cells)


def general_lines(array: FloatArray) -> list[bytes]:
    """For each row of an array its numbers as in C's `%g`, separated by blanks; no line feed."""
    lines: list[bytes] = []
    for chunk in row_chunks(array):
        lines += _in_lines(_general(array[chunk].reshape(-1)), array.shape[1]).split(b"\n")
    return lines


def _general(numbers: FloatArray) -> bytes:
    """Write numbers like a JSON list, but with six significant digits, as C's `%g` writes them.

    A number x with 10^e ≤ |x| < 10^(e+1) is rounded to m / 10^k with k = 5 − e, where m is the
    integer nearest to x · 10^k. Both m and 10^k are exact, so the fewest digits of the quotient are
    the digits of m, and orjson writes these. For two sorts of numbers `%g` itself is called:
    numbers that it writes with an exponent or without a point; and numbers for which x · 10^k is
    within 10^-7 of the middle between two integers, where the rounding of the product (below 10^-9)
    could change m.
    """
    size = np.abs(numbers)
    with np.errstate(divide="ignore"):
        exponent = np.clip(np.floor(np.log10(size)), -4, 5).astype(np.intp)
    power = POWERS.take(5 - exponent)
    product = numbers * power
    nearest = np.rint(product)
    is_usual = (size >= 1e-4) & (np.abs(product - nearest) < 0.5 - 1e-7)
    rounded_size = np.abs(nearest)
    is_usual &= (rounded_size >= 1e5) & (rounded_size < 1e6)
    quotient = nearest / power
    is_usual &= quotient != np.rint(quotient)
    others = np.flatnonzero(~is_usual)
    if not len(others):
        return json_array(quotient)
    quotient[others] = np.nan  # orjson writes it as null
    texts_between = json_array(quotient).split(b"null")
    cells = [b""] * (2 * len(others) + 1)
    # The texts of usual numbers and those of the other numbers take turns.
    cells[::2] = texts_between
    cells[1::2] = (b"%g " * len(others) % tuple(numbers[others].tolist())).split()
    return b"".join(cells)


def digits(count: int) -> int:
    """The number of decimal digits of `count`; indices below `count` have at most as many."""
    return len(str(count))
