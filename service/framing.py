"""A tree of values with arrays as bytes: one line of JSON, and the numbers after it.

    frame = header, line feed, numbers

The header is a JSON object, in ASCII, with sorted keys and without spaces. A member of it is the
tree, with null in place of each array. Its member `arrays` has the types and shapes of these
arrays, in the same order: `[["float64",[2,2,3]]]`. Their numbers follow the line feed, one array
after another, little-endian, 8 bytes each, the last axis fastest.

A null of the tree itself has to be marked (`mark_nulls`): it counts as an array with the type
`null` and the shape [0].
"""

import json
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from service.bases.arrays import AnyArray

Block: TypeAlias = bytes | memoryview

BLOCK_BYTES = 1 << 20
"""Bytes of numbers that are gathered in one block; a longer array is a block."""

UNREADABLE = (ValueError, LookupError, TypeError, ArithmeticError, StopIteration, RecursionError)
"""The exceptions of `read_frame` for bytes that are no frame."""

_TYPES = {"float64": np.dtype("<f8"), "int64": np.dtype("<i8")}

_NULL: AnyArray = np.empty(0, "V1")
"""This array stands for a null among the arrays of a tree."""

_NULL_TYPE = ["null", [0]]


def write_frame(name: str, tree: Any, **members: int) -> bytes:
    """The frame of a tree, which is the member `name` of the header.

    Parameters
    ----------
    tree
        Numbers, texts, lists, dicts, and arrays of float64 and int64. `read_frame` needs nulls
        to be marked.
    **members
        More members of the header.
    """
    return b"".join(write_blocks(name, tree, **members))


def write_blocks(name: str, tree: Any, **members: int) -> Iterator[Block]:
    """The blocks of the frame that `write_frame` joins: the header, then numbers of many arrays.

    It makes no second tree, so that the blocks take hardly more memory than their bytes.
    """
    arrays: list[AnyArray] = []

    def take(value: object) -> object:
        """The JSON of a value that the encoder does not know: null for an array, the next one."""
        if isinstance(value, np.ndarray):
            arrays.append(value)
            return None
        if isinstance(value, Mapping):
            return dict(value)
        raise TypeError("a frame has no values of this type")

    texts = {key: _to_json(value, take) for key, value in {**members, name: tree}.items()}
    texts["arrays"] = _describe(arrays)
    header = ",".join(f'"{key}":{texts[key]}' for key in sorted(texts))
    del texts
    yield b"{%b}\n" % header.encode("ascii")
    del header
    numbers = bytearray()
    for array in arrays:
        if array is _NULL or not array.size:
            continue
        data = np.ascontiguousarray(array, dtype=_TYPES[array.dtype.name]).data.cast("B")
        numbers += data
        if len(numbers) >= BLOCK_BYTES:
            yield bytes(numbers)
            numbers.clear()
    yield bytes(numbers)


def read_frame(name: str, frame: bytes) -> dict[str, Any]:
    """The header of a frame, with the arrays in its member `name`: views of `frame`.

    Raises
    ------
    Any of `UNREADABLE`
        The bytes are not a frame.
    """
    end = frame.index(b"\n")
    header: dict[str, Any] = json.loads(frame[:end])
    arrays: list[AnyArray] = []
    start = end + 1
    for type_name, shape in header["arrays"]:
        if [type_name, shape] == _NULL_TYPE:
            arrays.append(_NULL)
            continue
        if min(shape, default=0) < 0:
            raise ValueError("an axis of negative length")
        arrays.append(np.ndarray(shape, _TYPES[type_name], frame, start))
        start += arrays[-1].nbytes
    remaining_arrays = iter(arrays)
    header[name] = _insert_arrays(header[name], remaining_arrays)
    if start != len(frame) or next(remaining_arrays, None) is not None:
        raise ValueError("more numbers than the header names")
    return header


def mark_nulls(value: Any) -> Any:
    """The value with a mark in place of each None, which `read_frame` turns into None again.

    Parts without None are those of `value` itself.
    """
    if value is None:
        return _NULL
    if isinstance(value, dict):
        marked: Any = {key: mark_nulls(item) for key, item in value.items()}
        is_same = all(marked[key] is item for key, item in value.items())
    elif isinstance(value, list):
        marked = [mark_nulls(item) for item in value]
        is_same = all(map(operator.is_, marked, value))
    else:
        return value
    return value if is_same else marked


def _to_json(value: Any, take: Callable[[object], object]) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, default=take)


def _describe(arrays: Sequence[AnyArray]) -> str:
    """The JSON of the types and shapes; equal ones are one text in memory."""
    texts: dict[tuple[str, tuple[int, ...]], str] = {}
    described = []
    for array in arrays:
        name_and_shape = array.dtype.name, array.shape
        text = texts.get(name_and_shape)
        if text is None:
            pair = _NULL_TYPE if array is _NULL else name_and_shape
            text = texts[name_and_shape] = json.dumps(pair, separators=(",", ":"))
        described.append(text)
    return f"[{','.join(described)}]"


def _insert_arrays(tree: Any, arrays: Iterator[AnyArray]) -> Any:
    """The tree with the next array in place of each None; a marked null gives None."""
    if tree is None:
        array = next(arrays)
        return None if array is _NULL else array
    if isinstance(tree, dict):
        return {key: _insert_arrays(item, arrays) for key, item in tree.items()}
    if isinstance(tree, list):
        return [_insert_arrays(item, arrays) for item in tree]
    return tree
