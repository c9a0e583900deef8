"""Groups of neighbouring points, by halving: the order of a balanced k-d tree.

References
----------
Bentley, Multidimensional binary search trees used for associative searching, Communications of the
ACM 18 (1975).
"""

import numpy as np

from service.bases.arrays import Ints
from service.cancellation import checkpoint
from service.engine.vectors import Vectors


def group_points(points: Vectors, most: int) -> Ints:
    """Groups of neighbouring points of equal size.

    All points are halved at the median of the coordinate in which they differ most; so are the
    halves, and so on. In each step the halves are the rows of one array.

    Parameters
    ----------
    points : ndarray of float64, shape (3, n)
        At least one point.
    most : int
        The most points of a group.

    Returns
    -------
    ndarray of int, shape (2^k, size)
        The numbers of the points. So that all groups have the same size, some points occur
        twice. Two groups that follow one another, the first with an even number, are
        neighbours, and so are four, and so on.
    """
    count, groups = points.shape[1], 1
    while groups * most < count:
        groups *= 2
    size = -(-count // groups)
    order: Ints = (np.arange(groups * size) * count // (groups * size))[np.newaxis]
    # Single precision is enough, because no result depends on where a group ends.
    largest = float(np.abs(points).max()) or 1.0
    rows = (points / largest).astype(np.float32)[:, order]
    while len(order) < groups:
        checkpoint()
        axis = (rows.max(axis=2) - rows.min(axis=2)).argmax(axis=0)
        values = rows[axis, np.arange(len(order))]
        halves = values.argpartition(values.shape[1] // 2 - 1, axis=1)
        order = np.take_along_axis(order, halves, 1).reshape(2 * len(order), -1)
        rows = np.take_along_axis(rows, halves[np.newaxis], 2).reshape(3, len(order), -1)
    return order
