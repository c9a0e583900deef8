"""Distances of points to the nearest of many triangles: first upper bounds, then true distances.

The guess uses a few triangles near each point. It is never too small, so a small guess needs no
check. The largest guesses are replaced by true distances, to all triangles in balls that are no
further away than the guess. This ends when the largest true distance exceeds every remaining guess.
"""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array: TypeAlias = NDArray[np.float64]
Index: TypeAlias = NDArray[np.intp]

NEAREST = 3
"""Number of triangles that a guess uses."""

FLAT = 1e-10
"""A triangle whose height is a smaller share of its length is replaced by its three sides."""


def measure_distances(points: Array, corners: Array) -> Array:
    """Distance (m,) of each point (m, 3) to its own triangle (m, 3, 3)."""
    point = np.ascontiguousarray(points.T)
    a, b, c = np.ascontiguousarray(corners.transpose(1, 2, 0))
    sides = [(end - start, point - start, point - end) for start, end in ((a, b), (b, c), (c, a))]
    squares = [_dot(along, along) for along, _, _ in sides]
    square = np.minimum.reduce(
        [_measure_to_segments(*side, length) for side, length in zip(sides, squares, strict=True)]
    )
    normal = _cross(sides[0][0], -sides[2][0])
    area = _dot(normal, normal)
    over = area > (FLAT * np.maximum.reduce(squares)) ** 2
    for along, start, _ in sides:
        over &= _dot(_cross(normal, along), start) >= 0
    height = _dot(sides[0][1], normal) ** 2 / np.where(area > 0, area, 1.0)
    return np.sqrt(np.where(over, np.minimum(height, square), square))


def _measure_to_segments(along: Array, start: Array, end: Array, square: Array) -> Array:
    """Square of the distance to a segment: its vector, the point seen from its ends, (3, m), and
    the square of its length.
    """
    t = np.clip(_dot(start, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    # Measured from the nearer end, so that no digits are lost near it.
    first = t < 0.5
    rest = np.where(first, start, end) - np.where(first, t, t - 1.0) * along
    return _dot(rest, rest)


def _dot(a: Array, b: Array) -> Array:
    """Inner products (m,) of columns (3, m)."""
    product: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def _cross(a: Array, b: Array) -> Array:
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


@dataclass(eq=False)
class Soup:
    """Triangles without order, (T, 3, 3)."""

    corners: Array
    tree: cKDTree = field(init=False)
    owner: Index = field(init=False)
    balls: list[tuple[cKDTree, Index, float]] = field(init=False)

    def __post_init__(self) -> None:
        places, self.owner = _spread_points(self.corners)
        self.tree = cKDTree(places)
        self.balls = _enclose_triangles(self.corners)

    def guess(self, points: Array) -> Array:
        """Distances (m,) that may be too large, never too small."""
        _, rows = self.tree.query(points, k=min(NEAREST, len(self.owner)))
        result = self.owner[np.asarray(rows).reshape(len(points), -1)]
        pairs = measure_distances(
            np.repeat(points, result.shape[1], axis=0), self.corners[result.ravel()]
        )
        nearest: Array = pairs.reshape(result.shape).min(axis=1)
        return nearest

    def distances(self, points: Array) -> Array:
        """True distances (m,)."""
        return self._true(points, self.guess(points))

    def farthest(self, points: Array) -> tuple[Array, float]:
        """Distances (m,), never too small, and the largest true distance.

        A distance up to the largest may be a guess.
        """
        result = self.guess(points)
        order = np.argsort(-result, kind="stable")
        largest, done, block = 0.0, 0, 32
        while done < len(order) and result[order[done]] > largest:
            rows = order[done : done + block]
            result[rows] = self._true(points[rows], result[rows])
            largest = max(largest, float(result[rows].max()))
            done, block = done + block, 2 * block
        return result, largest

    def _true(self, points: Array, guesses: Array) -> Array:
        """The least of the distances to all triangles in balls that are within the guess."""
        result = guesses.copy()
        for tree, triangles, radius in self.balls:
            reach = guesses * (1 + 1e-9) + radius
            near = tree.query_ball_point(points, reach, return_sorted=False)
            counts = np.array([len(rows) for rows in near])
            if counts.any():
                rows = np.repeat(np.arange(len(points)), counts)
                chosen = triangles[np.concatenate([np.array(r, dtype=np.intp) for r in near])]
                np.minimum.at(result, rows, measure_distances(points[rows], self.corners[chosen]))
        return result


def _enclose_triangles(corners: Array) -> list[tuple[cKDTree, Index, float]]:
    """Middles of the triangles' boxes, by size: a tree, the triangles in it, the largest radius."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    middles, radii = (low + high) / 2, np.sqrt(_dot((high - low).T, (high - low).T)) / 2
    size = np.frexp(radii)[1]
    groups = [np.flatnonzero(size == k) for k in np.unique(size)]
    return [(cKDTree(middles[g]), g, float(radii[g].max()) * (1 + 1e-9)) for g in groups]


def _spread_points(corners: Array) -> tuple[Array, Index]:
    """Points inside the triangles, more of them the longer a triangle is, and their owners."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    longest = np.max([_dot((q - p).T, (q - p).T) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    normal = _cross((b - a).T, (c - a).T)
    area = np.sqrt(_dot(normal, normal))
    shape = longest / np.maximum(area, longest / 64 + (longest == 0))
    places: list[Array] = []
    owners: list[Index] = []
    for divisions, least, most in ((1, 0, 1.7), (2, 1.7, 5), (4, 5, 12), (8, 12, 25), (16, 25, 99)):
        rows = np.flatnonzero((shape >= least) & (shape < most))
        weights = _list_middles(divisions)
        places.append((weights @ corners[rows]).reshape(-1, 3))
        owners.append(np.repeat(rows, len(weights)))
    return np.concatenate(places), np.concatenate(owners)


def _list_middles(divisions: int) -> Array:
    """Barycentric middles of the n² triangles that a triangle is divided into, (n², 3)."""
    upright = [(i + 1 / 3, j + 1 / 3) for i in range(divisions) for j in range(divisions - i)]
    turned = [(i + 2 / 3, j + 2 / 3) for i in range(divisions) for j in range(divisions - 1 - i)]
    at = np.array(upright + turned) / divisions
    return np.column_stack([1 - at.sum(axis=1), at])
