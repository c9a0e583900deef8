"""Intervals of least distances by the convex hull alone, with none of the engine's code.

A piece of a patch lies in the convex hull of its projected control points c_k (weights > 0). For
every unit vector e, here the one from the middle of the c_k to the point x,

    |x − S| ≥ min_k e · (x − c_k)

The gap between this bound and the distance decreases as the square of the size of a piece, because
e is almost normal to the surface at its nearest point. A corner of a net is a point of the surface,
so the distance of the nearest corner of all pieces is an upper bound of the least distance. A piece
is dropped if its lower bound is at least this upper bound minus the width of the interval: then no
point of the piece makes the interval wider.
"""

import numpy as np

from tools.judge.exact import Array

MAX_HALVINGS = 60
"""The largest number of halvings of a patch in each direction. Intervals that can be found need
fewer than 30; the others end by `MAX_PIECES`."""

MAX_PIECES = 4000
"""The largest number of pieces that are kept for one point at a time."""

ROUNDING = 2.0**-43
"""The allowed error of a control point of a piece, relative to the largest coordinate. A halving in
both directions computes p + q averages one after the other, each with an error of at most 2⁻⁵³. So
this is enough for 1024 averages, for example for 30 halvings of degrees 15 and 15. With weights,
which have errors too, it is enough for half as many."""


def enclose_least_distances(nets: list[Array], points: Array, width: float) -> tuple[Array, Array]:
    """Intervals that contain the least distances of points from patches; NaN if not found.

    Parameters
    ----------
    nets : list of ndarray of float64, shape (m, p+1, q+1, 4)
        Homogeneous control points.
    points : ndarray of float64, shape (n, 3)
    width : float
        The width of the intervals.

    Returns
    -------
    low, high : ndarray of float64, shape (n,)
    """
    size = max(float(np.abs(net[..., :3] / net[..., 3:]).max()) for net in nets)
    rounding = ROUNDING * (size + np.abs(points).max(axis=1))
    count, high = len(points), np.full(len(points), np.inf)
    # Every point with every patch, for each array of nets: the numbers of points (k,), and nets
    # (k, p+1, q+1, 4). Later only pieces of patches that may contain the nearest point of a point.
    pairs = [
        (np.repeat(np.arange(count), len(net)), np.tile(net, (count, 1, 1, 1))) for net in nets
    ]
    for _ in range(MAX_HALVINGS):
        lows = []
        for numbers, pieces in pairs:
            low, corner_distance = bound_distances(pieces, points[numbers])
            np.minimum.at(high, numbers, corner_distance + rounding[numbers])
            lows.append(low - rounding[numbers])
        are_near = [
            low < high[numbers] - width for (numbers, _), low in zip(pairs, lows, strict=True)
        ]
        piece_counts = sum(
            np.bincount(numbers[is_near], minlength=count)
            for (numbers, _), is_near in zip(pairs, are_near, strict=True)
        )
        high[piece_counts > MAX_PIECES] = np.nan
        next_pairs = []
        for (numbers, pieces), is_near in zip(pairs, are_near, strict=True):
            is_kept = is_near & np.isfinite(high[numbers])
            next_pairs.append((np.repeat(numbers[is_kept], 4), _split_quarters(pieces[is_kept])))
        pairs = next_pairs
    for numbers, _ in pairs:
        high[numbers] = np.nan
    # All pieces were dropped, so no point of the patches is nearer than `high - width`.
    return high - width, high


def bound_distances(nets: Array, x: Array) -> tuple[Array, Array]:
    """Bounds of the distances of nets (m, p+1, q+1, 4) from points (m, 3), one point for each net.

    Returns lower bounds (m,) by the convex hulls, and the distances (m,) of the nearest corners.
    """
    points = (nets[..., :3] / nets[..., 3:]).reshape(len(nets), nets.shape[1] * nets.shape[2], 3)
    y = x[:, np.newaxis] - points
    rows, columns = nets.shape[1:3]
    corners = [0, columns - 1, (rows - 1) * columns, rows * columns - 1]
    corner_distance = np.sqrt((y[:, corners] ** 2).sum(axis=2)).min(axis=1)
    direction = y.mean(axis=1, keepdims=True)  # from the middle of the control points to x
    length = np.sqrt((direction * direction).sum(axis=2))
    along = (y * direction).sum(axis=2) / np.where(length > 0, length, 1.0)
    return along.min(axis=1), corner_distance


def _split_quarters(nets: Array) -> Array:
    """The four quarters of nets (m, p+1, q+1, 4), one after another, (4 m, p+1, q+1, 4)."""
    for axis in (1, 2):
        rows = np.moveaxis(nets, axis, 0)
        low, high = [rows[0]], [rows[-1]]
        while len(rows) > 1:
            rows = (rows[:-1] + rows[1:]) / 2
            low.append(rows[0])
            high.append(rows[-1])
        halves = np.stack([np.stack(low), np.stack(high[::-1])], axis=2)
        nets = np.moveaxis(halves, 0, axis + 1).reshape(2 * len(nets), *nets.shape[1:])
    return nets
