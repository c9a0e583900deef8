"""Edges that patches share although their weights differ by a common factor.

Such weights give the same curve, but not the same last digits of what is computed from them; and
it is by equal digits that edges are found to be one.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import Net
from service.bases.triangle import degree_of, side_rows
from service.bases.unique_rows import unique_rows
from service.surface.sides import side_of

SAME_WEIGHT = 2.0**-44
"""How far weights of one edge, their largest made 1, may differ on two sides of it."""


@dataclass(frozen=True, eq=False, slots=True)
class _Side:
    """One side of some patches: points and weights as they were, and where the new points are."""

    points: FloatArray
    weights: FloatArray
    raised: FloatArray
    rows: Ints | None = None
    """Which of them, in triangles."""

    @property
    def after(self) -> FloatArray:
        """The new points, shape (P, n+1, 3)."""
        return self.raised if self.rows is None else self.raised[:, self.rows]

    def write(self, values: FloatArray) -> None:
        """Replaces the new points."""
        if self.rows is None:
            self.raised[...] = values
        else:
            self.raised[:, self.rows] = values


def agree(pairs: list[tuple[Net, FloatArray]]) -> None:
    """Gives every edge that patches share the same points in each of them.

    Parameters
    ----------
    pairs : list of (net, points)
        Batches of grids or of triangles, as they were with their weights, and their points in a
        higher degree, some of which are overwritten.
    """
    groups: dict[tuple[int, int], list[_Side]] = {}
    for (points, weights), raised in pairs:
        if weights is not None:
            make = _of_grids if points.ndim == 4 else _of_triangles
            for side in make(points, weights, raised):
                degrees = side.points.shape[1], side.after.shape[1]
                groups.setdefault(degrees, []).append(side)
    for sides in groups.values():
        _agree(sides)


def _of_grids(points: FloatArray, weights: FloatArray, raised: FloatArray) -> Iterator[_Side]:
    for side in range(4):
        yield _Side(side_of(points, side), side_of(weights, side), side_of(raised, side))


def _of_triangles(points: FloatArray, weights: FloatArray, raised: FloatArray) -> Iterator[_Side]:
    old, new = (side_rows(degree_of(net.shape[1])) for net in (points, raised))
    for here, there in zip(old, new, strict=True):
        yield _Side(points[:, here], weights[:, here], raised, there)


def _agree(sides: list[_Side]) -> None:
    """The same for sides of one degree."""
    before = np.concatenate([side.points for side in sides])
    loads = np.concatenate([side.weights for side in sides])
    after = np.concatenate([side.after for side in sides])
    turned = _turned(before)
    for values in (before, loads, after):
        _turn(values, turned)
    first = _first(before)
    loads /= loads.max(axis=1, keepdims=True)
    same = np.abs(loads - loads[first]).max(axis=1) <= SAME_WEIGHT
    after[same] = after[first[same]]
    _turn(after, turned)
    ends = np.cumsum([len(side.points) for side in sides])
    for side, values in zip(sides, np.split(after, ends[:-1]), strict=True):
        side.write(values)


def _first(rows: FloatArray) -> Ints:
    """For each side the first one with the same points."""
    first, number = unique_rows(rows.reshape(len(rows), -1))
    found: Ints = first[number]
    return found


def _turned(sides: FloatArray) -> Bools:
    """Which sides run against the direction in which their numbers come first."""
    forth = sides.reshape(len(sides), -1)
    back = sides[:, ::-1].reshape(forth.shape)
    at = np.arange(len(sides)), (forth != back).argmax(axis=1)
    turned: Bools = forth[at] > back[at]
    return turned


def _turn(sides: FloatArray, which: Bools) -> None:
    sides[which] = sides[which, ::-1]
