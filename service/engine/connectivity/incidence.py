"""Connectivity: which sides of patches are one edge, which corners are one point, and poles.

The connectivity depends on which control points are equal, and not on their coordinates. So it is
found once for each pattern of equal points (`service.engine.connectivity.connect`). What follows
from the connectivity and the resolution alone is planned once (`service.engine.plans.layout`,
`service.engine.plans.face_plan`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import numpy as np

from service.bases.arrays import AnyArray, Bools, Ints
from service.bases.row_batches import unique_rows
from service.surface.batches import Patches, TrianglePatches
from service.surface.sides import BEGINS, ENDS

SAME_WEIGHT = 2.0**-44
"""The largest difference between the weights that two patches give to one edge, after division by
the largest weight: dividing by a common factor changes the last digits."""

EQUAL_WEIGHT = 2.0**-50
"""The largest relative difference of two weights that count as equal as they are given, without any
division: a few roundings."""


@dataclass(frozen=True, eq=False)
class Connectivity:
    """The shared edges and corners of the P patches of a model.

    Attributes
    ----------
    counts : tuple of int
        The number of patches of each batch.
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
    sides_per_edge : ndarray of int, shape (E,)
        How many sides lie on each edge; an edge with 1 side is on the border of the model.
    corner_count : int
        The number C of distinct points at corners.
    """

    counts: tuple[int, ...]
    is_triangle: Bools
    edge: Ints
    backward: Bools
    collapsed: Bools
    corner: Ints
    sides_per_edge: Ints
    corner_count: int

    @staticmethod
    def of_patches(
        batches: Sequence[Patches],
        *,
        edge: Ints,
        backward: Bools,
        collapsed: Bools,
        corner: Ints,
        corner_count: int,
    ) -> "Connectivity":
        """The connectivity of all patches of a model; the arrays have 4 P numbers, in any shape."""
        return Connectivity(
            counts=tuple(batch.count for batch in batches),
            is_triangle=triangular_patches(batches),
            edge=edge.reshape(-1, 4),
            backward=backward.reshape(-1, 4),
            collapsed=collapsed.reshape(-1, 4),
            corner=corner.reshape(-1, 4),
            sides_per_edge=np.bincount(edge.ravel()),
            corner_count=corner_count,
        )

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        arrays = (self.is_triangle, self.edge, self.backward, self.collapsed, self.corner)
        return sum(array.nbytes for array in (*arrays, self.sides_per_edge))

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
        """Whether any two sides are one edge."""
        return bool((self.sides_per_edge > 1).any())

    @cached_property
    def is_line(self) -> Bools:
        """Which edges are lines, not points, shape (E,)."""
        is_line = np.zeros(len(self.sides_per_edge), dtype=bool)
        is_line[self.edge[~self.collapsed]] = True
        return is_line

    @cached_property
    def ends(self) -> tuple[Ints, Ints]:
        """The corners at which each edge begins and ends, shape (E,) each."""
        sides = np.arange(self.edge.size)
        side = np.empty_like(self.sides_per_edge)
        # The first side of each edge: in reverse order it is written last, and stays.
        side[self.edge.ravel()[::-1]] = sides[::-1]
        begin, end = (self.corner[:, corners].ravel()[side] for corners in (BEGINS, ENDS))
        is_backward = self.backward.ravel()[side]
        return np.where(is_backward, end, begin), np.where(is_backward, begin, end)

    @cached_property
    def open_lines(self) -> Bools:
        """Which edges are open lines: lines that only one side has, shape (E,)."""
        open_lines: Bools = self.is_line & (self.sides_per_edge == 1)
        return open_lines

    @cached_property
    def open_count(self) -> int:
        """The number of open lines."""
        return int(np.count_nonzero(self.open_lines))

    @cached_property
    def has_open_loops(self) -> bool:
        """Whether an open line ends at the corner where it begins: it may run back on itself."""
        begin, end = self.ends
        return bool((self.open_lines & (begin == end)).any())

    @cached_property
    def border_returns(self) -> bool:
        """Whether more than two open lines end at one corner."""
        sides = self.open_lines[self.edge] & ~self.collapsed
        ends = np.concatenate([self.corner[:, corners][sides] for corners in (BEGINS, ENDS)])
        return bool((np.bincount(ends) > 2).any())

    @cached_property
    def is_folded(self) -> bool:
        """Whether two sides of a patch are one edge."""
        ordered = np.sort(self.edge, axis=1)
        return bool((ordered[:, 1:] == ordered[:, :-1]).any())

    @cached_property
    def thin_sides(self) -> Ints:
        """For each patch (P,), a side that is one point while the two sides beside it are one edge.

        Patches without such a side have −1. On a tensor-product patch, the opposite side must be
        one point, too; the result is then 0 or 2. A patch with such a side may be a curve
        (`service.engine.connectivity.curve_patches`).
        """
        thin_side = np.full(len(self.edge), -1)
        for is_triangle, table in ((False, BESIDE_OF_GRID), (True, BESIDE_OF_TRIANGLE)):
            for side, (first, second) in table.items():
                is_thin = self.collapsed[:, side] & (self.edge[:, first] == self.edge[:, second])
                if not is_triangle:
                    is_thin &= self.collapsed[:, side + 1]
                thin_side[is_thin & (self.is_triangle == is_triangle)] = side
        return thin_side

    @cached_property
    def has_thin(self) -> bool:
        """Whether any patch has one of the `thin_sides`, and so may be a curve."""
        return bool((self.thin_sides >= 0).any())

    @cached_property
    def cut_corners(self) -> Ints:
        """The lines of the mesh that cut off corners of patches, as pairs of ends, (P, 3, 2).

        Such a line joins the samples next to the corner on both of its sides. An end of the line is
        described by 2 · edge, plus 1 if the corner is at the end of that edge. On a grid, diagonals
        of cells cut off the corners (0, 0) and (1, 1), and −1 fills the third row. On a triangle,
        lines cut off all three corners.
        """
        is_grid = ~self.is_triangle[:, None, None]
        sides = np.where(is_grid, GRID_CORNERS[0], TRIANGLE_CORNERS[0])
        at_end = np.where(is_grid, GRID_CORNERS[1], TRIANGLE_CORNERS[1])
        index = np.arange(len(self.edge))[:, None, None], sides
        lines: Ints = 2 * self.edge[index] + (at_end ^ self.backward[index])
        lines.sort(axis=2)
        lines[~self.is_triangle, 2] = -1
        return lines

    @cached_property
    def is_cut_twice(self) -> Bools:
        """Which `cut_corners` several patches share, (P, 3), on sides that are not points."""
        lines = self.cut_corners.reshape(-1, 2)
        is_shared: Bools = lines[:, 0] >= 0
        # Only lines are compared of which each end occurs again; in a grid of patches none does.
        occurs_again = np.bincount(lines[is_shared].ravel()) > 1
        rows = np.flatnonzero(is_shared & occurs_again[lines].all(axis=1))
        is_shared = np.zeros(len(lines), dtype=bool)
        if len(rows):
            _, number = unique_rows(lines[rows].astype(np.float64))
            is_shared[rows] = np.bincount(number)[number] > 1
            is_shared[rows] &= self.is_line[lines[rows] >> 1].all(axis=1)
        return is_shared.reshape(-1, 3)


BESIDE_OF_GRID = {0: (2, 3), 2: (0, 1)}
BESIDE_OF_TRIANGLE = {0: (1, 2), 1: (0, 2), 2: (0, 1)}
"""For each side that may be a result of `thin_sides`, the two sides beside it."""

GRID_CORNERS = np.array([[(0, 2), (1, 3), (0, 0)], [(0, 0), (1, 1), (0, 0)]])
TRIANGLE_CORNERS = np.array([[(0, 2), (1, 2), (0, 1)], [(0, 0), (0, 1), (1, 1)]])
"""The two sides at each corner that is cut off, and whether each side ends at this corner. Of
`GRID_CORNERS`, the third pairs are not used."""


def triangular_patches(batches: Sequence[Patches]) -> Bools:
    """Which patches of all batches are triangles, shape (P,)."""
    return np.concatenate([np.full(b.count, isinstance(b, TrianglePatches)) for b in batches])


def hash_arrays(*arrays: AnyArray) -> bytes:
    """A key for arrays: their BLAKE2b hash of 32 bytes, which resists collisions like SHA-256."""
    digest = blake2b(digest_size=32)
    for array in arrays:
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.digest()
