"""Equal points for edges that patches share, also if their weights differ by a common factor.

Such weights give the same curve, but results may differ in their last digits; patches share an edge
only if the digits are equal.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import Net
from service.bases.triangle import degree_of, side_rows
from service.bases.unique_rows import unique_rows
from service.surface.sides import take_side

SAME_WEIGHT = 2.0**-44
"""Largest difference of the weights of one edge in two patches, scaled to a largest weight of 1."""


@dataclass(frozen=True, eq=False, slots=True)
class _Side:
    """One side of some patches: points and weights before the change, and the new nets."""

    points: FloatArray
    weights: FloatArray
    raised: FloatArray
    rows: Ints | None = None
    """Rows of the triangular nets on this side; None for grids."""

    @property
    def new_points(self) -> FloatArray:
        """The new points, shape (P, n+1, 3)."""
        return self.raised if self.rows is None else self.raised[:, self.rows]

    def write(self, values: FloatArray) -> None:
        """Replace the new points of the side."""
        if self.rows is None:
            self.raised[...] = values
        else:
            self.raised[:, self.rows] = values


def match_shared_edges(pairs: list[tuple[Net, FloatArray]]) -> None:
    """Give every edge that patches share the same points in each of them.

    Parameters
    ----------
    pairs : list of (net, points)
        Batches of grids or of triangles before the change, and their points in a higher degree,
        of which those on shared edges are overwritten.
    """
    groups: dict[tuple[int, int], list[_Side]] = {}
    for (points, weights), raised in pairs:
        if weights is not None:
            make = _sides_of_grids if points.ndim == 4 else _sides_of_triangles
            for side in make(points, weights, raised):
                degrees = side.points.shape[1], side.new_points.shape[1]
                groups.setdefault(degrees, []).append(side)
    for sides in groups.values():
        _match_sides(sides)


def _sides_of_grids(points: FloatArray, weights: FloatArray, raised: FloatArray) -> Iterator[_Side]:
    for side in range(4):
        yield _Side(take_side(points, side), take_side(weights, side), take_side(raised, side))


def _sides_of_triangles(
    points: FloatArray, weights: FloatArray, raised: FloatArray
) -> Iterator[_Side]:
    old, new = (side_rows(degree_of(net.shape[1])) for net in (points, raised))
    for old_rows, new_rows in zip(old, new, strict=True):
        yield _Side(points[:, old_rows], weights[:, old_rows], raised, new_rows)


def _match_sides(sides: list[_Side]) -> None:
    """Give equal sides of one degree the same points."""
    before = np.concatenate([side.points for side in sides])
    loads = np.concatenate([side.weights for side in sides])
    after = np.concatenate([side.new_points for side in sides])
    turned = _find_reversed(before)
    for values in (before, loads, after):
        _reverse_rows(values, turned)
    first = _find_first_equal(before)
    loads /= loads.max(axis=1, keepdims=True)
    same = np.abs(loads - loads[first]).max(axis=1) <= SAME_WEIGHT
    after[same] = after[first[same]]
    _reverse_rows(after, turned)
    ends = np.cumsum([len(side.points) for side in sides])
    for side, values in zip(sides, np.split(after, ends[:-1]), strict=True):
        side.write(values)


def _find_first_equal(rows: FloatArray) -> Ints:
    """Number of the first side with the same points, for each side."""
    first, number = unique_rows(rows.reshape(len(rows), -1))
    leader: Ints = first[number]
    return leader


def _find_reversed(sides: FloatArray) -> Bools:
    """Which sides are reversed: their numbers in reverse order come first in lexical order."""
    forth = sides.reshape(len(sides), -1)
    back = sides[:, ::-1].reshape(forth.shape)
    at = np.arange(len(sides)), (forth != back).argmax(axis=1)
    turned: Bools = forth[at] > back[at]
    return turned


def _reverse_rows(sides: FloatArray, which: Bools) -> None:
    sides[which] = sides[which, ::-1]
