"""Arrays of vectors: products and lengths; records of arrays of items; the unit of rounding.

By convention the last axis of an array counts items, and the axis before it counts coordinates:
vectors have the shape (…, 3, m). Functions take other layouts with `axis`, the axis of coordinates
counted from the end: −1 for rows (…, 3), −3 for (3, r, n). Terms are added in the order x, y, z, so
the bits of a result depend neither on the layout nor on the other vectors of an array.
"""

from collections.abc import Sequence
from functools import cache
from types import EllipsisType
from typing import Self, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints

Vectors: TypeAlias = FloatArray
"""Shape (…, 3, m)."""

Index: TypeAlias = tuple[int | slice | EllipsisType, ...]

UNIT = 2.0**-53
"""The unit roundoff u of float64: the relative error of one operation is at most u."""

NEXT, BEFORE = np.array([1, 2, 0]), np.array([2, 0, 1])
"""For each of three coordinates, or corners or edges of a triangle: the next and the one before."""

FEW = 1 << 14
"""`cross` computes up to this many numbers at once: with few NumPy calls, but with more memory."""


def dot(a: FloatArray, b: FloatArray, axis: int = -2) -> FloatArray:
    """Products a · b of vectors with any number of coordinates; the result lacks that axis."""
    products = a * b
    coordinates = _coordinates(axis, products.shape[axis])
    total: FloatArray = products[coordinates[0]]
    if len(coordinates) > 1:
        total = total + products[coordinates[1]]
        for coordinate in coordinates[2:]:
            total += products[coordinate]
    return total


def cross(a: FloatArray, b: FloatArray, axis: int = -2) -> FloatArray:
    """Products a × b of vectors of space, faster than `numpy.cross`."""
    if a.size <= FEW:
        product: FloatArray = a.take(NEXT, axis) * b.take(BEFORE, axis)
        product -= a.take(BEFORE, axis) * b.take(NEXT, axis)
        return product
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    x, y, z = _coordinates(axis, 3)
    for i, j, k in ((x, y, z), (y, z, x), (z, x, y)):
        np.subtract(a[j] * b[k], a[k] * b[j], out=product[i])
    return product


def length(a: FloatArray, axis: int = -2) -> FloatArray:
    """Lengths |a|; the result lacks the axis of coordinates."""
    return np.sqrt(dot(a, a, axis))


def normalize(a: FloatArray, axis: int = -2) -> FloatArray:
    """Unit vectors a / |a|; vectors of length 0 stay 0."""
    lengths = np.expand_dims(length(a, axis), axis)
    return a / np.where(lengths > 0, lengths, 1.0)


def project(points: FloatArray, axis: int = -2, dimension: int = 3) -> FloatArray:
    """Divide homogeneous points (w x, w y, w z, w) by their weights; others stay as they are.

    `dimension` is the number of coordinates that are not weights.
    """
    if points.shape[axis] == dimension:
        return points
    rest: Index = (slice(None),) * (-1 - axis)
    inner: Index = (..., slice(dimension), *rest)
    weights: Index = (..., slice(dimension, dimension + 1), *rest)
    return points[inner] / points[weights]


@cache
def _coordinates(axis: int, count: int) -> list[Index]:
    """The indices of the coordinates of vectors, of which `axis` counts `count` coordinates."""
    return [(..., k, *(slice(None),) * (-1 - axis)) for k in range(count)]


class Items:
    """Base of frozen data classes whose fields are arrays (…, m) of the same m items."""

    __slots__ = ()
    __dataclass_fields__: dict[str, object]

    def take(self, index: Ints | Bools | slice) -> Self:
        """The items with these indices, or those that a mask marks."""
        names = self.__dataclass_fields__
        if isinstance(index, slice):
            return type(self)(*[getattr(self, name)[..., index] for name in names])
        if index.dtype == bool and index.all():
            return self
        rows = index.nonzero()[0] if index.dtype == bool else index
        return type(self)(*[getattr(self, name).take(rows, axis=-1) for name in names])

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """The items of several records, one record after the other."""
        if len(parts) == 1:
            return parts[0]
        names = cls.__dataclass_fields__
        return cls(
            *[np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names]
        )
