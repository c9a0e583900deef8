"""Values of many arrays in the cache of plans, such as whole parts that are ready for questions."""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeVar, cast

import numpy as np

from service.bases.arrays import AnyArray
from service.bases.cache import MESH_PLANS

Result = TypeVar("Result")

OBJECT_BYTES = 300
"""The most bytes of an object and of the entries that refer to it, without numbers of arrays."""

GROWTH = 3
"""A value may take this many times its bytes later: some of its properties are computed when they
are first used, and are then kept."""


def keep(key: Hashable, build: Callable[[], Result]) -> Result:
    """The result of `build`, or that of an earlier call with an equal key, from the cache of plans.

    Parameters
    ----------
    key : hashable
        Equal keys must have equal results.
    build : callable
        Builds a dataclass, of arrays and dataclasses at any depth. All its arrays become read-only,
        because requests and threads share them.
    """
    kept = MESH_PLANS.get(key, lambda: _KeptValue.of(build()))
    return cast(Result, cast(_KeptValue, kept).value)


@dataclass(frozen=True, eq=False, slots=True)
class _KeptValue:
    """A value, and the bytes that it may take."""

    value: Any
    nbytes: int

    @classmethod
    def of(cls, value: object) -> "_KeptValue":
        """The value with its arrays made read-only."""
        arrays, count = find_arrays(value)
        for array in arrays:
            array.flags.writeable = False
        return cls(value, GROWTH * (OBJECT_BYTES * count + count_bytes(arrays)))


def find_arrays(value: object) -> tuple[list[AnyArray], int]:
    """All arrays to which a value refers, directly or through others, and the number of objects."""
    arrays, found, left = list[AnyArray](), dict[int, object](), [value]
    while left:
        each = left.pop()
        if id(each) in found:
            continue
        found[id(each)] = each
        if isinstance(each, np.ndarray):
            arrays.append(each)
        else:
            left += _list_parts(each)
    return arrays, len(found)


def count_bytes(arrays: Iterable[AnyArray]) -> int:
    """The bytes that arrays hold: those of whole arrays of which they are parts, each once."""
    owners: dict[int, int] = {}
    for array in arrays:
        owner = array
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        owners[id(owner)] = owner.nbytes
    return sum(owners.values())


def _list_parts(value: object) -> list[object]:
    """The items of a value, or its fields and the properties that it keeps."""
    if isinstance(value, tuple | list):
        return list(value)
    if isinstance(value, Mapping):
        return list(value.values())
    if is_dataclass(value):
        parts = [getattr(value, each.name) for each in fields(value)]
        return parts + list(getattr(value, "__dict__", {}).values())
    return []
