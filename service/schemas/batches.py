"""Checks of many JSON values of one kind at once, without a Python call for each value.

`Unreadable` says that some value is wrong, and not which: the caller then finds the first item with
a wrong value, and the model of this item words the error.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, TypeAlias

import numpy as np
from pydantic import TypeAdapter, ValidationError

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import count_runs
from service.schemas.fields import Name
from service.schemas.validation import MAX_INDEX
from service.surface.spline_tables import find_starts

Items: TypeAlias = Sequence[Any]
Objects: TypeAlias = Sequence[Mapping[str, Any]]

_NAMES: TypeAdapter[list[str]] = TypeAdapter(list[Name])
_NUMBER = frozenset({int, float})
_LISTS = frozenset({list, np.ndarray})


class Unreadable(Exception):
    """An item does not have the form that it needs."""


def require(condition: object) -> None:
    """Raise `Unreadable` unless the condition is true."""
    if not condition:
        raise Unreadable


def require_type(items: Iterable[Any], kind: type) -> None:
    """Raise `Unreadable` unless all items have this type."""
    require(set(map(type, items)) <= {kind})


def require_keys(items: Objects, keys: frozenset[str]) -> frozenset[str]:
    """The keys that the objects have; raises `Unreadable` unless all are among `keys`."""
    require_type(items, dict)
    used: frozenset[str] = frozenset().union(*items)
    require(used <= keys)
    return used


def take(items: Objects, key: str) -> list[Any]:
    """The values of one key in all objects, which must have it."""
    try:
        return [item[key] for item in items]
    except KeyError:
        raise Unreadable from None


def read_names(names: list[Any]) -> list[str]:
    """Names, as the models of surfaces accept them."""
    try:
        return _NAMES.validate_python(names, strict=True)
    except ValidationError:
        raise Unreadable from None


def read_numbers(values: Items) -> FloatArray:
    """Numbers as an array, (n,)."""
    require(set(map(type, values)) <= _NUMBER)
    return np.fromiter(values, np.float64, len(values))


def read_distances(values: Items) -> FloatArray:
    """Numbers that are not negative, (n,)."""
    distances = read_numbers(values)
    require((distances >= 0).all() and np.isfinite(distances).all())
    return distances + 0.0  # −0 becomes 0


def read_indices(values: Items) -> Ints:
    """Whole numbers as an array, (n,)."""
    require_type(values, int)
    require(max(map(abs, values), default=0) <= MAX_INDEX)
    return np.fromiter(values, np.intp, len(values))


def read_nets(nets: Items, levels: int, width: int | None) -> tuple[FloatArray, Ints]:
    """Nested lists of numbers, or arrays of such shapes, as one array.

    Parameters
    ----------
    nets : sequence of nested lists, or of ndarray
    levels : int
        Levels of lists that each net has: 1 for polygons, 2 for nets.
    width : int or None
        Numbers of a point; None if the nets have numbers in place of points.

    Returns
    -------
    numbers : ndarray of float64, shape (Σ points, width) or (Σ points,)
    counts : ndarray of int, shape (len(nets), levels)
        Lengths of the lists of each level; all lists of one level in one net are equally long.
    """
    kinds = set(map(type, nets))
    require(kinds <= _LISTS)
    if kinds == {np.ndarray}:
        return _join_arrays(nets, levels, width)
    items: list[Any] = [net.tolist() if isinstance(net, np.ndarray) else net for net in nets]
    counts = np.empty((len(items), levels), np.intp)
    first = np.arange(len(items))  # the position of the first list of each net
    for level in range(levels):
        require_type(items, list)
        lengths = np.fromiter(map(len, items), np.intp, len(items))
        counts[:, level] = lengths[first]
        require(lengths.all())
        if level:
            sizes = count_runs(first, len(items))
            require((lengths == counts[:, level].repeat(sizes)).all())
        if level + 1 < levels:
            first = find_starts(lengths)[first]
        items = list(chain.from_iterable(items))
    if width is None:
        return read_numbers(items), counts
    require_type(items, list)
    require(set(map(len, items)) <= {width})
    return read_numbers(list(chain.from_iterable(items))).reshape(-1, width), counts


def _join_arrays(nets: Items, levels: int, width: int | None) -> tuple[FloatArray, Ints]:
    """`read_nets` of arrays."""
    tail = () if width is None else (width,)
    require(all(net.ndim == levels + len(tail) and net.shape[levels:] == tail for net in nets))
    require(all(net.size and net.dtype.kind in "iuf" and net.itemsize <= 8 for net in nets))
    numbers = np.concatenate([net.reshape(-1, *tail) for net in nets]).astype(
        np.float64, copy=False
    )
    require(np.isfinite(numbers).all())
    return numbers, np.array([net.shape[:levels] for net in nets], np.intp)
