"""Halves Bézier nets and cells, and stores the nets of many cells in growing arrays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """K cells of nets of one degree.

    Attributes
    ----------
    nets : ndarray of float64, shape (K, p+1, q+1, 3 or 4)
        The nets over the cells.
    rectangle : ndarray of float64, shape (4, K)
        The rectangles [u₀, u₁] × [v₀, v₁] in the parameters of the net.
    point_sides : ndarray of bool, shape (4, K)
        Whether each of the sides u₀, u₁, v₀, v₁ is one point.
    parent : ndarray of int, shape (K,)
        The number of the cell of which each cell is a half or quarter; before halving, its own.
    """

    nets: FloatArray
    rectangle: FloatArray
    point_sides: Bools
    parent: Ints

    def halve(self, axes: Sequence[int]) -> "Cells":
        """Halve all cells along axes 0, 1 or both; the halves of one cell are consecutive."""
        cells = self
        for axis in axes:
            nets = np.stack(halve(cells.nets, axis + 1), axis=1).reshape(-1, *self.nets.shape[1:])
            rectangle, sides = (
                cells.rectangle.repeat(2, axis=1),
                cells.point_sides.repeat(2, axis=1),
            )
            middle = (cells.rectangle[2 * axis] + cells.rectangle[2 * axis + 1]) / 2
            # Even columns are lower halves, odd columns are upper halves. The lower half ends, and
            # the upper half begins, at the middle: rows 2 axis + 1 and 2 axis.
            for half in (0, 1):
                rectangle[2 * axis + 1 - half, half::2] = middle
                sides[2 * axis + 1 - half, half::2] = False
            cells = Cells(nets, rectangle, sides, cells.parent.repeat(2))
        return cells

    @staticmethod
    def join(parts: "Sequence[Cells]") -> "Cells":
        """The cells of all parts, one after another."""
        return Cells(
            np.concatenate([part.nets for part in parts]),
            np.concatenate([part.rectangle for part in parts], axis=1),
            np.concatenate([part.point_sides for part in parts], axis=1),
            np.concatenate([part.parent for part in parts]),
        )


class NetSpace:
    """The nets of cells of one degree, in an array with spare rows."""

    def __init__(self, nets: FloatArray) -> None:
        self.nets, self.count = nets, len(nets)

    def append(self, nets: FloatArray) -> Ints:
        """Add nets; returns their rows in the array."""
        end = self.count + len(nets)
        if end > len(self.nets):
            larger = np.empty((max(end, 2 * len(self.nets)), *nets.shape[1:]))
            larger[: self.count] = self.nets[: self.count]
            self.nets = larger
        self.nets[self.count : end] = nets
        rows = np.arange(self.count, end)
        self.count = end
        return rows


def halve(nets: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Halve nets (K, p+1, q+1, D) along axis 1 or 2: the nets of the lower and of the upper half.

    Each step averages two neighbours. So a net has the same bits at every position of a batch,
    which a matrix product does not ensure.
    """
    rows = np.moveaxis(nets, axis, 0)
    n = len(rows) - 1
    low, high = np.empty_like(nets), np.empty_like(nets)
    # Views, whose first axis is the one that is halved.
    low_rows, high_rows = np.moveaxis(low, axis, 0), np.moveaxis(high, axis, 0)
    low_rows[0], high_rows[n] = rows[0], rows[n]
    for k in range(1, n + 1):
        rows = rows[:-1] + rows[1:]
        rows *= 0.5
        low_rows[k], high_rows[n - k] = rows[0], rows[-1]
    return low, high
