"""Long JSON texts parsed in pieces, so that other threads get their turn in between.

The parser holds Python's interpreter until it is done: 20 MB would keep everybody waiting for more
than a tenth of a second. What makes a text long is an array of arrays of numbers; it is cut between
two inner ones, `…], […`, and every piece is parsed by itself:

    [[[1, 2], [3, 4]], [[5, 6]]]      cut behind [1, 2], two brackets deep
    [[[1, 2]]]                        the first piece, its open brackets closed
    [[[3, 4]], [[5, 6]]]              the second, as many opened: [3, 4] goes on where [1, 2] is
"""

import re
import secrets

import numpy as np
import orjson
from numpy.typing import NDArray

from service.schemas.numbers import read_numbers
from service.schemas.parser import parse
from service.schemas.scan import between_strings

PIECE = 1 << 17
"""Bytes that are parsed at once: a millisecond or two."""

MAX_DEPTH = 8
"""Brackets that may be open at a cut; nets have three."""

TRIES = 16
"""Closing brackets that are looked at for a cut: where nets are, every second or third will do."""

_BETWEEN = re.compile(rb"\][ \t\r\n]*,[ \t\r\n]*(?=\[)")
_NAME = f"array {secrets.token_hex(16)}"


def is_long(body: bytes) -> bool:
    """Whether a text is parsed in pieces."""
    return len(body) >= 2 * PIECE


def loads(body: bytes, *, arrays: bool = False) -> object:
    """The value of a JSON text, as `orjson.loads` has it; raises what that raises.

    With `arrays` what is long, of nothing but numbers, and of equal lengths on each level, is an
    array of NumPy.
    """
    if not is_long(body):
        return parse(body)
    try:
        return _in_pieces(body, arrays)
    except orjson.JSONDecodeError:
        return parse(body)  # it tells where in the whole text


def _in_pieces(body: bytes, as_arrays: bool) -> object:
    """The text without its long arrays, names in their stead; then the arrays in place of those."""
    rest: list[bytes] = []
    arrays: dict[str, object] = {}
    done = 0
    for begin, end in between_strings(body, 2 * PIECE):
        start = body.find(b"[", begin, end)
        if start < 0 or end - start < 2 * PIECE:
            continue
        found: tuple[object, int] | None = None
        if as_arrays:
            found = read_numbers(body, start, end, PIECE)
        if found is None:
            found = _array(body, start, end)
        if found is not None:
            value, stop = found
            name = f"{_NAME} {len(arrays)}"  # which nobody can say in a text of their own
            arrays[name] = value
            rest += [body[done:start], orjson.dumps(name)]
            done = stop
    value = parse(b"".join([*rest, body[done:]]))
    if _put(value, arrays) != len(arrays):
        return parse(body)  # somebody has an array where none belongs
    return value


def _array(body: bytes, start: int, end: int) -> tuple[object, int] | None:
    """The array that begins at `start`, and where it ends; None if it cannot be cut.

    Between `start` and `end` there is no string.
    """
    whole: list[object] = []
    depth = 0  # brackets that are open where the piece begins
    while True:
        text = np.frombuffer(body, np.uint8, min(PIECE, end - start), start)
        depths = depth + np.cumsum((text == ord("[")).view(np.int8), dtype=np.int32)
        depths -= np.cumsum((text == ord("]")).view(np.int8), dtype=np.int32)
        closed = np.flatnonzero(depths[1:] <= 0)
        if len(closed):
            stop = start + 1 + int(closed[0]) + 1
            _merge(whole, parse(b"[" * depth + body[start:stop]), depth)
            return whole, stop
        cut = _last_cut(body, start, np.flatnonzero((text == ord("]")) & (depths <= MAX_DEPTH)))
        if cut is None:
            return None
        at, begin = cut
        after = int(depths[at - start])
        _merge(whole, parse(b"[" * depth + body[start : at + 1] + b"]" * after), depth)
        start, depth = begin, after


def _last_cut(body: bytes, start: int, brackets: NDArray[np.intp]) -> tuple[int, int] | None:
    """The last of the brackets that one may cut behind, and where the next piece begins."""
    for bracket in brackets[:-TRIES:-1].tolist():
        between = _BETWEEN.match(body, start + bracket)
        if between is not None:
            return start + bracket, between.end()
    return None


def _merge(whole: list[object], piece: list[object], depth: int) -> None:
    """Goes on with an array; `depth` lists are open, each of them the last of the one around it."""
    if depth > 1:
        last, first = whole[-1], piece[0]
        assert isinstance(last, list)
        assert isinstance(first, list)
        _merge(last, first, depth - 1)
        piece = piece[1:]
    whole.extend(piece)


def _put(value: object, arrays: dict[str, object]) -> int:
    """Puts arrays in place of their names, which are values of keys; how many names there were."""
    count, waiting = 0, [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict):
            for key, child in item.items():
                if isinstance(child, str) and child in arrays:
                    item[key] = arrays[child]
                    count += 1
            waiting.extend(child for child in item.values() if type(child) in (dict, list))
        elif isinstance(item, list) and item and type(item[0]) is dict:
            waiting.extend(item)
    return count
