"""A tree of spheres over the patches, so that a query need not examine each of 10,000 patches.

It is a bounding volume hierarchy. Patches (or the cells into which queries halve them first) are
sorted along a space-filling curve through their centres (Morton order). Each eight neighbours get a
sphere, each eight of these spheres get a larger sphere, and so on. Let S be the patches in a sphere
with the centre c and the radius R. The centre is a point of one of these patches, so one distance
gives both bounds:

    d(x, c) − R ≤ d(x, S) ≤ d(x, c)

Proof in docs/proofs.md: "Bounding spheres".

References
----------
Lauterbach, Garland, Sengupta, Luebke and Manocha, Fast BVH construction on GPUs, Computer Graphics
Forum 28 (2009).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.cells.tree import CellTree
from service.engine.vectors import UNIT, length

FANOUT, MAX_ROOTS = 8, 24
"""How many members a sphere has, and the most spheres on the level of the largest."""

CHUNK_PAIRS = 1 << 13
"""How many pairs of a point and a sphere or box are computed at once, so that their data stay in
the processor's cache."""

_OUTWARDS = np.array([0, 1, -1, 2, -2, 3, -3, -4])
"""Steps from the middle member of a sphere to all of its members."""


class BoundingSpheres:
    """Levels of spheres over the first cells of a `CellTree`, at which queries begin.

    Parameters
    ----------
    cells : CellTree
    max_roots : int
        The most spheres on the level of the largest.
    reach : ndarray of float64, shape (nets,), or None
        By how much the spheres of the cells of each net are larger than the cells.
    first : ndarray of int, shape (N,), or None
        Some of the first cells, if not all of them have spheres.

    Attributes
    ----------
    cells : CellTree
    order : ndarray of int, shape (N,)
        These first cells in the order of the Morton curve.
    levels : list of ndarray of float64, shape (5, n)
        For each level the centre, radius and error of its spheres; the error bounds the distance of
        the computed centre from the surface, and is infinite where no centre is inside of trims.
        The level of the largest spheres comes first. Sphere k of a level contains the spheres 8 k …
        8 k + 7 of the next level. The spheres of the last level are those of the models of the
        cells, in `order`.
    middles : list of ndarray of int, shape (n,)
        For each level the cells whose centres are the centres of the spheres.
    boxes : list of ndarray of float64, shape (6, n)
        For each level the boxes about the cells in its spheres; only with trims.
    """

    def __init__(
        self,
        cells: CellTree,
        max_roots: int = MAX_ROOTS,
        reach: FloatArray | None = None,
        first: Ints | None = None,
    ) -> None:
        self.cells = cells
        first = cells.first if first is None else first
        spheres = cells.models[:5, first]
        if cells.trims is not None:
            spheres[4, ~cells.has_center(first)] = np.inf
        if reach is not None:
            spheres[3] += reach[cells.net[first]]
        order = np.argsort(_morton(spheres[:3]), kind="stable")
        level = spheres[:, order]
        self.order, self.levels = first[order], [level]
        self.middles = [self.order]
        self.boxes: list[FloatArray] = []
        if cells.trims is not None:
            more = 0.0 if reach is None else reach[cells.net[self.order]]
            low, high = cells.boxes[:3, self.order] - more, cells.boxes[3:, self.order] + more
            self.boxes.append(np.concatenate([low, high]))
        while level.shape[1] > max_roots:
            level, middle = _enclose(level)
            self.levels.insert(0, level)
            self.middles.insert(0, self.middles[0][middle])
            if self.boxes:
                self.boxes.insert(0, _box(self.boxes[0]))

    def members(self, level: int, item: Ints, sphere: Ints) -> tuple[Ints, Ints]:
        """Replace pairs of an item and a sphere of a level by pairs with the sphere's members."""
        members = (FANOUT * sphere[:, np.newaxis] + np.arange(FANOUT)).ravel()
        exists = members < self.levels[level + 1].shape[1]
        return np.repeat(item, FANOUT)[exists], members[exists]


def sphere_bounds(
    spheres: FloatArray, sphere: Ints, x: FloatArray, item: Ints
) -> tuple[FloatArray, FloatArray]:
    """Bounds of the squared distances of N pairs of a point and a sphere.

    Parameters
    ----------
    spheres : ndarray of float64, shape (at least 5, n)
        Centre, radius and error, as in `BoundingSpheres.levels`.
    sphere : ndarray of int, shape (N,)
    x : ndarray of float64, shape (3, m)
    item : ndarray of int, shape (N,)
        The point of each pair.

    Returns
    -------
    low, upper : ndarray of float64, shape (N,)
        A squared lower bound of the distance to all points of the sphere, and a squared upper bound
        of the distance to its centre.
    """
    low, upper = np.empty((2, len(item)))
    for rows in row_slices(len(item), 1, CHUNK_PAIRS):
        chosen = spheres[:5].take(sphere[rows], axis=1)
        y = x.take(item[rows], axis=1)
        y -= chosen[:3]
        y *= y
        distance = y[0]
        distance += y[1]
        distance += y[2]
        np.sqrt(distance, out=distance)
        least = distance * (1 - 8 * UNIT)
        least -= chosen[3]
        np.maximum(least, 0.0, out=least)
        np.multiply(least, least, out=low[rows])
        distance *= 1 + 8 * UNIT
        distance += chosen[4]
        np.multiply(distance, distance, out=upper[rows])
    return low, upper


def box_bounds(boxes: FloatArray, box: Ints, x: FloatArray, item: Ints) -> FloatArray:
    """Squared lower bounds (N,) of the distances of pairs of a point of x (3, m) and a box (6, n).

    `box` and `item` (N,) are the pairs.
    """
    low = np.empty(len(item))
    for rows in row_slices(len(item), 1, CHUNK_PAIRS):
        chosen, points = boxes.take(box[rows], axis=1), x.take(item[rows], axis=1)
        beyond = np.maximum(chosen[:3] - points, points - chosen[3:])
        np.maximum(beyond, 0.0, out=beyond)
        beyond *= beyond
        squared = beyond[0] + beyond[1] + beyond[2]
        squared *= 1 - 8 * UNIT
        low[rows] = squared
    return low


def _box(boxes: FloatArray) -> FloatArray:
    """The boxes of the next level up."""
    starts = np.arange(0, boxes.shape[1], FANOUT)
    low = np.minimum.reduceat(boxes[:3], starts, axis=1)
    return np.concatenate([low, np.maximum.reduceat(boxes[3:], starts, axis=1)])


def _enclose(level: FloatArray) -> tuple[FloatArray, Ints]:
    """The larger spheres of the next level up, and the number of the middle member of each.

    A larger sphere encloses eight spheres of `level`, and has the centre of the middle one.
    """
    count = level.shape[1]
    starts = np.arange(0, count, FANOUT)
    middle_numbers = np.minimum(starts + FANOUT // 2, count - 1)
    if np.isinf(level[4]).any():
        # The first member whose centre is a point of the surface, from the middle on.
        members = np.minimum(middle_numbers[:, np.newaxis] + _OUTWARDS, count - 1)
        members = np.maximum(members, starts[:, np.newaxis])
        first = np.isfinite(level[4, members]).argmax(axis=1)
        middle_numbers = members[np.arange(len(starts)), first]
    larger = level[:, middle_numbers]  # a copy, whose radii are replaced below
    difference = level[:3] - np.repeat(larger[:3], FANOUT, axis=1)[:, :count]
    distance = length(difference) + level[3]
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
