"""Cells, which are boxes of places of a face, and leaves, which are cells that need no cut."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.limits import build_depth_error
from service.engine.bounds.faces import SPAN, Faces

SHORTEST = 16
"""Least side of a cell, in units of places: a corner may be lifted by a share of it."""


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Boxes of places: `face` (m,) and `box` (4, m), the rows u0, u1, v0, v1."""

    face: Ints
    box: Ints

    def __len__(self) -> int:
        return len(self.face)

    def take(self, index: Ints | Bools | slice) -> "Cells":
        """Some of the cells."""
        return Cells(self.face[index], self.box[:, index])

    @classmethod
    def concatenate(cls, parts: list["Cells"]) -> "Cells":
        """Cells of several lists, one list after the other."""
        return cls(
            np.concatenate([part.face for part in parts]),
            np.concatenate([part.box for part in parts], axis=1),
        )

    def halve(self, along_v: Bools) -> tuple["Cells", "Cells"]:
        """First and second halves: v is halved where `along_v`, u elsewhere; at a knot, if any."""
        low = np.where(along_v, self.box[2], self.box[0])
        high = np.where(along_v, self.box[3], self.box[1])
        knot = (low // SPAN + high // SPAN) // 2 * SPAN
        middle = np.where(high - low > SPAN, knot, (low + high) // 2)
        if (np.minimum(middle - low, high - middle) < SHORTEST).any():
            raise build_depth_error()
        first, second = self.box.copy(), self.box.copy()
        first[1] = np.where(along_v, first[1], middle)
        first[3] = np.where(along_v, middle, first[3])
        second[0] = np.where(along_v, second[0], middle)
        second[2] = np.where(along_v, middle, second[2])
        return Cells(self.face, first), Cells(self.face, second)


@dataclass(frozen=True, eq=False, slots=True)
class Leaves:
    """Cells that are near enough to two triangles.

    Attributes
    ----------
    cells : Cells
    along_v, rising, form
        See `estimate.CellEstimates`; `along_v` is used if the leaf is cut after all.
    """

    cells: Cells
    along_v: Bools
    rising: Bools
    form: FloatArray

    def __len__(self) -> int:
        return len(self.along_v)

    def take(self, index: Ints | Bools) -> "Leaves":
        """Some of the leaves."""
        return Leaves(
            self.cells.take(index), self.along_v[index], self.rising[index], self.form[:, index]
        )

    @classmethod
    def empty(cls) -> "Leaves":
        """No leaves at all."""
        box = np.empty((4, 0), dtype=np.intp)
        no = np.zeros(0, dtype=bool)
        return cls(Cells(box[0], box), no, no, np.empty((7, 0)))

    @classmethod
    def concatenate(cls, parts: list["Leaves"]) -> "Leaves":
        """Leaves of several lists, one list after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            Cells.concatenate([part.cells for part in parts]),
            np.concatenate([part.along_v for part in parts]),
            np.concatenate([part.rising for part in parts]),
            np.concatenate([part.form for part in parts], axis=1),
        )

    @classmethod
    def merge(cls, parts: list["Leaves"]) -> "Leaves":
        """Leaves of several lists, in the order of face, u0, v0."""
        leaves = cls.concatenate(parts)
        box = leaves.cells.box
        return leaves.take(np.lexsort((box[2], box[0], leaves.cells.face)))


def build_whole_cells(faces: Faces) -> Cells:
    """One cell for each face."""
    none = np.zeros(len(faces.first), dtype=np.intp)
    high = faces.spans * SPAN
    return Cells(np.arange(len(faces.first)), np.array([none, high[:, 0], none, high[:, 1]]))
