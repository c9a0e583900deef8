"""Connectivity: which sides of patches are one edge, which corners are one point, and poles.

It depends on which control points are equal, and not on their coordinates. So it is found once for
a pattern of equal points (`service.engine.mesh.seams`), and everything that follows from it and
from the resolution is planned once (`service.engine.mesh.layout`, `service.engine.mesh.plans`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, Ints
from service.bases.unique_rows import unique_rows
from service.surface.batches import Patches, TrianglePatches
from service.surface.sides import BEGINS, ENDS

SAME_WEIGHT = 2.0**-44
"""The largest difference of the weights of one edge on its two sides, after division by the largest
weight: a common factor changes their last digits."""

EQUAL_WEIGHT = 2.0**-50
"""The largest difference of weights that count as equal if all other weights of their edge are
equal: a few roundings."""


@dataclass(frozen=True, eq=False)
class Connectivity:
    """The shared edges and corners of the P patches of a model.

    Attributes
    ----------
    counts : tuple of int
        Patches of each batch.
    is_triangle : ndarray of bool, shape (P,)
        Which patches are triangles.
    edge : ndarray of int, shape (P, 4)
        Number of the distinct edge of each side (sides: `service.surface.sides`).
    backward : ndarray of bool, shape (P, 4)
        Whether the side runs against the direction of its edge.
    collapsed : ndarray of bool, shape (P, 4)
        Whether the side is one point.
    corner : ndarray of int, shape (P, 4)
        Number of the distinct point at each corner.
    users : ndarray of int, shape (E,)
        The number of sides of each edge; an edge with 1 side is on the border of the model.
    corners : int
        Distinct points at corners, C.
    """

    counts: tuple[int, ...]
    is_triangle: Bools
    edge: Ints
    backward: Bools
    collapsed: Bools
    corner: Ints
    users: Ints
    corners: int

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        arrays = (self.is_triangle, self.edge, self.backward, self.collapsed, self.corner)
        return sum(array.nbytes for array in (*arrays, self.users))

    @cached_property
    def key(self) -> bytes:
        """A key, equal for two connectivities if and only if they are equal."""
        return hash_arrays(
            np.array([len(self.counts), *self.counts]),
            self.is_triangle,
            self.edge,
            self.backward,
            self.collapsed,
            self.corner,
        )

    @cached_property
    def is_joined(self) -> bool:
        """Whether two sides of any patches are one edge."""
        return bool((self.users > 1).any())

    @cached_property
    def open_lines(self) -> Bools:
        """Which edges are lines with only one side, shape (E,)."""
        lines = np.zeros(len(self.users), dtype=bool)
        lines[self.edge[~self.collapsed]] = True
        lines &= self.users == 1
        return lines

    @cached_property
    def open_count(self) -> int:
        """The number of lines with only one side."""
        return int(np.count_nonzero(self.open_lines))

    @cached_property
    def border_returns(self) -> bool:
        """Whether more than two open lines end at one corner."""
        sides = self.open_lines[self.edge] & ~self.collapsed
        ends = np.concatenate([self.corner[:, which][sides] for which in (BEGINS, ENDS)])
        return bool((np.bincount(ends) > 2).any())

    @cached_property
    def is_folded(self) -> bool:
        """Whether two sides of a patch are one edge."""
        ordered = np.sort(self.edge, axis=1)
        return bool((ordered[:, 1:] == ordered[:, :-1]).any())

    @cached_property
    def thin_sides(self) -> Ints:
        """For each patch a side that is one point while the two beside it are one edge, (P,).

        −1 stands for no such side. On a tensor-product patch the opposite side is a point, too: the
        number is 0 or 2. Such a patch may be a curve (`service.engine.mesh.curve_patches`).
        """
        thin_side = np.full(len(self.edge), -1)
        for is_triangle, table in ((False, BESIDE_OF_GRID), (True, BESIDE_OF_TRIANGLE)):
            for side, (one, other) in table.items():
                is_thin = self.collapsed[:, side] & (self.edge[:, one] == self.edge[:, other])
                if not is_triangle:
                    is_thin &= self.collapsed[:, side + 1]
                thin_side[is_thin & (self.is_triangle == is_triangle)] = side
        return thin_side

    @cached_property
    def has_thin(self) -> bool:
        """Whether any patch may be a curve."""
        return bool((self.thin_sides >= 0).any())

    @cached_property
    def cut_corners(self) -> Ints:
        """Corners of patches that a line of the mesh cuts off: the ends of that line, (P, 3, 2).

        The line joins the samples next to the corner on both sides. Each of its ends is the number
        of the edge, times two, plus 1 if the corner is at the end of the edge. On a grid the
        diagonals cut off the corners (0, 0) and (1, 1), and -1 fills the third place. A triangle
        has a small triangle at each corner.
        """
        is_grid = ~self.is_triangle[:, None, None]
        sides = np.where(is_grid, GRID_CORNERS[0], TRIANGLE_CORNERS[0])
        at_end = np.where(is_grid, GRID_CORNERS[1], TRIANGLE_CORNERS[1])
        places = np.arange(len(self.edge))[:, None, None], sides
        lines: Ints = 2 * self.edge[places] + (at_end ^ self.backward[places])
        lines.sort(axis=2)
        lines[~self.is_triangle, 2] = -1
        return lines

    @cached_property
    def twice_cut(self) -> Bools:
        """Which of the `cut_corners`, between two lines, belong to several patches: (P, 3)."""
        _, number = unique_rows(self.cut_corners.reshape(-1, 2).astype(np.float64))
        several: Bools = (np.bincount(number)[number] > 1).reshape(-1, 3)
        points = np.zeros(len(self.users), dtype=bool)
        points[self.edge[self.collapsed]] = True
        several &= self.cut_corners[..., 0] >= 0
        several &= ~points[self.cut_corners >> 1].any(axis=2)
        return several


BESIDE_OF_GRID = {0: (2, 3), 2: (0, 1)}
BESIDE_OF_TRIANGLE = {0: (1, 2), 1: (0, 2), 2: (0, 1)}
"""The two sides beside a side."""

GRID_CORNERS = np.array([[(0, 2), (1, 3), (0, 0)], [(0, 0), (1, 1), (0, 0)]])
TRIANGLE_CORNERS = np.array([[(0, 2), (1, 2), (0, 1)], [(0, 0), (0, 1), (1, 1)]])
"""The sides at the corners that are cut off, and whether each side ends there."""


def triangular_patches(batches: Sequence[Patches]) -> Bools:
    """Which patches of all batches are triangles, shape (P,)."""
    return np.concatenate([np.full(b.count, isinstance(b, TrianglePatches)) for b in batches])


def hash_arrays(*arrays: NDArray[Any]) -> bytes:
    """A key for arrays: their BLAKE2b hash of 32 bytes, as safe against collisions as SHA-256."""
    digest = blake2b(digest_size=32)
    for array in arrays:
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.digest()
