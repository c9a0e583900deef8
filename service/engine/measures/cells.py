"""Cells: rectangles of the parameters of patches, which are halved to make integrals precise.

Cells are the last axis of every array, so that one matrix product computes all cells.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.measures.tables import halves
from service.engine.nets.query_nets import QueryNets


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
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
    noise : float
        A bound of the errors of control points by lowering, placing and joining.
    """

    nets: FloatArray
    patch: Ints
    depth: Ints
    noise: float = 0.0

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

    def take(self, rows: Ints | Bools | slice) -> "Cells":
        """The cells with these rows."""
        return Cells(self.nets[..., rows], self.patch[rows], self.depth[rows], self.noise)

    def halve(self, axis: int) -> "Cells":
        """Both halves of every cell, along u (axis 0) or v (axis 1): first halves come first."""
        d, rows, columns, count = self.nets.shape
        nets = along(halves(self.degree[axis]), self.nets, axis)
        shape = (d, 2, rows, columns, count) if axis == 0 else (d, rows, 2, columns, count)
        ordered = np.moveaxis(nets.reshape(shape), 1 + axis, 3)
        patch, depth = np.tile(self.patch, 2), np.tile(self.depth + 1, 2)
        return Cells(ordered.reshape(d, rows, columns, 2 * count), patch, depth, self.noise)

    @staticmethod
    def join(parts: "list[Cells]") -> "Cells":
        """Cells of one degree, one after another."""
        return Cells(
            np.concatenate([part.nets for part in parts], axis=3),
            np.concatenate([part.patch for part in parts]),
            np.concatenate([part.depth for part in parts]),
            parts[0].noise,
        )


def along(matrix: FloatArray, nets: FloatArray, axis: int) -> FloatArray:
    """Multiply nets (d, a, b, K) by a matrix (m, n), along the axis a (0) or b (1)."""
    d, rows, columns, count = nets.shape
    if axis == 0:
        return (matrix @ nets.reshape(d, rows, -1)).reshape(d, -1, columns, count)
    return (matrix @ nets.reshape(-1, columns, count)).reshape(d, rows, -1, count)


def group_cells(nets: QueryNets, noise: float, patches: Bools | None = None) -> list[Cells]:
    """The nets of a model as cells, one group for each degree.

    `noise` is in model units. `patches` (P,) says which patches are taken, by default all.
    """
    groups = []
    for group in nets.groups:
        patch = nets.patch[group.first : group.first + len(group.nets)]
        rows = np.arange(len(patch)) if patches is None else np.flatnonzero(patches[patch])
        if len(rows):
            groups.append(cells_of(group.nets[rows], patch[rows], noise / nets.scale))
    return groups


def cells_of(nets: FloatArray, patch: Ints, noise: float) -> Cells:
    """Nets (K, p+1, q+1, d) as cells that are not halved yet.

    Homogeneous nets are divided by powers of two, so that weights are as `Cells` requires.
    """
    ordered = np.ascontiguousarray(nets.transpose(3, 1, 2, 0))
    if len(ordered) == 4:
        _, exponent = np.frexp(ordered[3].max(axis=(0, 1)))
        ordered = np.ldexp(ordered, -exponent)
    return Cells(ordered, patch, np.zeros(len(patch), np.intp), noise)
