"""Convex polygons: the pieces into which triangles are cut.

The corners of all polygons are the columns of one array, one polygon after another. A polygon is
the hull of its corners, so rounding may move these a little out of their plane.

Proof in docs/proofs.md: "Cut polygons".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.vectors import Vectors


@dataclass(frozen=True, eq=False, slots=True)
class Polygons:
    """m convex polygons with N corners in all.

    Attributes
    ----------
    corners : ndarray of float64, shape (3, N)
        In order around each polygon.
    sizes : ndarray of int, shape (m,)
        How many corners each polygon has, at least one.
    source : ndarray of int, shape (m,)
        The triangle of which each is a piece.
    slot : ndarray of int, shape (m,)
        A triangle near each, as a slot of the tree.
    cuts : ndarray of int, shape (m,)
        How often each has been cut.
    """

    corners: Vectors
    sizes: Ints
    source: Ints
    slot: Ints
    cuts: Ints

    def __len__(self) -> int:
        return len(self.sizes)

    @property
    def starts(self) -> Ints:
        """The first corner (m,) of each polygon."""
        return self.sizes.cumsum() - self.sizes

    @property
    def owner(self) -> Ints:
        """The polygon (N,) of each corner."""
        return np.arange(len(self.sizes)).repeat(self.sizes)

    def take(self, rows: Ints) -> "Polygons":
        """The polygons with these numbers (k,)."""
        sizes = self.sizes.take(rows)
        _, at = expand_runs(sizes, self.starts.take(rows))
        return Polygons(
            self.corners.take(at, axis=1),
            sizes,
            self.source.take(rows),
            self.slot.take(rows),
            self.cuts.take(rows),
        )

    def select(self, mask: Bools) -> "Polygons":
        """The polygons that a mask (m,) marks."""
        return self if mask.all() else self.take(mask.nonzero()[0])

    def approach(self, slot: Ints) -> "Polygons":
        """These polygons with other triangles near them."""
        return Polygons(self.corners, self.sizes, self.source, slot, self.cuts)

    def find_largest(self, values: FloatArray) -> FloatArray:
        """The largest (m,) of the values (N,) at the corners of each polygon."""
        largest: FloatArray = np.maximum.reduceat(values, self.starts)
        return largest

    def find_worst(self, values: FloatArray) -> Ints:
        """The corner (m,) of each polygon at which the value (N,) is largest."""
        owner, worst = self.owner, np.zeros(len(self), np.intp)
        at = (values == self.find_largest(values).take(owner)).nonzero()[0]
        worst[owner[at]] = at
        return worst

    def find_centers(self) -> Vectors:
        """The means (3, m) of the corners of each polygon."""
        center: Vectors = np.add.reduceat(self.corners, self.starts, axis=1)
        center /= self.sizes
        return center

    def cut(self, heights: FloatArray) -> tuple["Polygons", "Polygons"]:
        """Cut each polygon along a line.

        `heights` (N,) are the values at the corners of a function that is affine on each polygon
        and 0 on the line.

        Returns
        -------
        below, above : Polygons
            The parts where the function is not positive, and not negative. A polygon that is not
            cut is in one of them only. Both parts have the corners on the line in common.
        """
        starts = self.starts
        following = np.arange(1, len(heights) + 1)
        following[starts + self.sizes - 1] = starts
        next_heights = heights.take(following)
        crosses = (heights < 0) & (next_heights > 0) | (heights > 0) & (next_heights < 0)
        at = crosses.nonzero()[0]
        share = heights[at] / (heights[at] - next_heights[at])
        begin = self.corners.take(at, axis=1)
        # Each corner is followed by the point in which the line crosses the edge, if it does.
        points = np.empty((3, 2 * len(heights)))
        points[:, ::2] = self.corners
        points[:, 2 * at + 1] = begin + share * (self.corners.take(following[at], axis=1) - begin)
        highest, lowest = np.maximum.reduceat(heights, starts), np.minimum.reduceat(heights, starts)
        parts = []
        for belongs, exists in (
            (heights <= 0, (lowest < 0) | (highest == 0)),
            (heights >= 0, highest > 0),
        ):
            chosen = np.empty(2 * len(heights), np.bool_)
            chosen[::2], chosen[1::2] = belongs, crosses
            chosen &= exists.repeat(2 * self.sizes)
            sizes = np.add.reduceat(chosen, 2 * starts, dtype=np.intp)
            rows = exists.nonzero()[0]
            parts.append(
                Polygons(
                    points[:, chosen.nonzero()[0]],
                    sizes.take(rows),
                    self.source.take(rows),
                    self.slot.take(rows),
                    self.cuts.take(rows) + (lowest.take(rows) < 0) * (highest.take(rows) > 0),
                )
            )
        return parts[0], parts[1]


def join_polygons(parts: Sequence[Polygons]) -> Polygons:
    """The polygons of several records, one record after another."""
    return Polygons(
        np.concatenate([part.corners for part in parts], axis=1),
        np.concatenate([part.sizes for part in parts]),
        np.concatenate([part.source for part in parts]),
        np.concatenate([part.slot for part in parts]),
        np.concatenate([part.cuts for part in parts]),
    )
