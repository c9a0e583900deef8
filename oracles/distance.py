"""Distances of points to the nearest of many triangles: first upper bounds, then true distances.

The upper bound of a point is its distance to a few triangles near it. The largest upper bounds are
replaced by true distances, until the largest true distance exceeds every remaining upper bound. The
true distance is the least distance to all triangles whose enclosing ball is no further away than
the upper bound.
"""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array: TypeAlias = NDArray[np.float64]
Index: TypeAlias = NDArray[np.intp]

NEAR_POINTS = 3
"""Number of nearest points on triangles whose triangles give an upper bound."""

FLAT = 1e-10
"""A triangle is replaced by its three sides if its height is less than this share of its longest
side."""


def measure_distances(points: Array, corners: Array) -> Array:
    """Distance (m,) of each point (m, 3) to its own triangle (m, 3, 3)."""
    point = np.ascontiguousarray(points.T)
    a, b, c = np.ascontiguousarray(corners.transpose(1, 2, 0))
    # For each side: its vector, and the vectors from its two ends to the point.
    sides = [(end - start, point - start, point - end) for start, end in ((a, b), (b, c), (c, a))]
    side_squares = [_dot(side, side) for side, _, _ in sides]
    to_sides = np.minimum.reduce(
        [
            _measure_to_segments(*side, square)
            for side, square in zip(sides, side_squares, strict=True)
        ]
    )
    normal = _cross(b - a, c - a)
    normal_square = _dot(normal, normal)
    # Whether the foot of the perpendicular from the point is inside the triangle.
    is_over = normal_square > (FLAT * np.maximum.reduce(side_squares)) ** 2
    for side, start, _ in sides:
        is_over &= _dot(_cross(normal, side), start) >= 0
    to_plane = _dot(point - a, normal) ** 2 / np.where(normal_square > 0, normal_square, 1.0)
    return np.sqrt(np.where(is_over, np.minimum(to_plane, to_sides), to_sides))


def _measure_to_segments(side: Array, start: Array, end: Array, square: Array) -> Array:
    """Squares (m,) of the distances of points to segments.

    `side` is the vector of a segment, `start` and `end` are the vectors from its ends to the point,
    all (3, m); `square` (m,) is the square of the length of the segment.
    """
    t = np.clip(_dot(start, side) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    # Computed from the nearer end, so that no digits are lost near it.
    is_nearer_start = t < 0.5
    offset = np.where(is_nearer_start, start, end) - np.where(is_nearer_start, t, t - 1.0) * side
    return _dot(offset, offset)


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
    """Triangles (T, 3, 3) without connectivity, in search trees.

    `tree` has points on the triangles, and `owner` the triangle of each of these points. `balls`
    has an entry for each group of triangles of about equal size: the tree of the centres of their
    enclosing balls, the numbers of the triangles, and the largest radius.
    """

    corners: Array
    tree: cKDTree = field(init=False)
    owner: Index = field(init=False)
    balls: list[tuple[cKDTree, Index, float]] = field(init=False)

    def __post_init__(self) -> None:
        points_on_triangles, self.owner = _spread_points(self.corners)
        self.tree = cKDTree(points_on_triangles)
        self.balls = _enclose_triangles(self.corners)

    def bound_above(self, points: Array) -> Array:
        """Upper bounds (m,) of the distances of points (m, 3)."""
        _, rows = self.tree.query(points, k=min(NEAR_POINTS, len(self.owner)))
        triangles = self.owner[np.asarray(rows).reshape(len(points), -1)]
        distances = measure_distances(
            np.repeat(points, triangles.shape[1], axis=0), self.corners[triangles.ravel()]
        )
        bounds: Array = distances.reshape(triangles.shape).min(axis=1)
        return bounds

    def distances(self, points: Array) -> Array:
        """True distances (m,) of points (m, 3)."""
        return self._measure_exactly(points, self.bound_above(points))

    def farthest(self, points: Array) -> tuple[Array, float]:
        """Upper bounds (m,) of the distances of points (m, 3), and the largest true distance.

        The upper bounds above the largest true distance are replaced by true distances.
        """
        result = self.bound_above(points)
        order = np.argsort(-result, kind="stable")
        # Blocks grow, because usually few points need their true distance.
        largest, begin, block = 0.0, 0, 32
        while begin < len(order) and result[order[begin]] > largest:
            rows = order[begin : begin + block]
            result[rows] = self._measure_exactly(points[rows], result[rows])
            largest = max(largest, float(result[rows].max()))
            begin, block = begin + block, 2 * block
        return result, largest

    def _measure_exactly(self, points: Array, bounds: Array) -> Array:
        """True distances (m,): the least distance to the triangles whose balls are near enough.

        A ball is near enough if its distance from the point is at most the upper bound.
        """
        result = bounds.copy()
        for tree, triangles, radius in self.balls:
            reach = bounds * (1 + 1e-9) + radius
            balls = tree.query_ball_point(points, reach, return_sorted=False)
            counts = np.array([len(rows) for rows in balls])
            if counts.any():
                rows = np.repeat(np.arange(len(points)), counts)
                near = triangles[np.concatenate([np.array(r, dtype=np.intp) for r in balls])]
                np.minimum.at(result, rows, measure_distances(points[rows], self.corners[near]))
        return result


def _enclose_triangles(corners: Array) -> list[tuple[cKDTree, Index, float]]:
    """Balls around the bounding boxes of triangles, grouped by size; see `Soup.balls`.

    The radii of a group differ at most by a factor of 2.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    middles, radii = (low + high) / 2, np.sqrt(_dot((high - low).T, (high - low).T)) / 2
    size = np.frexp(radii)[1]
    groups = [np.flatnonzero(size == k) for k in np.unique(size)]
    return [(cKDTree(middles[g]), g, float(radii[g].max()) * (1 + 1e-9)) for g in groups]


def _spread_points(corners: Array) -> tuple[Array, Index]:
    """Points (m, 3) inside the triangles, and the number (m,) of the triangle of each point.

    The more slender a triangle (longest side / height), the more points it has.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    side_squares = [_dot((q - p).T, (q - p).T) for p, q in ((a, b), (b, c), (c, a))]
    longest_square = np.max(side_squares, axis=0)
    normal = _cross((b - a).T, (c - a).T)
    double_area = np.sqrt(_dot(normal, normal))
    # At most 64; 0 if the triangle is a point.
    slenderness = longest_square / np.maximum(
        double_area, longest_square / 64 + (longest_square == 0)
    )
    points_on_triangles: list[Array] = []
    owners: list[Index] = []
    for divisions, min_slenderness, max_slenderness in (
        (1, 0, 1.7),
        (2, 1.7, 5),
        (4, 5, 12),
        (8, 12, 25),
        (16, 25, 99),
    ):
        rows = np.flatnonzero((slenderness >= min_slenderness) & (slenderness < max_slenderness))
        weights = _list_centres(divisions)
        points_on_triangles.append((weights @ corners[rows]).reshape(-1, 3))
        owners.append(np.repeat(rows, len(weights)))
    return np.concatenate(points_on_triangles), np.concatenate(owners)


def _list_centres(divisions: int) -> Array:
    """Barycentric centres (n², 3) of the n² triangles into which a triangle is divided."""
    upright = [(i + 1 / 3, j + 1 / 3) for i in range(divisions) for j in range(divisions - i)]
    inverted = [(i + 2 / 3, j + 2 / 3) for i in range(divisions) for j in range(divisions - 1 - i)]
    s_t = np.array(upright + inverted) / divisions
    return np.column_stack([1 - s_t.sum(axis=1), s_t])
