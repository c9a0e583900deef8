"""The nearest triangles of points.

A triangle that is probably near gives each point an upper bound of its distance. Then points are
searched in groups of neighbours: pairs of a group and a box of the tree are followed down, level by
level, as long as the box of the group is not further from the box than the largest of these bounds.
Where the boxes of the tree are smaller than the group, each point is compared with boxes on its
own. The triangles that remain are measured.

Proof in docs/proofs.md: "Nearest triangles".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.mesh_distances.halving import group_points
from service.engine.mesh_distances.tree import TriangleTree
from service.engine.vectors import UNIT, Vectors, dot, length

GROUP = 16
"""The most points that are searched together on the upper levels."""

CHUNK = 1 << 11
"""About how many points are searched at once; it limits memory."""

PAIRS = 1 << 13
"""The most pairs with boxes whose distances are computed at once, so that their data stay in the
processor's cache."""

MAX_PAIRS = 1 << 20
"""If a chunk has more pairs, each half of it is searched on its own; it limits memory."""

MANY = 16
"""With more boxes for each group of points, points are compared with boxes on their own."""

NEARNESS = 2.0**-6
"""The weight of the middle of a box when the nearest box is sought."""

ROUNDING = 1.0 - 16 * UNIT
"""A factor that lowers computed squares of distances from boxes by more than their rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class NearestTriangles:
    """The nearest triangles of m points.

    Attributes
    ----------
    triangle : ndarray of int, shape (m,)
        The lowest number among triangles at equal distances.
    weights : ndarray of float64, shape (m, 3)
        The barycentric coordinates of the nearest point of the triangle.
    position : ndarray of float64, shape (m, 3)
        This point.
    low, high : ndarray of float64, shape (m,)
        The distance of each point from all triangles lies between these bounds, which differ by
        rounding only.
    """

    triangle: Ints
    weights: FloatArray
    position: FloatArray
    low: FloatArray
    high: FloatArray


def find_nearest(
    tree: TriangleTree, points: FloatArray, guess: Ints | None = None
) -> NearestTriangles:
    """The nearest triangle of each point.

    Parameters
    ----------
    tree : TriangleTree
    points : ndarray of float64, shape (m, 3)
    guess : ndarray of int, shape (m,)
        A triangle near each point, which makes the search faster.

    Raises
    ------
    Cancelled, OutOfTime
    """
    local = tree.to_frame(points)
    reach = measure_reach(local)
    slots, squares = search_slots(tree, local, None if guess is None else tree.slots[guess])
    weights, position = np.empty_like(local), np.empty_like(local)
    for rows in row_slices(len(slots), 1, PAIRS):
        weights[:, rows] = tree.frames.find_feet(local[:, rows], slots[rows], reach)
        position[:, rows] = tree.frames.place(slots[rows], weights[:, rows])
    error, distance = tree.frames.bound_error(reach), np.sqrt(squares)
    return NearestTriangles(
        tree.order[slots],
        weights.T,
        tree.from_frame(position),
        np.maximum(distance - error, 0.0) / tree.scale,
        (distance + error) / tree.scale,
    )


def measure_reach(points: Vectors) -> float:
    """The largest distance of points (3, m) from the origin."""
    return float(length(points).max(initial=0.0))


def search_slots(
    tree: TriangleTree, points: Vectors, guess: Ints | None = None
) -> tuple[Ints, FloatArray]:
    """The slots (m,) of the nearest triangles, and the squares (m,) of the distances from them.

    `points` (3, m) are in the coordinates of the tree; `guess` (m,) are slots of triangles near
    them.
    """
    slots, squares = np.empty(points.shape[1], np.intp), np.empty(points.shape[1])
    if not len(slots):
        return slots, squares
    reach = measure_reach(points)
    groups = group_points(points, GROUP)
    order = groups.ravel()
    grouped = points.take(order, axis=1).reshape(3, *groups.shape)
    guesses = _descend(tree, grouped.reshape(3, -1)) if guess is None else guess.take(order)
    slots[order], squares[order] = _search(tree, grouped, guesses, reach)
    return slots, squares


def _descend(tree: TriangleTree, points: Vectors) -> Ints:
    """Slots (m,) of triangles near points (3, m): the nearest box of each level is followed."""
    slots = np.zeros(points.shape[1], np.intp)
    for rows in row_slices(len(slots), 1, CHUNK):
        part = points[:, np.newaxis, rows]
        for level, boxes in enumerate(tree.levels[1:]):
            inner = tree.list_inner(level, slots[rows])
            sides = boxes.take(inner, axis=1)
            beyond = np.maximum(sides[:3] - part, part - sides[3:])
            np.maximum(beyond, 0.0, out=beyond)
            # Of boxes about the point, the one whose middle is nearest.
            middle = (sides[:3] + sides[3:]) / 2 - part
            squares = dot(beyond, beyond, -3) + NEARNESS * dot(middle, middle, -3)
            slots[rows] = inner[squares.argmin(axis=0), np.arange(inner.shape[1])]
    return tree.leaves.take(slots)


def _search(
    tree: TriangleTree, points: FloatArray, guess: Ints, reach: float
) -> tuple[Ints, FloatArray]:
    """Slots and squares (g · size,) for groups of points (3, g, size)."""
    _, groups, size = points.shape
    slots, squares = guess.copy(), np.empty(groups * size)
    for rows in row_slices(groups, size, CHUNK):
        flat = slice(rows.start * size, rows.stop * size)
        part = points[:, rows]
        squares[flat] = tree.frames.measure_squares(part.reshape(3, -1), slots[flat], reach)
        _search_chunk(tree, part, reach, slots[flat], squares[flat])
    return slots, squares


def _search_chunk(
    tree: TriangleTree, points: FloatArray, reach: float, slots: Ints, squares: FloatArray
) -> None:
    """Lower `squares` (g · size,) of groups of points (3, g, size), and set `slots`."""
    frames, error = tree.frames, tree.frames.bound_error(reach)
    pairs = _find_candidates(tree, points, np.square(np.sqrt(squares) + error))
    if pairs is None:
        checkpoint()
        groups, size = points.shape[1:]
        if groups == 1:
            # Now each point is a group.
            points, groups, size = points.reshape(3, -1, 1), size, 1
        for rows in (slice(0, groups // 2), slice(groups // 2, groups)):
            at = slice(rows.start * size, rows.stop * size)
            _search_chunk(tree, points[:, rows], reach, slots[at], squares[at])
        return
    point, slot, from_box = pairs
    flat = points.reshape(3, -1)
    # The triangle with the nearest box is measured first: this excludes most of the others.
    least = np.full(len(squares), np.inf)
    np.minimum.at(least, point, from_box)
    first = np.zeros(len(squares), np.intp)
    is_first = (from_box == least.take(point)).nonzero()[0]
    first[point[is_first]] = slot[is_first]
    np.minimum(squares, frames.measure_squares(flat, first, reach), out=squares)
    near = (from_box <= np.square(np.sqrt(squares) + error).take(point)).nonzero()[0]
    point, slot = point[near], slot[near]
    measured = frames.measure_squares(flat.take(point, axis=1), slot, reach)
    np.minimum.at(squares, point, measured)
    # The lowest of the numbers of the triangles at the least distance.
    nearest = (measured == squares.take(point)).nonzero()[0]
    numbers = tree.order.take(slots)
    numbers[point[nearest]] = len(tree.order)
    np.minimum.at(numbers, point[nearest], tree.order.take(slot[nearest]))
    slots[:] = tree.slots.take(numbers)


def _find_candidates(
    tree: TriangleTree, points: FloatArray, limits: FloatArray
) -> tuple[Ints, Ints, FloatArray] | None:
    """Pairs of a point and a triangle that may be nearest to it, and how far its box is, squared.

    These are the triangles whose boxes are at most √limit from the point. Returns None if the
    pairs take too much memory and there are several points.
    """
    _, groups, size = points.shape
    low, high = points.min(axis=2), points.max(axis=2)
    largest = limits.reshape(groups, size).max(axis=1)
    item, box = np.arange(groups), np.zeros(groups, np.intp)
    extent, is_divided = float((high - low).max(axis=0).mean()), False
    for level, sides in enumerate(tree.levels):
        if level:
            if len(box) * tree.count_inner(level - 1) > MAX_PAIRS and len(limits) > 1:
                return None
            inner = tree.list_inner(level - 1, box)
            item, box = np.tile(item, len(inner)), inner.ravel()
        is_fine = tree.sizes[level] < extent or len(box) > MANY * groups
        if not is_divided and (is_fine or level == len(tree.levels) - 1):
            is_divided = True
            item = (item * size + np.arange(size)[:, np.newaxis]).ravel()
            box = np.tile(box, size)
            low = high = points.reshape(3, -1)
            largest = np.minimum(limits, largest.repeat(size))
        squares, farthest = _measure_boxes(sides, box, low, high, item)
        np.minimum.at(largest, item, farthest)
        near = (squares <= largest.take(item)).nonzero()[0]
        item, box = item[near], box[near]
    return item, tree.leaves.take(box), squares[near]


def _measure_boxes(
    boxes: FloatArray, box: Ints, low: Vectors, high: Vectors, item: Ints
) -> tuple[FloatArray, FloatArray]:
    """The squares (N,) of the least and the largest distances of pairs of two boxes.

    They are rounded down and up.

    Parameters
    ----------
    boxes : ndarray of float64, shape (6, n)
    box : ndarray of int, shape (N,)
    low, high : ndarray of float64, shape (3, k)
        The other boxes: the points of an item.
    item : ndarray of int, shape (N,)
    """
    least, largest = np.empty(len(item)), np.empty(len(item))
    for rows in row_slices(len(item), 1, PAIRS):
        which, sides = item[rows], boxes.take(box[rows], axis=1)
        first = low.take(which, axis=1)
        last = first if high is low else high.take(which, axis=1)
        ways = sides[:3] - last, first - sides[3:]
        beyond = np.maximum(*ways)
        np.maximum(beyond, 0.0, out=beyond)
        np.multiply(dot(beyond, beyond), ROUNDING, out=least[rows])
        across = np.minimum(*ways)
        np.multiply(dot(across, across), 2 - ROUNDING, out=largest[rows])
    return least, largest
