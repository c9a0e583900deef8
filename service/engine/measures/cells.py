"""Cells of patches and of borders, their nets and partials, and bounds over each cell.

Cells are halved to make integrals precise. They are the last axis of every array, and coordinates
are the first one, so that one matrix product computes all cells.

With c the middle of a cell, X = w (S − c) and w are Bézier nets, and

    S_u = (X_u − (S − c) w_u) / w

and likewise S_v. Without weights w = 1. All partials are by the parameters of the cell.

Proof of the rounding in docs/proofs.md: "Rounding of nets in measures".
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import binomials
from service.bases.cache import BASES
from service.engine.vectors import UNIT, Items, length

UPWARDS = 1 + 2.0**-40
"""A factor larger than the rounding of some hundred operations on non-negative numbers."""


@dataclass(frozen=True, eq=False, slots=True)
class MeasuredCells(Items):
    """K cells of degree (p, q); q = 0 for pieces of curves, which have one parameter.

    Attributes
    ----------
    nets : ndarray of float64, shape (d, p+1, q+1, K)
        d = 3, or d = 4 for homogeneous coordinates (w x, w y, w z, w). The largest weight of each
        patch is at least ½ and less than 1; coordinates are at most 1.
    patch : ndarray of int, shape (K,)
        Number of the patch.
    depth : ndarray of int, shape (K,)
        Number of halvings of each cell.
    point_error : ndarray of float64, shape (K,)
        Bounds of the errors of control points by lowering, placing and joining.
    """

    nets: FloatArray
    patch: Ints
    depth: Ints
    point_error: FloatArray

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return self.nets.shape[1] - 1, self.nets.shape[2] - 1

    @property
    def is_rational(self) -> bool:
        """Whether the nets have weights."""
        return len(self.nets) == 4

    @property
    def size(self) -> int:
        """Number of control points of all cells."""
        return int(np.prod(self.nets.shape[1:]))

    def __len__(self) -> int:
        return len(self.patch)

    def halve(self, axis: int) -> Self:
        """Both halves of every cell, along u (axis 0) or v (axis 1): first halves come first.

        One matrix product is faster here than `nets.subdivision.halve`, which takes means step by
        step: with it the measures of a sphere or of a goblet take 10 to 25 % longer.
        """
        d, rows, columns, count = self.nets.shape
        nets = along(build_halving_matrix(self.degree[axis]), self.nets, axis)
        shape = (d, 2, rows, columns, count) if axis == 0 else (d, rows, 2, columns, count)
        ordered = np.moveaxis(nets.reshape(shape), 1 + axis, 3)
        nets = ordered.reshape(d, rows, columns, 2 * count)
        patch, depth = np.tile(self.patch, 2), np.tile(self.depth + 1, 2)
        return type(self)(nets, patch, depth, np.tile(self.point_error, 2))


def along(matrix: FloatArray, nets: FloatArray, axis: int) -> FloatArray:
    """Multiply nets (d, a, b, K) by a matrix (m, n), along the axis a (0) or b (1)."""
    d, rows, columns, count = nets.shape
    if axis == 0:
        return (matrix @ nets.reshape(d, rows, -1)).reshape(d, -1, columns, count)
    return (matrix @ nets.reshape(-1, columns, count)).reshape(d, rows, -1, count)


def build_halving_matrix(degree: int) -> FloatArray:
    """The matrix (2 (n+1), n+1) that halves a net: it gives the nets over [0, ½] and over [½, 1].

    Row j of the first half has the factors C(j, k) / 2^j of the control points k; the second half
    is its mirror image.
    """

    def build() -> FloatArray:
        lower = np.zeros((degree + 1, degree + 1))
        for j in range(degree + 1):
            lower[j, : j + 1] = np.ldexp(binomials(j), -j)
        return np.concatenate([lower, lower[::-1, ::-1]])

    return BASES.array(("halves", degree), build)


@dataclass(frozen=True, eq=False, slots=True)
class Net:
    """A net (d, a+1, b+1, K), and bounds of the errors of its control points in length, (K,)."""

    values: FloatArray
    error: FloatArray

    @property
    def largest(self) -> FloatArray:
        """An upper bound of the length of a value over each cell, (K,)."""
        return np.asarray(lengths(self.values).max(axis=(0, 1)) * UPWARDS + self.error)


class CellNets:
    """X, w and their partials.

    Curves have no partials by v, and polynomial nets have no w. `point_error` bounds the errors
    of control points before the rounding that ε includes.
    """

    def __init__(self, cells: MeasuredCells, point_error: FloatArray | float = 0.0) -> None:
        p, q = self.degree = cells.degree
        nets = cells.nets
        n = max(p, q)
        errors = np.asarray((cells.depth * (2 * n + 6) + 24 * n + 64) * UNIT + point_error)
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
            return np.ones(len(self.x.error))
        # Means of positive numbers keep their relative errors.
        return np.asarray(self.w.values.min(axis=(0, 1, 2)) * (1 - 2.0**-30))

    @cached_property
    def radius(self) -> FloatArray:
        """An upper bound of |S − c| over each cell, (K,)."""
        return np.asarray(self.x.largest / self.least_weight * UPWARDS)

    @cached_property
    def stretches(self) -> tuple[FloatArray, ...]:
        """Upper bounds of |S_u| and of |S_v| over each cell, (K,)."""
        if self.w is None:
            return tuple(net.largest for net in self.x_partials)
        return tuple(
            (x.largest + self.radius * w.largest) / self.least_weight * UPWARDS
            for x, w in zip(self.x_partials, self.w_partials, strict=True)
        )


def lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (d, …), d = 1 or 3."""
    if len(vectors) == 1:
        return np.asarray(np.abs(vectors[0]))
    return length(vectors, -vectors.ndim)


def _partials(net: Net, p: int, q: int) -> tuple[Net, ...]:
    """The nets of the partials by u and, for surfaces, by v."""
    return tuple(
        Net(np.diff(net.values, axis=axis) * degree, 2 * degree * net.error)
        for axis, degree in ((1, p), (2, q))[: 2 if q else 1]
    )
