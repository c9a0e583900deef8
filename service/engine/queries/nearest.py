"""The nearest places that a search has found so far, and proved bounds of nearer ones."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries.cells import CellTree
from service.engine.queries.newton import Place, measure

TIED = 1 / 16
"""Difference of distances up to which two places are as near, in units of the tolerance."""

APART = 1e-3
"""How far two places that are as near must be from each other, in units of the nets, to be two:
about a minimum the distance changes little."""

STEPS = 8
"""Of Newton's method where nothing was proved."""


@dataclass(frozen=True, eq=False, slots=True)
class ClosestPoints:
    """For m points, in the coordinates of the nets.

    Attributes
    ----------
    net : ndarray of int, shape (m,)
    place : ndarray of float64, shape (m, 2)
        In the parameters of the net.
    position : ndarray of float64, shape (m, 3)
    distance, low, high : ndarray of float64, shape (m,)
        Of the position; and what holds the least distance of the surface.
    tied : ndarray of bool, shape (m,)
        Whether another place may be as near.
    """

    net: Ints
    place: FloatArray
    position: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray
    tied: Bools


class Nearest:
    """The nearest places of the points x (3, m).

    Attributes
    ----------
    best : ndarray of float64, shape (m,)
        Square of an upper bound of the distance.
    """

    def __init__(self, cells: CellTree, x: FloatArray, tolerance: float) -> None:
        m = x.shape[1]
        self._cells, self._x, self._tolerance = cells, x, tolerance
        self.best = np.full(m, np.inf)
        self._cell = np.zeros(m, np.intp)
        """Whose centre is nearest; net is −1 where it is the nearest of all."""
        self._low = np.full(m, np.inf)
        self._net = np.full(m, -1)
        self._place, self._position = np.zeros((2, m)), np.zeros((3, m))
        self._distance = np.full(m, np.inf)
        self._tied = np.zeros(m, bool)
        self._minima: list[tuple[Ints, Ints, Place]] = []
        self._left: list[tuple[Ints, Ints, FloatArray]] = []

    def limit(self, point: Ints) -> FloatArray:
        """Square of the distance beyond which cells are of no interest to these points."""
        reach = np.sqrt(self.best[point]) + TIED * self._tolerance
        return np.asarray(reach * reach)

    def add_centers(self, point: Ints, cell: Ints, upper: FloatArray) -> None:
        """Takes the nearest centre of the cells of each point.

        Pairs are in the order of points, `upper` are squares of distances.
        """
        if not len(point):
            return
        starts = np.flatnonzero(np.diff(point, prepend=-1))
        least = np.minimum.reduceat(upper, starts)
        who = point[starts]
        better = least < self.best[who]
        if better.any():
            hit = np.flatnonzero(upper == np.repeat(least, np.diff(starts, append=len(point))))
            hit = hit[np.diff(point[hit], prepend=-1) > 0]
            who, hit = who[better], hit[better]
            self.best[who], self._cell[who] = upper[hit], cell[hit]
            self._net[who] = -1

    def add_places(self, point: Ints, net: Ints, found: Place) -> None:
        """Takes points of the surface that are nearer than those before."""
        upper = found.high * found.high
        better = np.flatnonzero(upper <= self.best[point])
        if len(better):
            better = better[np.lexsort((net[better], upper[better], point[better]))]
            better = better[np.diff(point[better], prepend=-1) > 0]
            self._take(point[better], net[better], found.take(better))
            self.best[point[better]] = upper[better]

    def end_minima(self, point: Ints, net: Ints, found: Place, low: FloatArray) -> None:
        """Cells end with their minima, and with bounds of these, as squares."""
        np.minimum.at(self._low, point, low)
        self._minima.append((point, net, found))

    def end_cells(self, point: Ints, cell: Ints, low: FloatArray) -> None:
        """Cells end as they are, with bounds as squares."""
        np.minimum.at(self._low, point, low)
        self._left.append((point, cell, low))

    def answer(self) -> ClosestPoints:
        """The places, and the intervals of the distances."""
        self._descend()
        self._choose()
        high = np.maximum(np.sqrt(self.best), self._distance)
        low = np.minimum(np.sqrt(np.maximum(self._low, 0.0)), high)
        place, position = self._place.T, self._position.T
        return ClosestPoints(self._net, place, position, self._distance, low, high, self._tied)

    def _take(self, point: Ints, net: Ints, found: Place) -> None:
        self._net[point], self._distance[point] = net, found.distance
        self._place[:, point], self._position[:, point] = found.place, found.partials[0]

    def _descend(self) -> None:
        """Newton's method from the nearest centre of a cell, where no minimum was proved."""
        rows = np.flatnonzero(self._net < 0)
        cell = self._cell[rows]
        net, place = self._cells.net[cell], self._cells.place[:, cell]
        self.best[rows] = np.inf  # places have other bounds of rounding than centres
        at = free = np.zeros((2, len(rows)))
        for _ in range(STEPS if len(rows) else 0):
            found = measure(self._cells, net, place, at, self._x[:, rows])
            self.add_places(rows, net, found)
            at = found.next(at, free)

    def _choose(self) -> None:
        """Of places that are as near up to rounding takes the first, and looks for ties."""
        if self._minima:
            point = np.concatenate([point for point, _, _ in self._minima])
            net = np.concatenate([net for _, net, _ in self._minima])
            found = Place.joined([found for _, _, found in self._minima])
            np.minimum.at(self._distance, point, found.distance)
            most = self._distance[point] + 4 * (found.high - found.distance)
            rows = np.flatnonzero(found.distance <= most)
            u, v = found.place[:, rows]
            rows = rows[np.lexsort((v, u, net[rows], point[rows]))]
            rows = rows[np.diff(point[rows], prepend=-1) > 0]
            self._take(point[rows], net[rows], found.take(rows))
            away = found.partials[0] - self._position[:, point]
            near = found.distance <= self._distance[point] + TIED * self._tolerance
            near &= (away * away).sum(axis=0) > APART**2
            self._tied[point[near]] = True
        for point, cell, low in self._left:
            model = self._cells.models[:4, cell]
            away = model[:3] - self._position[:, point]
            near = low <= self.limit(point)
            near &= np.sqrt((away * away).sum(axis=0)) > APART + model[3]
            self._tied[point[near]] = True
