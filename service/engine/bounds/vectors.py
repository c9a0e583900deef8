"""Arrays of which the last axis counts items: vectors of shape (…, 3, m), and records of arrays."""

from typing import Self, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints

Vectors: TypeAlias = FloatArray
"""Shape (…, 3, m)."""


def dot(a: Vectors, b: Vectors) -> FloatArray:
    """Products a · b, shape (…, m)."""
    product: FloatArray = a[..., 0, :] * b[..., 0, :]
    product += a[..., 1, :] * b[..., 1, :]
    product += a[..., 2, :] * b[..., 2, :]
    return product


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Products a × b, shape (…, 3, m)."""
    product = np.empty_like(a)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        product[..., k, :] = a[..., i, :] * b[..., j, :] - a[..., j, :] * b[..., i, :]
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
        """Some of the items."""
        return type(self)(*(getattr(self, name)[..., index] for name in self.__dataclass_fields__))

    @classmethod
    def concatenate(cls, parts: list[Self]) -> Self:
        """The items of several lists, one list after the other."""
        if len(parts) == 1:
            return parts[0]
        names = cls.__dataclass_fields__
        columns = ([getattr(part, name) for part in parts] for name in names)
        return cls(*(np.concatenate(column, axis=-1) for column in columns))
