"""A tree of spheres over the patches, so that a query need not look at all of 10,000 patches.

Patches are put in the order of a space-filling curve through their centres (Morton), and every
eight neighbours get one sphere, every eight of these another. The centre of a sphere is the centre
of a patch in it, a point of the surface, so that one distance gives both bounds:

    d(x, c) − R ≤ d(x, S) ≤ d(x, c)

References
----------
Lauterbach, Garland, Sengupta, Luebke and Manocha, Fast BVH construction on GPUs, Computer Graphics
Forum 28 (2009).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.queries.cell_models import UNIT
from service.engine.queries.cells import CellTree
from service.engine.queries.column_vectors import dot
from service.engine.queries.ray_bounds import SAFE, Rays, sphere_misses

FANOUT, FEW = 8, 24
"""Members of a sphere; cells of the first level, at most."""

PAIRS = 1 << 13
"""Pairs of a ray and a sphere that are looked at at a time."""


class PatchTree:
    """Spheres over the first cells of a `CellTree`, level over level.

    Attributes
    ----------
    cells : CellTree
    order : ndarray of int, shape (N,)
        The first cells along the curve.
    levels : list of ndarray of float64, shape (5, n)
        Centre, radius and error of the spheres, the coarsest first. Sphere k of a level holds
        spheres 8 k … 8 k + 7 of the next, those of the last level cells of the `order`.
    """

    def __init__(self, cells: CellTree, few: int = FEW) -> None:
        self.cells = cells
        spheres = cells.models[:5, cells.first]
        order = np.argsort(_morton(spheres[:3]), kind="stable")
        level = spheres[:, order]
        self.order, self.levels = cells.first[order], [level]
        while level.shape[1] > few:
            level = _over(level)
            self.levels.insert(0, level)

    def candidates(self, x: FloatArray) -> tuple[Ints, Ints]:
        """Pairs of a point (of x, (3, m)) and a net that may be nearest, in the order of points."""
        m, first = x.shape[1], self.levels[0].shape[1]
        point = np.repeat(np.arange(m), first)
        sphere = np.tile(np.arange(first), m)
        best = np.full(m, np.inf)
        for level, finer in zip(self.levels[:-1], self.levels[1:], strict=True):
            low, upper = sphere_bounds(level.take(sphere, axis=1), x.take(point, axis=1))
            starts = np.flatnonzero(np.diff(point, prepend=-1))
            who = point[starts]
            best[who] = np.minimum(best[who], np.minimum.reduceat(upper, starts))
            keep = low <= best[point]
            point, sphere = _members(point[keep], sphere[keep], finer.shape[1])
        return point, self.order[sphere]

    def candidates_on(self, rays: Rays) -> tuple[Ints, Ints]:
        """Pairs of a ray and a cell that it may meet, in the order of rays."""
        ray, sphere = _met_spheres(self.levels[0], rays)
        for level in self.levels[1:]:
            ray, sphere = _members(ray, sphere, level.shape[1])
            meets = np.empty(len(ray), bool)
            for rows in row_slices(len(ray), 1, PAIRS):
                spheres, farthest = level.take(sphere[rows], axis=1), np.array(np.inf)
                meets[rows] = ~sphere_misses(spheres, rays, ray[rows], farthest)[0]
            ray, sphere = ray[meets], sphere[meets]
        return ray, self.order[sphere]


def sphere_bounds(spheres: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances: a lower bound of that to all in a sphere, an upper bound of its centre's.

    Parameters
    ----------
    spheres : ndarray of float64, shape (at least 5, N)
        Centre, radius and error.
    x : ndarray of float64, shape (3, N)
    """
    y = x - spheres[:3]
    y *= y
    distance = y[0]
    distance += y[1]
    distance += y[2]
    np.sqrt(distance, out=distance)
    low = distance * (1 - 8 * UNIT)
    low -= spheres[3]
    np.maximum(low, 0.0, out=low)
    low *= low
    distance *= 1 + 8 * UNIT
    distance += spheres[4]
    distance *= distance
    return low, distance


def _met_spheres(spheres: FloatArray, rays: Rays) -> tuple[Ints, Ints]:
    """Pairs of a ray and one of n spheres that it may meet, in the order of rays.

    All n m pairs are looked at without gathering: |g|² − (g · d)² is the square of the distance, up
    to 16 u |g|².
    """
    pairs = []
    center, radius = spheres[:3, np.newaxis], spheres[3]
    for rows in row_slices(len(rays.near), spheres.shape[1], PAIRS):
        o, d = rays.origin[:, rows, np.newaxis], rays.direction[:, rows, np.newaxis]
        g = center - o
        along, square = dot(g, d), dot(g, g)
        square *= 1 - 32 * UNIT
        along_square = along * along
        square -= along_square
        wide = radius + rays.slack[rows, np.newaxis]
        along += wide
        meets = along >= rays.near[rows, np.newaxis]
        wide *= wide
        wide *= SAFE
        meets &= square <= wide
        ray, sphere = np.nonzero(meets)
        pairs.append((ray + rows.start, sphere))
    ray, sphere = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return ray, sphere


def _members(who: Ints, sphere: Ints, count: int) -> tuple[Ints, Ints]:
    """Pairs with each of the members of a sphere, which are `count` in all."""
    sphere = (FANOUT * sphere[:, np.newaxis] + np.arange(FANOUT)).ravel()
    inside = sphere < count
    return np.repeat(who, FANOUT)[inside], sphere[inside]


def _over(level: FloatArray) -> FloatArray:
    """The spheres over eight spheres each, around the centre of one in their middle."""
    count = level.shape[1]
    starts = np.arange(0, count, FANOUT)
    middle = level[:, np.minimum(starts + FANOUT // 2, count - 1)].copy()
    away = level[:3] - np.repeat(middle[:3], FANOUT, axis=1)[:, :count]
    reach = np.sqrt((away * away).sum(axis=0)) + level[3]
    middle[3] = np.maximum.reduceat(reach, starts) * (1 + 1e-12)
    return middle


def _morton(centers: FloatArray) -> Ints:
    """Numbers along a Morton curve of points (3, N) in their box."""
    low = centers.min(axis=1, keepdims=True)
    side = float((centers - low).max(initial=0.0)) or 1.0
    grid = ((centers - low) / side * 1023).astype(np.intp)
    code = np.zeros(centers.shape[1], np.intp)
    for bit in range(10):
        for axis in range(3):
            code |= ((grid[axis] >> bit) & 1) << (3 * bit + axis)
    return code
