"""Cells, which are boxes of places of a face, and leaves, which are cells that need no cut."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.limits import build_depth_error
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.vectors import Columns

SHORTEST = 16
"""Least side of a cell, in units of places: a corner may be lifted by a share of it."""


@dataclass(frozen=True, eq=False, slots=True)
class Cells(Columns):
    """Boxes of places: `face` (m,) and `box` (4, m), the rows u0, u1, v0, v1."""

    face: Ints
    box: Ints

    def __len__(self) -> int:
        return len(self.face)

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
class Leaves(Cells):
    """m cells that are estimated to be near enough to two triangles, or candidates for them.

    Attributes
    ----------
    along_v : ndarray of bool, shape (m,)
        The direction of a cut, if there is one: v is halved, not u.
    rising : ndarray of bool, shape (m,)
        Whether the diagonal (0, 0)–(1, 1) is better than (1, 0)–(0, 1).
    form : ndarray of float64, shape (7, m)
        The cell as a quadratic surface over [0, 1]². Rows E, F, G: the squared length of a step
        (du, dv) is E du² + 2 F du dv + G dv². Rows a, b, c: the height of the surface over the
        middle of a chord (du, dv) is a du² + 2 b du dv + c dv². The last row is the allowed
        deviation.
    """

    along_v: Bools
    rising: Bools
    form: FloatArray


def build_whole_cells(faces: Faces) -> Cells:
    """One cell for each face."""
    none = np.zeros(len(faces.first), dtype=np.intp)
    high = faces.spans * SPAN
    return Cells(np.arange(len(faces.first)), np.array([none, high[:, 0], none, high[:, 1]]))
