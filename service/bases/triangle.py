"""Triangular Bernstein polynomials: the order of control points, elevation, splitting, conversion.

A triangle is stored row after row. Row m of a net of degree n has the n + 1 − m control points
b_ijk with k = m, in the order of ascending j. In barycentric coordinates (r, s, t), the first row
is the side t = 0; the last row is the corner t = 1. Samples at R divisions have the order of the
control points of a net of degree R. Nets have their K = (n+1)(n+2)/2 points along axis 0.

As in `service.bases.polynomials`, elevation and splitting compute weighted means of neighbours.

Farin, Curves and Surfaces for CAGD, 5th ed., chapter 17.
"""

from collections.abc import Iterator
from functools import lru_cache
from math import comb, isqrt

import numpy as np

from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import elevation_matrix
from service.bases.cache import BASES
from service.bases.polynomials import Net


def count_points(degree: int) -> int:
    """(n+1)(n+2)/2: the number of control points of degree n, and of samples at n divisions."""
    return (degree + 1) * (degree + 2) // 2


def degree_or_none(count: int) -> int | None:
    """The degree of a net of `count` control points; None if no triangle has this count."""
    degree = (isqrt(8 * count + 1) - 3) // 2
    return degree if degree >= 0 and count_points(degree) == count else None


def degree_of(count: int) -> int:
    """The degree of a net of `count` control points.

    Raises
    ------
    ValueError
        No triangle has this count.
    """
    degree = degree_or_none(count)
    if degree is None:
        raise ValueError(f"{count} control points make no triangle")
    return degree


@lru_cache(maxsize=256)
def row_starts(degree: int) -> Ints:
    """The index of the first point of each row, then the number of all points.

    Shape (n+2,); read-only.
    """
    starts = np.concatenate([[0], np.cumsum(np.arange(degree + 1, 0, -1))]).astype(np.intp)
    starts.flags.writeable = False
    return starts


@lru_cache(maxsize=256)
def side_rows(degree: int) -> Ints:
    """The indices of the points along the sides s = 0, r = 0 and t = 0, each of them ascending.

    With s = u (1 − v) and t = v, these are the sides u = 0, u = 1 and v = 0, in the order of the
    four sides of a patch. Shape (3, n+1); read-only.
    """
    row_firsts = row_starts(degree)[:-1]
    j = np.arange(degree + 1)
    rows = np.stack([row_firsts, row_firsts + degree - j, j])
    rows.flags.writeable = False
    return rows


def barycentric(divisions: int, begin: int = 0, end: int | None = None) -> FloatArray:
    """The barycentric coordinates (r, s, t) of the samples `begin` … `end` − 1 at R divisions.

    The default is all samples. Each number is a correctly rounded quotient; shape (m, 3).
    """
    starts = row_starts(divisions)
    index = np.arange(begin, starts[-1] if end is None else end)
    row = np.searchsorted(starts, index, side="right") - 1
    j = index - starts[row]
    return np.stack([divisions - row - j, j, row], axis=1) / divisions


def exponents(degree: int) -> tuple[Ints, Ints, Ints]:
    """The exponents i, j and k of every control point b_ijk of a net, three arrays (K,)."""
    k = np.repeat(np.arange(degree + 1), np.arange(degree + 1, 0, -1))
    j = np.arange(len(k)) - row_starts(degree)[k]
    return degree - j - k, j, k


def find_index(degree: int, j: Ints, k: Ints) -> Ints:
    """The index of b_ijk along axis 0 of a net."""
    return row_starts(degree)[k] + j


def elevate(net: Net, degree: int) -> Net:
    """The net of the same polynomials in a higher degree; each step raises the degree by one.

        b*_ijk = (i b_{i−1,j,k} + j b_{i,j−1,k} + k b_{i,j,k−1})/(n+1)

    From a side alone, `service.bases.polynomials.elevate` computes the same points, bit for bit.
    """
    points, weights = net
    for n in range(degree_of(len(points)), degree):
        i, j, k = exponents(n + 1)
        index = np.stack([find_index(n, j, k), find_index(n, j - 1, k), find_index(n, j, k - 1)])
        shares = np.stack([i, j, k])
        # A neighbour outside the triangle has the share 0; b_n00, at index 0, stands for it.
        index[shares == 0] = 0
        points, weights = combine(points, weights, index, shares / (n + 1))
    return points, weights


def elevation_shares(low: int, high: int) -> FloatArray:
    """The matrix of degree elevation from `low` to `high`: rows are new control points.

        E_IJ = C(i, i′) C(j, j′) C(k, k′) / C(high, low),   I = (i, j, k), J = (i′, j′, k′)

    It is cached and read-only.
    """

    def build() -> FloatArray:
        binomials = np.array(
            [[float(comb(n, k)) for k in range(high + 1)] for n in range(high + 1)]
        )
        shares = np.full((count_points(high), count_points(low)), 1 / comb(high, low))
        for new, old in zip(exponents(high), exponents(low), strict=True):
            shares *= binomials[new[:, np.newaxis], old]
        return shares

    return BASES.array(("triangle elevation", low, high), build)


def split(net: Net, point: tuple[float, float, float]) -> tuple[Net, Net, Net]:
    """The three triangles into which a point (r, s, t) divides a triangle, by de Casteljau.

    In each triangle the point replaces one corner: b_n00 in the first, b_0n0 in the second, b_00n
    in the third. The control points of an edge that two triangles share are computed once.
    """
    points, weights = net
    n = degree_of(len(points))
    levels = [net]
    for m in range(n - 1, -1, -1):
        _, j, k = exponents(m)
        index = np.stack(
            [find_index(m + 1, j, k), find_index(m + 1, j + 1, k), find_index(m + 1, j, k + 1)]
        )
        shares = np.repeat(np.array(point)[:, np.newaxis], len(j), axis=1)
        points, weights = combine(points, weights, index, shares)
        levels.append((points, weights))
    i, j, k = exponents(n)
    zeros = np.zeros_like(i)
    # Point ijk of the first triangle is b_0jk after i steps; of the second, b_i0k after j steps; of
    # the third, b_ij0 after k steps.
    return (
        _gather_levels(levels, i, j, k),
        _gather_levels(levels, j, zeros, k),
        _gather_levels(levels, k, j, zeros),
    )


def _gather_levels(levels: list[Net], level: Ints, j: Ints, k: Ints) -> Net:
    """A net of one point for each entry of `level`, `j` and `k`, from de Casteljau's levels.

    `levels[m]` is the net after m steps. Entry e takes the point b_{·,j[e],k[e]} of
    `levels[level[e]]`.
    """
    n = len(levels) - 1
    sources = [
        (levels[m], int(find_index(n - m, j_e, k_e)))
        for m, j_e, k_e in zip(level.tolist(), j, k, strict=True)
    ]
    points = np.stack([net_points[index] for (net_points, _), index in sources])
    weights = [net_weights[index] for (_, net_weights), index in sources if net_weights is not None]
    return points, np.stack(weights) if weights else None


def exchange_order(degree: int, first: int, second: int) -> Ints:
    """The order of the control points after two of the barycentric coordinates are exchanged.

    `first` and `second` are the numbers of these coordinates: 0, 1 or 2. `net[order]` is the new
    net.
    """
    coordinates = list(exponents(degree))
    coordinates[first], coordinates[second] = coordinates[second], coordinates[first]
    return find_index(degree, coordinates[1], coordinates[2])


def lower_half(net: Net) -> Net:
    """The triangle of degree p + q over the corners (0, 0), (1, 0), (0, 1) of a tensor-product net.

        b_ijk = Σ_bc C(i, p−b−k+c) C(j, b) C(k, c) / C(p+q, p) P_bc

    b_ijk is the blossom of the triangle at p + q arguments: i times the first corner, j times the
    second, k times the third. It is a mean over all ways to choose p of these arguments for the
    blossom of the patch in u; the remaining q arguments are for the blossom in v. In the formula, b
    of the p arguments are the second corner, and c of the q arguments are the third corner.

    Parameters
    ----------
    net : (points, weights)
        Shapes (p+1, q+1, …, d) and (p+1, q+1, …); weights may be None.

    Returns
    -------
    (points, weights)
        Shapes ((n+1)(n+2)/2, …, d) and ((n+1)(n+2)/2, …) with n = p + q; weights may be None.
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
    """Tensor-product nets of degree (n, n) of triangles of degree n, with s = u (1 − v) and t = v.

    Row k of a triangular net is a curve of degree n − k in u. Elevated to degree n, this curve is
    column k of the tensor-product net. The last row of a triangle is one point, which becomes the
    whole side v = 1.

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
    tensor_nets = np.empty((patches, degree + 1, degree + 1, dimension))
    for k in range(degree + 1):
        row = nets[:, starts[k] : starts[k + 1]]
        tensor_nets[:, :, k] = np.einsum("lj,pjd->pld", elevation_matrix(degree - k, degree), row)
    return tensor_nets


def _choose(n: Ints, k: Ints) -> FloatArray:
    """Binomials C(n, k), element by element; 0 where k is not in 0 … n."""
    max_n = int(n.max())
    table = np.array([[float(comb(a, b)) for b in range(max_n + 1)] for a in range(max_n + 1)])
    return np.asarray(np.where((k >= 0) & (k <= n), table[n, np.clip(k, 0, max_n)], 0.0))


def row_runs(divisions: int, limit: int) -> Iterator[tuple[int, int]]:
    """Runs [first, last) of rows with at most `limit` samples together, or of one row."""
    starts, first = row_starts(divisions), 0
    while first <= divisions:
        fitting = np.searchsorted(starts, starts[first] + limit, side="right") - 1
        last = max(first + 1, int(fitting))
        yield first, last
        first = last


def locate_samples(divisions: int, sample: Ints) -> tuple[FloatArray, FloatArray]:
    """Parameters (s, t) of samples at equal divisions, from their numbers."""
    starts = row_starts(divisions)
    row = np.searchsorted(starts, sample, side="right") - 1
    return (sample - starts[row]) / divisions, row / divisions
