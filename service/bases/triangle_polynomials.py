"""Nets of triangular Bernstein polynomials: degree elevation, splitting, reordering, conversion.

The net of degree n is one axis of K = (n+1)(n+2)/2 rows, row k of the triangle after row k − 1,
from b_{n−k,0,k} to b_{0,n−k,k}. As in `service.bases.polynomials`, each result is a mean of
neighbours. Farin, Curves and Surfaces for CAGD, 5th ed., chapter 17.
"""

from math import comb

import numpy as np

from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import elevation_matrix
from service.bases.polynomials import Net
from service.bases.triangle import degree_of, row_starts


def exponents(degree: int) -> tuple[Ints, Ints, Ints]:
    """i, j, k of every control point in the order of the net, each of shape (K,)."""
    k = np.repeat(np.arange(degree + 1), np.arange(degree + 1, 0, -1))
    j = np.arange(len(k)) - _start(degree, k)
    return degree - j - k, j, k


def row_number(degree: int, j: Ints, k: Ints) -> Ints:
    """Row of b_ijk in the net."""
    return _start(degree, k) + j


def elevate(net: Net, degree: int) -> Net:
    """The net of these polynomials in a higher degree, raised by one at a time.

        b*_ijk = (i b_{i−1,j,k} + j b_{i,j−1,k} + k b_{i,j,k−1})/(n+1)

    The sides are those that `service.bases.polynomials.elevate` computes, bit for bit.
    """
    points, weights = net
    for n in range(degree_of(len(points)), degree):
        i, j, k = exponents(n + 1)
        index = np.stack([row_number(n, j, k), row_number(n, j - 1, k), row_number(n, j, k - 1)])
        shares = np.stack([i, j, k])
        index[shares == 0] = 0
        points, weights = combine(points, weights, index, shares / (n + 1))
    return points, weights


def split(net: Net, at: tuple[float, float, float]) -> tuple[Net, Net, Net]:
    """The three triangles into which a point (r, s, t) divides a triangle.

    The point replaces one corner in each triangle: b_n00 in the first, b_00n in the last. de
    Casteljau; an edge that two triangles share is computed once.
    """
    points, weights = net
    n = degree_of(len(points))
    levels = [net]
    for m in range(n - 1, -1, -1):
        _, j, k = exponents(m)
        index = np.stack(
            [row_number(m + 1, j, k), row_number(m + 1, j + 1, k), row_number(m + 1, j, k + 1)]
        )
        shares = np.repeat(np.array(at)[:, np.newaxis], len(j), axis=1)
        points, weights = combine(points, weights, index, shares)
        levels.append((points, weights))
    i, j, k = exponents(n)
    nothing = np.zeros_like(i)
    return (
        _gather_levels(levels, i, j, k),
        _gather_levels(levels, j, nothing, k),
        _gather_levels(levels, k, j, nothing),
    )


def _gather_levels(levels: list[Net], level: Ints, j: Ints, k: Ints) -> Net:
    """One point of the given level for every row."""
    n = len(levels) - 1
    rows = [(le, int(_start(n - le, c)) + b) for le, b, c in zip(level, j, k, strict=True)]
    points = np.stack([levels[le][0][row] for le, row in rows])
    weights = [w[row] for le, row in rows if (w := levels[le][1]) is not None]
    return points, np.stack(weights) if weights else None


def exchange_order(degree: int, first: int, second: int) -> Ints:
    """Order of the rows of a net after two of the barycentric coordinates are exchanged."""
    turned = list(exponents(degree))
    turned[first], turned[second] = turned[second], turned[first]
    return row_number(degree, turned[1], turned[2])


def lower_half(net: Net) -> Net:
    """The triangle of degree p + q over the corners (0, 0), (1, 0), (0, 1) of a tensor net.

        b_ijk = Σ_bc C(i, p−b−k+c) C(j, b) C(k, c) / C(p+q, p) P_bc

    The blossom has p + q arguments: the first corner i times, the second j times, the third k
    times. The sum is over all choices of p arguments as parameters u; b of them are at the second
    corner. The q others are parameters v; c of them are at the third.

    Parameters
    ----------
    net : points (p+1, q+1, …, d) and weights (p+1, q+1, …) or None
    """
    points, weights = net
    p, q = points.shape[0] - 1, points.shape[1] - 1
    i, j, k = exponents(p + q)
    b, c = (axis.reshape(-1, 1) for axis in np.indices((p + 1, q + 1)))
    shares = _choose(i, p - b - k + c) * _choose(j, b) * _choose(k, c) / comb(p + q, p)
    index = np.repeat(np.arange(len(shares))[:, np.newaxis], len(i), axis=1)
    if weights is not None:
        weights = weights.reshape(-1, *weights.shape[2:])
    return combine(points.reshape(-1, *points.shape[2:]), weights, index, shares)


def tensor_net(nets: FloatArray) -> FloatArray:
    """Tensor nets of triangular polynomials, of degree (n, n): s = u (1 − v) and t = v.

    Row k of a triangle is a curve of degree n − k in u; raised to degree n it is column k of the
    square. The side v = 1 is the last row, one point.

    Parameters
    ----------
    nets : ndarray of float64, shape (P, (n+1)(n+2)/2, d)

    Returns
    -------
    ndarray of float64, shape (P, n+1, n+1, d)
    """
    patches, count, dimension = nets.shape
    degree = degree_of(count)
    starts = row_starts(degree)
    square = np.empty((patches, degree + 1, degree + 1, dimension))
    for k in range(degree + 1):
        row = nets[:, starts[k] : starts[k + 1]]
        square[:, :, k] = np.einsum("lj,pjd->pld", elevation_matrix(degree - k, degree), row)
    return square


def _choose(n: Ints, k: Ints) -> FloatArray:
    """Binomials C(n, k), zero for k outside 0 … n."""
    top = int(n.max())
    table = np.array([[float(comb(a, b)) for b in range(top + 1)] for a in range(top + 1)])
    inside = (k >= 0) & (k <= n)
    values: FloatArray = np.where(inside, table[n, np.clip(k, 0, top)], 0.0)
    return values


def _start(degree: int, k: Ints) -> Ints:
    """Index of the first point of row k of the triangle."""
    return row_starts(degree)[k]
