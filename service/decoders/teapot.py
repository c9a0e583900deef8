"""Reads Bézier patches from the text form of the Utah teapot of 1975.

    32                                            number of patches
    1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16        vertices of each, counted from 1
    …
    306                                           number of vertices
    1.4,0.0,2.4                                   x, y, z of each
    …

Blanks may replace commas. A patch of degree p has (p+1)² vertices, in one line, or in p + 1 lines
with one row of the control net each. The decoder finds the meaning of each number from the numbers
alone; it uses lines only for error messages.
"""

import re
from collections.abc import Iterator
from math import isqrt
from typing import NoReturn

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import (
    Tree,
    build_malformed_error,
    build_too_many_error,
    check_count,
    check_kind,
)
from service.decoders.numbers import PIECE_BYTES, line_of_number, read_numbers
from service.errors import InvalidRequest, Issue, MalformedBody, count_nouns

KINDS = ("patches",)
"""The kinds of surface that a file may become."""

_PRINTED = re.compile(rb"[^\s,]")


def decode(content: bytes, kind: str | None, max_points: int) -> Tree:
    """Decode the patches of a teapot text, over the vertices that they share.

    Raises
    ------
    MalformedBody
        The text does not have this form.
    InvalidRequest
        A number is not finite, an index names no vertex, or there are more than `max_points`
        control points.
    """
    check_kind(kind, KINDS)
    # At most `max_points` indices, `max_points` vertices of 3 coordinates, and the 2 counts.
    numbers = read_numbers(
        content,
        0,
        len(content),
        4 * max_points + 2,
        lambda: build_too_many_error("more numbers", max_points),
    )
    patch_count, patch_size = _find_layout(content, numbers)
    check_count(patch_count * patch_size, max_points)
    indices = numbers[1 : 1 + patch_count * patch_size]
    vertices = numbers[2 + patch_count * patch_size :].reshape(-1, 3)
    _check_indices(content, indices, len(vertices))
    width = isqrt(patch_size)
    grids = indices.astype(np.int64).reshape(patch_count, width, width) - 1
    return {"type": "patches", "vertices": vertices, "patches": grids}


def _find_layout(content: bytes, numbers: FloatArray) -> tuple[int, int]:
    """The number of patches, and the number of vertices of each patch.

    After the indices comes the number V of vertices, and then 3 V coordinates. The squares 4, 9,
    16, … are tried as the number of vertices of a patch. The first square for which V fits the
    count of all numbers is right: with a smaller square, an index would be taken for V, and 3 times
    an index is too small.
    """
    patch_count = int(numbers[0]) if len(numbers) else 0
    if patch_count > 0 and numbers[0] == patch_count:
        for width in range(2, isqrt(len(numbers) // patch_count) + 1):
            index = 1 + patch_count * width**2  # of V
            if index < len(numbers) and len(numbers) == index + 1 + 3 * float(numbers[index]):
                return patch_count, width**2
    _refuse_lines(content)


def _check_indices(content: bytes, indices: FloatArray, vertex_count: int) -> None:
    """Refuse indices that are not whole numbers from 1 to the number of vertices."""
    is_wrong = (indices < 1) | (indices > vertex_count) | (indices != np.floor(indices))
    if not is_wrong.any():
        return
    line = line_of_number(content, 0, 1 + int(is_wrong.argmax()))
    raise InvalidRequest(
        Issue(
            "index_out_of_range",
            f"Patches name their vertices by number, counted from 1 (line {line}).",
            "",
            "another number",
            f"a whole number from 1 to {vertex_count}",
        )
    )


def _refuse_lines(content: bytes) -> NoReturn:
    """Raise an error that names the first line with a wrong count of numbers."""
    lines = _split_lines(content)
    line, count, patch_count = next(lines, (1, 0, 0.0))
    if count != 1 or patch_count < 1 or patch_count % 1:
        needed = "one whole number above zero"
        raise _build_line_error(
            "The first line has one number, the number of patches",
            line,
            count_nouns(count, "numbers"),
            needed,
        )
    width = index_lines = vertex_count = 0
    for line, count, _ in lines:
        if count == 1:
            break
        width = width or count
        if count != width:
            message = "Lines of indices must be equally long"
            raise _build_line_error(
                message, line, count_nouns(count, "numbers"), count_nouns(width, "numbers")
            )
        index_lines += 1
    else:
        message, needed = "The number of vertices follows the indices", "one number"
        raise _build_line_error(message, line, "the end of the text", needed)
    if index_lines not in (patch_count, patch_count * width) or (
        index_lines == patch_count and isqrt(width) ** 2 < width
    ):
        message = "A patch of degree p has (p+1)² indices, in one line or in p + 1 lines"
        got = f"{index_lines} lines of {width} numbers above this line"
        raise _build_line_error(message, line, got, "lines for all patches")
    for line, count, _ in lines:
        if count != 3:
            message = "A vertex has three coordinates"
            raise _build_line_error(message, line, count_nouns(count, "numbers"), "3 numbers")
        vertex_count += 1
    message, needed = (
        "The number of vertices differs from the number that precedes them",
        "equal numbers",
    )
    raise _build_line_error(message, line, f"{vertex_count} vertices", needed)


def _split_lines(content: bytes) -> Iterator[tuple[int, int, float]]:
    """For each line that is not empty: its number (from 1), its count of numbers, and the first."""
    line, position = 1, 0
    while position < len(content):
        # In steps, so that other threads can run in between: there may be many blank lines.
        match = _PRINTED.search(content, position, position + PIECE_BYTES)
        start = match.start() if match else min(position + PIECE_BYTES, len(content))
        line += content.count(b"\n", position, start)
        position = start
        if match:
            end = content.find(b"\n", start)
            position = end if end >= 0 else len(content)
            words = content[start:position].replace(b",", b" ").split()
            yield line, len(words), float(words[0])


def _build_line_error(message: str, line: int, got: str, needed: str) -> MalformedBody:
    """The error for a line of a file; `message` has no full stop."""
    return build_malformed_error(f"{message} (line {line}).", got, needed)
