"""The records of cells: rectangles of parameters, which queries and meshes halve.

A room of the engine derives its cells from one of the two classes here, and adds the arrays that it
needs as fields. `take`, `join` and `replace` then treat all fields alike. Of every field the
last axis counts the cells.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.nets.subdivision import halve
from service.engine.vectors import Items


@dataclass(frozen=True, eq=False, slots=True)
class Cells(Items):
    """K cells without nets.

    Attributes
    ----------
    rectangle : ndarray, shape (4, K)
        The rectangles [u₀, u₁] × [v₀, v₁], as rows u₀, u₁, v₀, v₁: of float64 for parameters, of
        integers for places. A subclass names the one that it has.
    """

    rectangle: FloatArray | Ints

    def __len__(self) -> int:
        return len(self.rectangle[0])

    def cut(self, along_v: Bools | bool, middle: FloatArray | Ints) -> tuple[Self, Self]:
        """The lower and the upper parts of all cells; both keep all other fields.

        Where `along_v` is true, v is cut at `middle` (K,); elsewhere u is.
        """
        lower, upper = self.rectangle.copy(), self.rectangle.copy()
        for axis, is_cut in enumerate((np.logical_not(along_v), along_v)):
            np.copyto(lower[2 * axis + 1], middle, where=is_cut)
            np.copyto(upper[2 * axis], middle, where=is_cut)
        return replace(self, rectangle=lower), replace(self, rectangle=upper)


@dataclass(frozen=True, eq=False, slots=True)
class NetCells(Cells):
    """K cells with nets of one degree (p, q).

    Attributes
    ----------
    nets : ndarray of float64, shape (p+1, q+1, …, K)
        The nets over the cells. For points there is a third axis of 3 or, for homogeneous points, 4
        coordinates.
    """

    nets: FloatArray

    def halve(self, axis: int) -> tuple[Self, Self]:
        """The lower and the upper halves of all cells, along u (axis 0) or v (axis 1)."""
        low, high = self.rectangle[2 * axis : 2 * axis + 2]
        middle = (low + high) // 2 if self.rectangle.dtype.kind == "i" else (low + high) / 2
        halves = np.empty((*self.nets.shape[:-1], 2, len(self)))
        halve(self.nets, axis, halves)
        lower, upper = self.cut(axis == 1, middle)
        return replace(lower, nets=halves[..., 0, :]), replace(upper, nets=halves[..., 1, :])

    def halve_along(self, axes: Sequence[int]) -> Self:
        """All cells, halved along one or both axes; the 2 or 4 parts of a cell follow each other.

        The upper half along the first axis comes after the lower one, with all of its parts.
        """
        parts = [self]
        for axis in axes:
            parts = [half for part in parts for half in part.halve(axis)]
        fields = ([getattr(part, name) for part in parts] for name in self.__dataclass_fields__)
        columns = (np.stack(arrays, axis=-1) for arrays in fields)
        return type(self)(*(column.reshape(*column.shape[:-2], -1) for column in columns))
