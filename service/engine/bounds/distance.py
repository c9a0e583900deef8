"""Bounds of the distance from a surface to a triangle of a mesh, by a net in the triangle's frame.

Let c_i = (x_i, h_i) be the points of the net: h_i are their heights over the plane of the reference
triangle T, x_i their projections onto it. Then

    d(S, T)² ≤ max_i (h_i² + d(x_i, T)²),   d(S, T)² ≤ H² + max_i d(x_i, T)²,   H ≥ |h(S)|,
    d(S, mesh) ≤ min(d(S, T), d(S, K) + max_e 2 δ_e sin(θ_e/2))

where K, the lens, is T with wedges beyond its edges, δ_e is a height over edge e, and θ_e the angle
by which the mesh is folded there. H is the exact maximum of the quadratic part of the heights plus
a bound of the rest. A projection inside T has distance 0; only the others are measured.

Proofs in docs/proofs.md: "The hull of a net", "Distance to a triangle", "Quadratic heights" and
"Wedges beyond edges".
"""

from functools import lru_cache
from math import comb

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.bounds.reference_triangles import ReferenceTriangles
from service.engine.nets.blossoms import list_exponents

INSIDE = 2.0**-46
"""A projection counts as inside T if it is at least this far from every edge; that is more than
rounding. All others are measured to the edges."""

TINY = float(np.finfo(np.float64).tiny)
"""The least positive number with full precision; a divisor in place of 0."""


def bound_distances(
    points: FloatArray, triangles: ReferenceTriangles, rise: FloatArray | float = np.inf
) -> FloatArray:
    """Bounds (m,) of the distances between surfaces and the mesh.

    Parameters
    ----------
    points : ndarray of float64, shape (m, 3, N)
        The nets of the surfaces: x, y and h in the frames of the triangles.
    rise : ndarray of float64, shape (m,)
        H, separate bounds of the absolute heights of the surfaces; infinite if there are none.
    """
    count, _, net_size = points.shape
    squared = points[:, 2] * points[:, 2]
    highest = squared.max(axis=1)
    out = _measure_outside(points[:, 0], points[:, 1], triangles)
    worst = np.maximum(np.maximum(out[0], out[1]), out[2])
    # A triangle with an edge that is a point has no inside.
    is_line = triangles.lengths.min(axis=0) == 0
    if is_line.any():
        worst[is_line] = np.maximum(worst[is_line], 0.0)
    # Rows: the largest squares of distances of each net in the plane to T and to K, the largest
    # squares of distances in space to T and to K, and the distance that folding back adds.
    largest = np.zeros((5, count))
    is_beyond = worst > -INSIDE
    beyond = is_beyond.ravel().nonzero()[0]
    if len(beyond):
        # The number of these points in each net; the net of each point; the nets that have some.
        sizes = np.add.reduce(is_beyond, axis=1, dtype=np.intp)
        net, rows = np.arange(count).repeat(sizes), sizes.nonzero()[0]
        flat = points.reshape(-1)
        # `beyond` are their numbers in arrays (m, N), `at` those of their x in `points` (m, 3, N).
        at = beyond + 2 * net_size * net
        x, y = flat.take(at), flat.take(at + net_size)
        values = _measure_to_edges(x, y, out.reshape(3, -1).take(beyond, axis=1), triangles, net)
        np.add(squared.reshape(-1).take(beyond), values[:2], out=values[2:4])
        first = (sizes.cumsum() - sizes)[rows]
        largest[:, rows] = np.maximum.reduceat(values, first, axis=1)
    height = np.minimum(np.sqrt(highest), rise)
    in_space = np.maximum(largest[2:4], highest)
    to_triangle, to_lens = np.sqrt(np.minimum(height * height + largest[:2], in_space))
    bound: FloatArray = np.minimum(to_triangle, to_lens + largest[4])
    return bound


def _measure_outside(x: FloatArray, y: FloatArray, triangles: ReferenceTriangles) -> FloatArray:
    """Signed distances of points (m, N) of the planes, positive outside of each edge: (3, m, N).

    For an edge from A with the unit tangent t, and a point P, the distance is (P − A) × t.
    """
    corners, tangents = triangles.corners, triangles.tangents
    # A × t, computed once for each triangle.
    begin = corners[:, 0] * tangents[:, 1] - corners[:, 1] * tangents[:, 0]
    out = np.empty((3, *x.shape))
    # Edge 0 is on the x axis and begins at 0.
    np.negative(y, out=out[0])
    np.multiply(x, tangents[1:, 1, :, np.newaxis], out=out[1:])
    out[1:] -= y * tangents[1:, 0, :, np.newaxis]
    out[1:] -= begin[1:, :, np.newaxis]
    return out


def _measure_to_edges(
    x: FloatArray, y: FloatArray, out: FloatArray, triangles: ReferenceTriangles, which: Ints
) -> FloatArray:
    """Squared distances of K points in planes from T and from the lens; folding distances: (5, K).

    These are rows 0, 1 and 4; rows 2 and 3 are for the caller, and not set.

    Parameters
    ----------
    x, y : ndarray of float64, shape (K,)
        Points that do not count as inside their triangles, in the frames of these.
    out : ndarray of float64, shape (3, K)
        Their signed distances outside of each edge.
    which : ndarray of int, shape (K,)
        The triangle of each point.
    """
    corners, tangents = triangles.corners, triangles.tangents
    begin = corners[:, 0] * tangents[:, 0] + corners[:, 1] * tangents[:, 1]
    along = x * tangents[:, 0].take(which, axis=1)
    along += y * tangents[:, 1].take(which, axis=1)
    along -= begin.take(which, axis=1)
    length = triangles.lengths.take(which, axis=1)
    # `foot` is the nearest point of the edge, as a distance from its beginning.
    foot = np.maximum(along, 0.0)
    np.minimum(foot, length, out=foot)
    # `along` becomes the squared distance from `foot`, measured along the edge, and `wedge` the
    # height of the wedge over `foot`: the lesser of the heights of its two sides.
    along -= foot
    along *= along
    wedge = foot * triangles.begins.take(which, axis=1)
    np.subtract(length, foot, out=foot)
    foot *= triangles.ends.take(which, axis=1)
    np.minimum(wedge, foot, out=wedge)
    # The lesser of the height of the wedge over `foot` and the height of the point over the edge.
    np.minimum(wedge, out, out=wedge)
    np.maximum(wedge, 0.0, out=wedge)
    values = np.empty((5, len(which)))
    (triangles.folds.take(which, axis=1) * wedge).max(axis=0, out=values[4])
    np.subtract(out, wedge, out=wedge)
    wedge *= wedge
    wedge += along
    wedge.min(axis=0, out=values[1])
    out *= out
    out += along
    out.min(axis=0, out=values[0])
    return values


def bound_heights(h: FloatArray, degree: int) -> FloatArray:
    """Bounds (m, k) of |h| over a triangle, for nets (m, k, N) of heights."""
    halfway, elevated = _build_quadratic_tables(degree)
    values = h @ halfway
    remainder = h - values @ elevated
    up, down = maximize_both_ways(values.transpose(2, 0, 1))
    up += np.maximum(remainder.max(axis=-1), 0.0)
    down -= np.minimum(remainder.min(axis=-1), 0.0)
    return np.maximum(up, down)


def maximize_both_ways(m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`maximize_quadratics` of m and of −m."""
    both = np.empty((3, 2, *m.shape[1:]))
    both[:, 0] = m
    np.negative(m, out=both[:, 1])
    up, down = maximize_quadratics(both)
    return up, down


def maximize_quadratics(m: FloatArray) -> FloatArray:
    """max(0, 4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0)) over the triangle; m is (3, …)."""
    low, high = np.minimum(m[0], m[1]), np.maximum(m[0], m[1])
    a, c = np.minimum(low, m[2]), np.maximum(high, m[2])
    b = np.maximum(low, np.minimum(high, m[2]))
    # a ≤ b ≤ c are the m_k. Where the excess is not 0, a is positive.
    excess = np.maximum(a + (b - c), 0.0)
    squared_cosine = excess / (2.0 * np.maximum(a, TINY)) * (excess / (2.0 * np.maximum(b, TINY)))
    largest: FloatArray = np.maximum(c, 0.0) / (1.0 - squared_cosine)
    return largest


@lru_cache(maxsize=64)
def _build_quadratic_tables(degree: int) -> tuple[FloatArray, FloatArray]:
    """Two matrices for nets of N points of one degree.

    The first (N, 3) maps nets to their values half-way along the edges; the second (3, N) has the
    nets of 4 λ_k λ_{k+1}.

    Half-way along an edge a net is Σ_i C(n, i) h_i / 2^n.
    """
    keys = list_exponents(degree)
    row = {key: number for number, key in enumerate(keys)}
    halfway = np.zeros((len(keys), 3))
    for k in range(3):
        for i in range(degree + 1):
            key = [0, 0, 0]
            key[k], key[(k + 1) % 3] = degree - i, i
            halfway[row[key[0], key[1], key[2]], k] = comb(degree, i) / 2**degree
    net = np.array(keys, dtype=np.float64).T
    elevated = 4.0 * net * net[[1, 2, 0]] / (degree * (degree - 1))
    for table in (halfway, elevated):
        table.flags.writeable = False
    return halfway, elevated
