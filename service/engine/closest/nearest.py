"""The state of a search for closest points: the nearest points so far, and proved lower bounds."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.engine.cells.cell_trims import INSIDE, OUTSIDE
from service.engine.cells.tree import CellTree
from service.engine.closest.descents import FoundMinima
from service.engine.closest.newton import SurfacePoints, measure_surface_points
from service.engine.closest.trimmed_points import TrimmedPoints
from service.engine.vectors import Items, dot, length

TIE_WIDTH = 1 / 16
"""Two points of the surface count as equally near if their distances differ by at most this, in
units of the tolerance."""

MIN_SEPARATION = 1e-3
"""Two equally near points of the surface count as different if they are farther apart than this, in
the coordinates of the nets. (Near one minimum there are many almost equally near points.)"""

STEPS = 7
"""The number of steps of Newton's method if no minimum was proved."""


@dataclass(frozen=True, eq=False, slots=True)
class ClosestPoints(Items):
    """The closest points to m points, in the coordinates of the nets.

    Attributes
    ----------
    net : ndarray of int, shape (m,)
        The number of the net on which the closest point lies.
    parameters : ndarray of float64, shape (2, m)
        The parameters (u, v) of the closest point in its net.
    position : ndarray of float64, shape (3, m)
    distance, low, high : ndarray of float64, shape (m,)
        The distance of the position, and an interval that contains the least distance.
    is_tied : ndarray of bool, shape (m,)
        Whether another point of the surface may be equally near.
    is_certain : ndarray of bool, shape (m,)
        Whether the closest point is certainly inside of trims; others are at a border, up to
        rounding.
    """

    net: Ints
    parameters: FloatArray
    position: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray
    is_tied: Bools
    is_certain: Bools


class Nearest:
    """The points of a surface nearest to points x (3, m) that a search has found so far.

    With trims, only points that are inside count.

    Attributes
    ----------
    best : ndarray of float64, shape (m,)
        Squared upper bounds of the least distances.
    """

    def __init__(
        self, cells: CellTree, x: FloatArray, tolerance: float, trims: TrimmedPoints | None = None
    ) -> None:
        m = x.shape[1]
        self._cells, self._x, self._tolerance, self._trims = cells, x, tolerance, trims
        self.best = np.full(m, np.inf)
        # For each point, the squared distance of the nearest centre of a cell, and that cell.
        self._center_best, self._center_cell = np.full(m, np.inf), np.zeros(m, np.intp)
        # For each point, the least squared lower bound of the distances of its cells.
        self._low = np.full(m, np.inf)
        # For each point, an upper bound of the least distance.
        self._high = np.full(m, np.inf)
        # Results of `add_found` and `end_open_cells`.
        self._found: list[SurfacePoints] = []
        # How far found points may be from points that are inside; 0 for those that are.
        self._reaches: list[FloatArray] = []
        self._open_cells: list[tuple[Ints, Ints, FloatArray]] = []
        # Points and cells whose minima are outside, so that borders decide: squared lower bounds of
        # the cells, and by how much borders may be further than points of the cells.
        self._outside: list[tuple[Ints, FloatArray, FloatArray]] = []

    def limit(self, point: Ints, cell: Ints | None = None) -> FloatArray:
        """Squared distances beyond which a cell has neither a closest nor an equally near point.

        With the cells of the pairs, borders for which these stand do not count either.
        """
        distance = np.sqrt(self.best.take(point))
        distance += TIE_WIDTH * self._tolerance
        if self._trims is not None and cell is not None:
            distance += self._trims.find_gaps(cell)
        distance *= distance
        return np.asarray(distance)

    def add_centers(self, point: Ints, cell: Ints, upper: FloatArray) -> None:
        """Update the nearest centres of cells by some pairs, which are in the order of points.

        `upper` has squared upper bounds of the distances of the centres.
        """
        # Most pairs change nothing.
        rows = np.flatnonzero(upper < self.best.take(point))
        if self._trims is not None:
            rows = rows[self._cells.has_center(cell[rows])]
        if not len(rows):
            return
        point, cell, upper = point[rows], cell[rows], upper[rows]
        # For each point, the first of the rows with its least bound.
        starts = find_begins(point)
        least = np.minimum.reduceat(upper, starts)
        nearest = np.flatnonzero(upper == np.repeat(least, count_runs(starts, len(point))))
        nearest = nearest[np.diff(point[nearest], prepend=-1) > 0]
        points = point[starts]
        self.best[points] = self._center_best[points] = least
        self._center_cell[points] = cell[nearest]

    def add_found(self, found: SurfacePoints, cell: Ints) -> Bools:
        """Record points of the surface, which are in cells (n,); returns which are outside."""
        high, is_outside = found.high, np.zeros(len(cell), bool)
        if self._trims is not None:
            answers = self._trims.find_inside(cell, found.parameters)
            is_outside = answers == OUTSIDE
            reach = self._trims.find_reaches(cell, answers)
            is_kept = ~is_outside & np.isfinite(reach)
            found, reach = found.take(is_kept), reach[is_kept]
            high = found.high + reach
            self._reaches.append(reach)
        np.minimum.at(self.best, found.point, high * high)
        np.minimum.at(self._high, found.point, high)
        self._found.append(found)
        return is_outside

    def add_minima(self, found: SurfacePoints, bounds: FoundMinima) -> None:
        """Record minima (n,) of cells, with their bounds where their intervals are narrow."""
        is_narrow = bounds.is_narrow
        is_outside = is_narrow & self.add_found(found, bounds.cell)
        counts = is_narrow & ~is_outside
        self.end_cells(found.point[counts], bounds.cell[counts], bounds.low[counts])
        if is_outside.any():
            ended, high = bounds.take(is_outside), found.high[is_outside]
            loss = np.sqrt(high * high + ended.loss) - np.sqrt(np.maximum(ended.low, 0.0))
            self._outside.append((found.point[is_outside], ended.low, loss))

    def end_cells(self, point: Ints, cell: Ints, low: FloatArray) -> None:
        """Record squared lower bounds of cells whose minima are recorded by `add_found`."""
        if self._trims is not None:
            gaps = self._trims.find_gaps(cell)
            lowered = np.maximum(np.sqrt(np.maximum(low, 0.0)) - gaps, 0.0)
            low = np.where(gaps > 0, lowered * lowered, low)
        np.minimum.at(self._low, point, low)

    def end_open_cells(self, point: Ints, cell: Ints, low: FloatArray) -> None:
        """Record squared lower bounds of cells that the search leaves open."""
        if len(point):
            self.end_cells(point, cell, low)
            self._open_cells.append((point, cell, low))

    def answer(self) -> ClosestPoints:
        """The result of the search: the closest points, with intervals of their distances."""
        self._descend()
        found = SurfacePoints.join(self._found)
        reaches = None
        if self._trims is not None:
            reaches = self._test_nearest(found, np.concatenate(self._reaches))
        rows = self._choose(found, reaches)
        chosen = found.take(rows)
        is_certain = np.ones(len(rows), bool)
        if reaches is not None:
            self._test(found, rows, reaches)
            is_certain = reaches[rows] == 0
        high = np.maximum(self._high, chosen.distance)
        low = np.minimum(np.sqrt(np.maximum(self._low, 0.0)), high)
        loss = np.zeros(len(low))
        for point, least, most in self._outside:
            is_near = least <= self.limit(point)
            np.maximum.at(loss, point[is_near], most[is_near])
        low = np.maximum(low - loss, 0.0)
        is_tied = self._find_ties(found, chosen)
        place = chosen.net, chosen.parameters, chosen.position, chosen.distance
        return ClosestPoints(*place, low, high, is_tied, is_certain)

    def _descend(self) -> None:
        """Find a surface point for each x that has none nearer than the nearest centre of a cell.

        Newton's method begins at this centre; it proves nothing.
        """
        found_distance = np.full(len(self.best), np.inf)
        for found in self._found:
            np.minimum.at(found_distance, found.point, found.high)
        rows = np.flatnonzero(
            np.isinf(found_distance) | (found_distance * found_distance > self._center_best)
        )
        if not len(rows):
            return
        cell = self._center_cell[rows]
        # The search begins at the centres, and no side is proved to contain the minimum.
        cell_parameters = no_sides = np.zeros((2, len(rows)))
        nearest = found = measure_surface_points(self._cells, self._x, rows, cell, cell_parameters)
        for _ in range(STEPS):
            cell_parameters = found.next(cell_parameters, no_sides)
            found = measure_surface_points(self._cells, self._x, rows, cell, cell_parameters)
            is_nearer = found.high <= nearest.high
            if self._trims is not None:
                answers = self._trims.find_inside(cell, found.parameters, tests_all=True)
                is_nearer &= answers == INSIDE
            nearest = nearest.replace_where(found, is_nearer)
        self.add_found(nearest, cell)

    def _test_nearest(self, found: SurfacePoints, reaches: FloatArray) -> FloatArray:
        """Test the points that are undecided, if they may be clearly nearer than all others.

        Returns `reaches` (n,), how far points may be from points that are inside, after that.
        """
        least, safe = np.full((2, len(self.best)), np.inf)
        np.minimum.at(least, found.point, found.distance)
        np.minimum.at(safe, found.point, found.distance + reaches)
        is_open = safe > least + TIE_WIDTH * self._tolerance
        is_tested = is_open[found.point] & (found.distance < safe[found.point])
        self._test(found, np.flatnonzero(is_tested), reaches)
        return reaches

    def _test(self, found: SurfacePoints, rows: Ints, reaches: FloatArray) -> None:
        """Test undecided points among `rows`: those inside bound the distances, with the reach 0.

        `reaches` (n,) of all points are changed.
        """
        rows = rows[reaches[rows] > 0]
        if len(rows) and self._trims is not None:
            net, parameters = found.net[rows], found.parameters[:, rows]
            rows = rows[self._trims.trims.find_inside(net, parameters) == INSIDE]
            np.minimum.at(self._high, found.point[rows], found.high[rows])
            reaches[rows] = 0.0

    def _choose(self, found: SurfacePoints, reaches: FloatArray | None) -> Ints:
        """The row of the nearest point of the surface for each x, shape (m,).

        Of several that are equally near, the first in the order of nets, u and v is chosen. With
        trims, points that are certainly inside or on edges come before others that are not nearer
        by more than rounding, and then the numbers of faces and patches decide.
        """
        point, distance = found.point, found.distance
        if reaches is not None:
            distance = distance + reaches
        min_distance = np.full(len(self.best), np.inf)
        np.minimum.at(min_distance, point, distance)
        # `high` exceeds `distance` by a bound of its rounding error. Four times this bounds the
        # errors of both distances, with a margin.
        max_distance = min_distance[point] + 4 * (found.high - found.distance)
        rows = np.flatnonzero(distance <= max_distance)
        u, v = found.parameters[:, rows]
        net = found.net[rows]
        keys = [v, u, net]
        if reaches is not None:
            keys += [self._cells.nets.patch[net], reaches[rows] > 0]
        rows = rows[np.lexsort((*keys, point[rows]))]
        return rows[np.diff(point[rows], prepend=-1) > 0]

    def _find_ties(self, found: SurfacePoints, chosen: SurfacePoints) -> Bools:
        """Which points x (m,) have an equally near second point, or an open cell that may.

        `chosen` has the closest point for each x, in this order.
        """
        is_tied, point = np.zeros(len(self.best), bool), found.point
        difference = found.position - chosen.position[:, point]
        is_near = found.distance <= chosen.distance[point] + TIE_WIDTH * self._tolerance
        is_near &= dot(difference, difference) > MIN_SEPARATION**2
        is_tied[point[is_near]] = True
        for points, cell, low in self._open_cells:
            center, radius = self._cells.models[:3, cell], self._cells.models[3, cell]
            difference = center - chosen.position[:, points]
            is_near = low <= self.limit(points)
            is_near &= length(difference) > MIN_SEPARATION + radius
            is_tied[points[is_near]] = True
        return is_tied
