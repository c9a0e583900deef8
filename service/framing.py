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
from collections.abc import Iterator, Mapping
from math import prod
from typing import Any, TypeAlias

import numpy as np

from service.bases.arrays import AnyArray

Arrays: TypeAlias = list[AnyArray]

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
    arrays: Arrays = []
    tree = _take_arrays(tree, arrays)
    types_and_shapes = [
        _NULL_TYPE if array is _NULL else [array.dtype.name, array.shape] for array in arrays
    ]
    header = json.dumps(
        {"arrays": types_and_shapes, **members, name: tree},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    numbers = (
        np.ascontiguousarray(array, dtype=_TYPES[array.dtype.name]).data
        for array in arrays
        if array is not _NULL
    )
    return b"".join([header.encode("ascii"), b"\n", *numbers])


def read_frame(name: str, frame: bytes) -> dict[str, Any]:
    """The header of a frame, with the arrays in its member `name`: views of `frame`.

    Raises
    ------
    Any of `UNREADABLE`
        The bytes are not a frame.
    """
    end = frame.index(b"\n")
    header: dict[str, Any] = json.loads(frame[:end])
    arrays: Arrays = []
    start = end + 1
    for type_name, shape in header["arrays"]:
        if min(shape, default=0) < 0:
            raise ValueError("an axis of negative length")
        if [type_name, shape] == _NULL_TYPE:
            arrays.append(_NULL)
            continue
        flat = np.frombuffer(frame, _TYPES[type_name], prod(shape), start)
        arrays.append(flat.reshape(shape))
        start += flat.nbytes
    remaining_arrays = iter(arrays)
    header[name] = _insert_arrays(header[name], remaining_arrays)
    if start != len(frame) or next(remaining_arrays, None) is not None:
        raise ValueError("more numbers than the header names")
    return header


def mark_nulls(value: Any) -> Any:
    """The value with a mark in place of each None, which `read_frame` turns into None again."""
    if isinstance(value, dict):
        return {key: mark_nulls(item) for key, item in value.items()}
    if isinstance(value, list):
        return [mark_nulls(item) for item in value]
    return _NULL if value is None else value


def _take_arrays(value: Any, arrays: Arrays) -> Any:
    """The value with None in place of each array; appends the arrays to `arrays`, in this order."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return None
    if isinstance(value, Mapping):
        return {key: _take_arrays(value[key], arrays) for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [_take_arrays(item, arrays) for item in value]
    return value


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
