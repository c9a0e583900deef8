"""Nets of cells about the middles of the cells, their partials, and bounds over each cell.

With c the middle of a cell, X = w (S − c) and w are Bézier nets, and

    S_u = (X_u − (S − c) w_u) / w

and likewise S_v. Without weights w = 1. All partials are by the parameters of the cell.

**Rounding.** Coordinates and weights are at most 1, u = 2⁻⁵³, n is the higher degree. A net that
was computed, halved L times and moved by c has control points with errors of at most

    ε = (24 n + 64 + (2 n + 6) L) u

in length. The reason is that a product with `halves` takes means of n + 1 numbers, with errors of
at most (n + 2) u in each of three coordinates, and that each of the n steps from a triangular to a
tensor-product net has an error of at most 12 u. The errors of differences of control points, times
n, are at most 2 n ε. At a node, the product of two bases has a relative error of at most 12 n u,
and the sum over both indices adds at most 2 (n + 2) u times the sum of absolute values. So the
error of a value of a net is at most ε + 16 (n + 2) u M, if the control vectors are at most M long.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.cells import Cells
from service.engine.vectors import UNIT

UPWARDS = 1 + 2.0**-40
"""A factor larger than the rounding of some hundred operations on non-negative numbers."""


@dataclass(frozen=True, eq=False, slots=True)
class Net:
    """A net (d, a+1, b+1, K), and bounds of the errors of its control points in length, (K,)."""

    values: FloatArray
    noise: FloatArray

    @property
    def largest(self) -> FloatArray:
        """An upper bound of the length of a value over each cell, (K,)."""
        return np.asarray(lengths(self.values).max(axis=(0, 1)) * UPWARDS + self.noise)


class CellNets:
    """X, w and their partials.

    Curves have no partials by v, and polynomial nets have no w. `noise` bounds the errors of
    control points before the rounding that ε includes.
    """

    def __init__(self, cells: Cells, noise: float = 0.0) -> None:
        p, q = self.degree = cells.degree
        nets = cells.nets
        n = max(p, q)
        errors = np.asarray((cells.depth * (2 * n + 6) + 24 * n + 64) * UNIT + noise, np.float64)
        total: FloatArray = np.add.reduce(nets, axis=(1, 2))
        center: FloatArray = total / ((p + 1) * (q + 1))
        self.w: Net | None = None
        self.w_partials: tuple[Net, ...] = ()
        if cells.is_rational:
            weights = nets[3:]
            center = total[:3] / total[3:]
            x = nets[:3] - center[:, np.newaxis, np.newaxis] * weights
            self.w = Net(weights, errors)
            self.w_partials = _partials(self.w, p, q)
        else:
            x = nets - center[:, np.newaxis, np.newaxis]
        self.center = center
        self.x = Net(x, errors)
        self.x_partials = _partials(self.x, p, q)

    @cached_property
    def least_weight(self) -> FloatArray:
        """A lower bound of w over each cell, (K,); it is positive."""
        if self.w is None:
            return np.ones(len(self.x.noise))
        # Means of positive numbers keep their relative errors.
        return np.asarray(self.w.values.min(axis=(0, 1, 2)) * (1 - 2.0**-30))

    @cached_property
    def reach(self) -> FloatArray:
        """An upper bound of |S − c| over each cell, (K,)."""
        return np.asarray(self.x.largest / self.least_weight * UPWARDS)

    @cached_property
    def stretches(self) -> tuple[FloatArray, ...]:
        """Upper bounds of |S_u| and of |S_v| over each cell, (K,)."""
        if self.w is None:
            return tuple(net.largest for net in self.x_partials)
        return tuple(
            (x.largest + self.reach * w.largest) / self.least_weight * UPWARDS
            for x, w in zip(self.x_partials, self.w_partials, strict=True)
        )


def lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (d, …), d = 1 or 3."""
    if len(vectors) == 1:
        return np.asarray(np.abs(vectors[0]))
    squares = vectors[0] * vectors[0]
    squares += vectors[1] * vectors[1]
    squares += vectors[2] * vectors[2]
    return np.asarray(np.sqrt(squares, out=squares))


def _partials(net: Net, p: int, q: int) -> tuple[Net, ...]:
    """The nets of the partials by u and, for surfaces, by v."""
    return tuple(
        Net(np.diff(net.values, axis=axis) * degree, 2 * degree * net.noise)
        for axis, degree in ((1, p), (2, q))[: 2 if q else 1]
    )
