"""A tree of spheres over the patches, so that a query need not examine each of 10,000 patches.

Patches (or the cells into which queries halve them first) are sorted along a space-filling curve
through their centres (Morton order). Each eight neighbours get a sphere, each eight of these
spheres get a larger sphere, and so on. Let S be the patches in a sphere with the centre c and the
radius R. The centre c is the centre of one of these patches, hence a point of S. So one distance
gives both bounds:

    d(x, c) − R ≤ d(x, S) ≤ d(x, c)

References
----------
Lauterbach, Garland, Sengupta, Luebke and Manocha, Fast BVH construction on GPUs, Computer Graphics
Forum 28 (2009).
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.cells.tree import CellTree
from service.engine.rays.bounds import SAFE, Rays, sphere_misses
from service.engine.vectors import UNIT, dot

FANOUT, MAX_ROOTS = 8, 24
"""How many members a sphere has, and the most spheres on the level of the largest."""

CHUNK_PAIRS = 1 << 13
"""How many pairs of a ray and a sphere are tested at once; this limits the memory."""

MAX_OPEN_PAIRS = 1 << 18
"""The most pairs of points or rays with spheres of one level that the tree may fail to exclude. If
there are more, the caller searches again with fewer points or rays; a single one has no such
limit."""

MAX_PAIRS_IN_TREE, FREE_PAIRS = 4_000_000, 128
"""The most pairs that the tree may fail to exclude for all points or rays of a request, without
counting the first `FREE_PAIRS` pairs of each point or ray. A pair takes some 2 µs. The search of a
point or ray with too many pairs ends in the tree."""


@dataclass(frozen=True, eq=False, slots=True)
class Candidates:
    """The pairs of a point and a cell that may be nearest to the point, in the order of points.

    Attributes
    ----------
    point, cell : ndarray of int, shape (N,)
    ended : list of (point, cell, low, upper)
        The pairs of points that have too many pairs, one item for each level. These pairs have a
        sphere, not a cell: `cell` is the cell whose centre is the centre of the sphere, `low` a
        squared lower bound of the distance to all members, and `upper` a squared upper bound of the
        distance to the centre.
    max_pairs : int
        The most pairs on one level of spheres, without the last level.
    """

    point: Ints
    cell: Ints
    ended: list[tuple[Ints, Ints, FloatArray, FloatArray]]
    max_pairs: int


@dataclass(frozen=True, eq=False, slots=True)
class RayCandidates:
    """The pairs of a ray and a cell that the ray may meet, in the order of rays.

    Attributes
    ----------
    ray, cell : ndarray of int, shape (N,)
    is_ended : ndarray of bool, shape (m,)
        Which rays have too many pairs; their pairs are omitted.
    max_pairs : int
        The most pairs on one level of spheres, without the last level.
    """

    ray: Ints
    cell: Ints
    is_ended: Bools
    max_pairs: int


class PatchTree:
    """Levels of spheres over the first cells of a `CellTree`, at which queries begin.

    Attributes
    ----------
    cells : CellTree
    order : ndarray of int, shape (N,)
        The first cells in the order of the Morton curve.
    levels : list of ndarray of float64, shape (5, n)
        For each level the centre, radius and error of its spheres; the error bounds the distance of
        the computed centre from the surface. The level of the largest spheres comes first. Sphere k
        of a level contains the spheres 8 k … 8 k + 7 of the next level. The spheres of the last
        level are those of the models of the cells, in `order`.
    middles : list of ndarray of int, shape (n,)
        For each level the cells whose centres are the centres of the spheres.
    """

    def __init__(self, cells: CellTree, max_roots: int = MAX_ROOTS) -> None:
        self.cells = cells
        spheres = cells.models[:5, cells.first]
        order = np.argsort(_morton(spheres[:3]), kind="stable")
        level = spheres[:, order]
        self.order, self.levels = cells.first[order], [level]
        self.middles = [self.order]
        while level.shape[1] > max_roots:
            level, middle = _enclose(level)
            self.levels.insert(0, level)
            self.middles.insert(0, self.middles[0][middle])

    def candidates(self, x: FloatArray, max_pairs_of_point: int) -> Candidates | None:
        """Find the pairs of a point of x (3, m) and a cell that may be its nearest cell.

        None if there is more than one point, and all points together have more than
        `MAX_OPEN_PAIRS` pairs on a level. A point that has more than `max_pairs_of_point` pairs on
        a level ends there.
        """
        m, root_count = x.shape[1], self.levels[0].shape[1]
        point = np.repeat(np.arange(m), root_count)
        sphere = np.tile(np.arange(root_count), m)
        best = np.full(m, np.inf)  # squared upper bounds of the least distances
        ended_pairs, max_pairs = [], 0
        for level_number, level in enumerate(self.levels[:-1]):
            checkpoint()
            low, upper = sphere_bounds(level.take(sphere, axis=1), x.take(point, axis=1))
            starts = np.flatnonzero(np.diff(point, prepend=-1))
            first_points = point[starts]
            best[first_points] = np.minimum(best[first_points], np.minimum.reduceat(upper, starts))
            near_rows = np.flatnonzero(low <= best[point])
            point, sphere = point[near_rows], sphere[near_rows]
            max_pairs = max(max_pairs, len(point))
            if max_pairs > MAX_OPEN_PAIRS and m > 1:
                return None
            is_ended = np.bincount(point, minlength=m)[point] > max_pairs_of_point
            if is_ended.any():
                rows = near_rows[is_ended]
                cell = self.middles[level_number][sphere[is_ended]]
                ended_pairs.append((point[is_ended], cell, low[rows], upper[rows]))
                point, sphere = point[~is_ended], sphere[~is_ended]
            point, sphere = _members(point, sphere, self.levels[level_number + 1].shape[1])
        return Candidates(point, self.order[sphere], ended_pairs, max_pairs)

    def candidates_on(self, rays: Rays, max_pairs_of_ray: int) -> RayCandidates | None:
        """Find the pairs of a ray and a cell that the ray may meet.

        None if there is more than one ray, and all rays together have more than `MAX_OPEN_PAIRS`
        pairs on a level. A ray that has more than `max_pairs_of_ray` pairs on a level ends there.
        """
        m = len(rays.near)
        ray, sphere = _find_met_spheres(self.levels[0], rays)
        is_ended: Bools = np.zeros(m, bool)
        max_pairs = 0
        for level in self.levels[1:]:
            checkpoint()
            max_pairs = max(max_pairs, len(ray))
            if max_pairs > MAX_OPEN_PAIRS and m > 1:
                return None
            has_too_many = np.bincount(ray, minlength=m) > max_pairs_of_ray
            if has_too_many.any():
                is_ended |= has_too_many
                ray, sphere = ray[~has_too_many[ray]], sphere[~has_too_many[ray]]
            ray, sphere = _members(ray, sphere, level.shape[1])
            meets = np.empty(len(ray), bool)
            for rows in row_slices(len(ray), 1, CHUNK_PAIRS):
                spheres, farthest = level.take(sphere[rows], axis=1), np.array(np.inf)
                meets[rows] = ~sphere_misses(spheres, rays, ray[rows], farthest)[0]
            ray, sphere = ray[meets], sphere[meets]
        return RayCandidates(ray, self.order[sphere], is_ended, max_pairs)


def sphere_bounds(spheres: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds of the squared distances of N points and spheres.

    Parameters
    ----------
    spheres : ndarray of float64, shape (at least 5, N)
        Centre, radius and error, as in `PatchTree.levels`.
    x : ndarray of float64, shape (3, N)

    Returns
    -------
    low, upper : ndarray of float64, shape (N,)
        A squared lower bound of the distance to all points of the sphere, and a squared upper bound
        of the distance to its centre.
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


def _find_met_spheres(spheres: FloatArray, rays: Rays) -> tuple[Ints, Ints]:
    """The pairs of a ray and a sphere that the ray may meet, in the order of rays.

    All pairs of m rays and n spheres are tested, in arrays (m, n). With g = c − o, the squared
    distance of a centre from the line of a ray is |g|² − (g · d)², up to 16 u |g|²; twice this
    error is subtracted.
    """
    pairs = []
    center, radius = spheres[:3, np.newaxis], spheres[3]
    for rows in row_slices(len(rays.near), spheres.shape[1], CHUNK_PAIRS):
        o, d = rays.origin[:, rows, np.newaxis], rays.direction[:, rows, np.newaxis]
        g = center - o
        along_ray, squared_distance = dot(g, d, -3), dot(g, g, -3)
        squared_distance *= 1 - 32 * UNIT
        squared_along_ray = along_ray * along_ray
        squared_distance -= squared_along_ray
        radius_with_slack = radius + rays.slack[rows, np.newaxis]
        along_ray += radius_with_slack
        is_met = along_ray >= rays.near[rows, np.newaxis]
        radius_with_slack *= radius_with_slack
        radius_with_slack *= SAFE
        is_met &= squared_distance <= radius_with_slack
        ray, sphere = np.nonzero(is_met)
        pairs.append((ray + rows.start, sphere))
    ray, sphere = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return ray, sphere


def _members(query: Ints, sphere: Ints, count: int) -> tuple[Ints, Ints]:
    """Replace each pair with a sphere by pairs with all members of the sphere.

    `query` has the numbers of points or rays; the level of the members has `count` spheres.
    """
    sphere = (FANOUT * sphere[:, np.newaxis] + np.arange(FANOUT)).ravel()
    has_member = sphere < count
    return np.repeat(query, FANOUT)[has_member], sphere[has_member]


def _enclose(level: FloatArray) -> tuple[FloatArray, Ints]:
    """The larger spheres of the next level up, and the number of the middle member of each.

    A larger sphere encloses eight spheres of `level`, and has the centre of the middle one.
    """
    count = level.shape[1]
    starts = np.arange(0, count, FANOUT)
    middle_numbers = np.minimum(starts + FANOUT // 2, count - 1)
    larger = level[:, middle_numbers]  # a copy, whose radii are replaced below
    difference = level[:3] - np.repeat(larger[:3], FANOUT, axis=1)[:, :count]
    distance = np.sqrt((difference * difference).sum(axis=0)) + level[3]
    larger[3] = np.maximum.reduceat(distance, starts) * (1 + 1e-12)  # for rounding
    return larger, middle_numbers


def _morton(centers: FloatArray) -> Ints:
    """The positions (N,) of points (3, N) along a Morton curve in their box."""
    low = centers.min(axis=1, keepdims=True)
    side = float((centers - low).max(initial=0.0)) or 1.0
    grid = ((centers - low) / side * 1023).astype(np.intp)
    code = np.zeros(centers.shape[1], np.intp)
    for bit in range(10):
        for axis in range(3):
            code |= ((grid[axis] >> bit) & 1) << (3 * bit + axis)
    return code
