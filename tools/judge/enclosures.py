"""Intervals of least distances by the convex hull alone, with none of the engine's code.

A piece of a patch lies in the convex hull of its projected control points c_k (weights > 0). For
every unit vector e, here the one from the middle of the c_k to the point x,

    |x − S| ≥ min_k e · (x − c_k)

The gap between this bound and the distance decreases as the square of the size of a piece, because
e is almost normal to the surface at its nearest point. A corner of a net is a point of the surface.
A piece is dropped if its bound exceeds the distance of the nearest corner, less the width of the
interval.
"""

import numpy as np

from tools.judge.exact import Array

LEVELS, MOST = 60, 4000
"""Most halvings of a patch in each direction; most pieces of one point at a time."""

ROUNDING = 2.0**-44
"""The error of a control point after `LEVELS` halvings, relative to the largest coordinate: each
coordinate is a chain of at most 2 × 32 averages, and of quotients of weights up to 1000."""


def enclose_least_distances(nets: list[Array], points: Array, width: float) -> tuple[Array, Array]:
    """Intervals that contain the least distances of points to patches; NaN if not found.

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
    wrong = ROUNDING * (size + np.abs(points).max(axis=1))
    count, high = len(points), np.full(len(points), np.inf)
    pairs = [
        (np.repeat(np.arange(count), len(net)), np.tile(net, (count, 1, 1, 1))) for net in nets
    ]
    for _ in range(LEVELS):
        lows = []
        for point, pieces in pairs:
            low, corner = _bound_distances(pieces, points[point])
            np.minimum.at(high, point, corner + wrong[point])
            lows.append(low - wrong[point])
        near = [low < high[point] - width for (point, _), low in zip(pairs, lows, strict=True)]
        pieces_left = sum(
            np.bincount(point[left], minlength=count)
            for (point, _), left in zip(pairs, near, strict=True)
        )
        high[pieces_left > MOST] = np.nan
        pairs = [
            (np.repeat(point[left], 4), _split_quarters(pieces[left]))
            for (point, pieces), near_ones in zip(pairs, near, strict=True)
            for left in (near_ones & np.isfinite(high[point]),)
        ]
    for point, _ in pairs:
        high[point] = np.nan
    return high - width, high


def _bound_distances(nets: Array, x: Array) -> tuple[Array, Array]:
    """Lower bounds and distances of corners, for pairs of a net (p+1, q+1, 4) and a point."""
    points = (nets[..., :3] / nets[..., 3:]).reshape(len(nets), nets.shape[1] * nets.shape[2], 3)
    y = x[:, np.newaxis] - points
    rows, columns = nets.shape[1:3]
    ends = [0, columns - 1, (rows - 1) * columns, rows * columns - 1]
    corner = np.sqrt((y[:, ends] ** 2).sum(axis=2)).min(axis=1)
    middle = y.mean(axis=1, keepdims=True)
    length = np.sqrt((middle * middle).sum(axis=2))
    along = (y * middle).sum(axis=2) / np.where(length > 0, length, 1.0)
    return along.min(axis=1), corner


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
