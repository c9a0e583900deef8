"""Finds the instances in the bytes of a file, without parsing any.

Outside strings and comments, the sign `=` occurs in one place of an exchange structure only: after
the number of an instance.

References
----------
ISO 10303-21, clauses 5 to 8: the exchange structure, comments, strings.
"""

import numpy as np

from service.bases.arrays import AnyArray, Bools, Ints
from service.decoders.format import FileLimits, check_entities

BEGIN_WITHIN = 4096
"""Bytes in which the first word of a file must be, as comments and a byte order mark may be before
it; and the most blanks between a number and the signs beside it."""

MAX_DIGITS = 18
"""The most digits of the number of an instance."""

CHUNK = 1 << 22
"""How many bytes are searched at once."""

_EQUALS, _QUOTE, _HASH, _ZERO = b"='#0"


def blank_comments(content: bytes) -> bytes:
    """The file with a blank in place of each comment; in strings there are no comments."""
    kept = bytearray()
    begin = searched = quotes = 0
    while (found := content.find(b"/*", searched)) >= 0:
        quotes += content.count(b"'", searched, found)
        searched = found + 2
        if quotes % 2:  # in a string, which doubled apostrophes end and begin again
            continue
        kept += content[begin:found] + b" "
        end = content.find(b"*/", searched)
        if end < 0:
            return bytes(kept)
        begin = searched = end + 2
    return bytes(kept + content[begin:])


def find_instances(content: bytes, limits: FileLimits) -> tuple[Ints, Ints, Ints]:
    """Positions of `=` and of `#`, and the number between them, of each instance.

    A file with an odd number of apostrophes has lost one: then a sign is taken to be outside
    strings if its instance begins behind a semicolon.
    """
    data = np.frombuffer(content, np.uint8)
    is_damaged = content.count(b"'") % 2 == 1
    found: list[tuple[Ints, Ints, Ints]] = []
    count = quotes_before = 0
    for begin in range(0, len(data), CHUNK):
        chunk = data[begin : begin + CHUNK]
        signs = np.flatnonzero(chunk == _EQUALS)
        if not is_damaged:
            quotes = np.flatnonzero(chunk == _QUOTE)
            is_outside = (np.searchsorted(quotes, signs) + quotes_before) % 2 == 0
            quotes_before += len(quotes)
            signs = signs[is_outside]
        triple = _read_numbers(data, signs + begin, is_damaged)
        count += len(triple[0])
        check_entities(count, limits)
        found.append(triple)
    signs, hashes, numbers = (np.concatenate(column) for column in zip(*found, strict=True))
    return signs, hashes, numbers


def _read_numbers(data: AnyArray, signs: Ints, is_damaged: bool) -> tuple[Ints, Ints, Ints]:
    """Read the number before each sign, backwards, digit by digit for all signs at once."""
    position = _skip_blanks(data, signs - 1)
    numbers = np.zeros(len(signs), np.int64)
    has_digit = np.zeros(len(signs), bool)
    active = np.arange(len(signs))
    for exponent in range(MAX_DIGITS):
        digits = data[position[active]].astype(np.int64) - _ZERO
        is_digit = (digits >= 0) & (digits <= 9)
        active = active[is_digit]
        if not len(active):
            break
        numbers[active] += digits[is_digit] * 10**exponent
        has_digit[active] = True
        position[active] = np.maximum(position[active] - 1, 0)
    is_instance = has_digit & (data[position] == _HASH)
    signs, position, numbers = signs[is_instance], position[is_instance], numbers[is_instance]
    before = data[_skip_blanks(data, position - 1)]
    is_instance = _is_one_of(before, b";") if is_damaged else ~_is_one_of(before, b",(=")
    return signs[is_instance], position[is_instance], numbers[is_instance]


def _skip_blanks(data: AnyArray, positions: Ints) -> Ints:
    """The last position at or before each one that is not a blank; 0 if there is none."""
    positions = np.maximum(positions, 0)
    active = np.arange(len(positions))
    for _ in range(BEGIN_WITHIN):
        active = active[_is_one_of(data[positions[active]], b" \t\r\n")]
        if not len(active):
            break
        positions[active] = np.maximum(positions[active] - 1, 0)
    return positions


def _is_one_of(values: AnyArray, bytes_: bytes) -> Bools:
    is_one: Bools = values == bytes_[0]
    for byte in bytes_[1:]:
        is_one |= values == byte
    return is_one
