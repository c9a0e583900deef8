"""Arrays of which the last axis counts items: vectors of shape (…, 3, m), and records of arrays."""

from typing import Self, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints

Vectors: TypeAlias = FloatArray
"""Shape (…, 3, m)."""

NEXT, BEFORE = np.array([1, 2, 0]), np.array([2, 0, 1])
"""For each of three coordinates, or corners or edges of a triangle: the next and the one before."""


def dot(a: Vectors, b: Vectors) -> FloatArray:
    """Products a · b, shape (…, m)."""
    products = a * b
    total: FloatArray = products[..., 0, :] + products[..., 1, :]
    total += products[..., 2, :]
    return total


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Products a × b, shape (…, 3, m)."""
    product = a.take(NEXT, axis=-2)
    product *= b.take(BEFORE, axis=-2)
    product -= a.take(BEFORE, axis=-2) * b.take(NEXT, axis=-2)
    return product


def length(a: Vectors) -> FloatArray:
    """Lengths |a|, shape (…, m)."""
    size: FloatArray = np.sqrt(dot(a, a))
    return size


class Columns:
    """Base of frozen data classes whose fields are arrays (…, m) of the same m items."""

    __slots__ = ()
    __dataclass_fields__: dict[str, object]

    def take(self, index: Ints | Bools | slice) -> Self:
        """The items with these indices, or those that a mask marks."""
        columns = (getattr(self, name) for name in self.__dataclass_fields__)
        if isinstance(index, slice):
            return type(self)(*(column[..., index] for column in columns))
        rows = index.nonzero()[0] if index.dtype == bool else index
        return type(self)(*(column.take(rows, axis=-1) for column in columns))

    @classmethod
    def concatenate(cls, parts: list[Self]) -> Self:
        """The items of several lists, one list after the other."""
        if len(parts) == 1:
            return parts[0]
        names = cls.__dataclass_fields__
        columns = ([getattr(part, name) for part in parts] for name in names)
        return cls(*(np.concatenate(column, axis=-1) for column in columns))
