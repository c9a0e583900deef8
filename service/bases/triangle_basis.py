"""The bivariate Bernstein basis, and polynomials evaluated at all samples of a triangle."""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import (
    bernstein,
    binomials,
    elevation_matrix,
    round_basis,
    sample_basis,
)
from service.bases.cache import BASES
from service.bases.triangle import barycentric, count_points, degree_of, row_starts

MAX_CACHED_VALUES = 1 << 20
"""The most values of a basis that is cached. As float64 they take 8 MiB, the most that the cache
accepts."""


def triangle_bernstein(degree: int, points: FloatArray) -> FloatArray:
    """Bivariate Bernstein polynomials of degree n at barycentric points.

        B_ijk(r, s, t) = n!/(i! j! k!) r^i s^j t^k = B_k^n(t) · B_j^{n−k}(s / (r + s))

    Row k of the net needs the polynomials B_j^d of degree d = n − k at s' = s/(r+s). The recurrence
    B_j^d = r' B_j^{d−1} + s' B_{j−1}^{d−1} with r' = r/(r+s) computes the polynomials of all
    degrees 0 … n, so one recurrence serves all rows. Only products of non-negative numbers are
    added.

    Parameters
    ----------
    degree : int
        n ≥ 0.
    points : ndarray of float64, shape (m, 3)
        r, s, t ≥ 0 with sum 1.

    Returns
    -------
    ndarray of float64, shape ((n+1)(n+2)/2, m)
        One row for each control point.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 17.3.
    """
    r, s, t = points.T
    r_plus_s = r + s
    # At t = 1 all shares give the same values, because B_k^n(t) is 0 for k < n.
    is_apex = r_plus_s == 0
    r_plus_s = np.where(is_apex, 1.0, r_plus_s)
    r_share, s_share = np.where(is_apex, 1.0, r / r_plus_s), s / r_plus_s
    basis_t = bernstein(degree, t).T
    starts = row_starts(degree)
    basis = np.empty((starts[-1], len(points)))
    row = np.zeros((degree + 1, len(points)))
    row[0] = 1.0
    for d in range(degree + 1):
        if d:
            s_terms = row[:d] * s_share
            row[:d] *= r_share
            row[1 : d + 1] += s_terms
        k = degree - d
        np.multiply(row[: d + 1], basis_t[k], out=basis[starts[k] : starts[k + 1]])
    return basis


def is_small(degree: int, divisions: int) -> bool:
    """Whether the triangle basis of degree n at R divisions is small enough to be cached."""
    return count_points(degree) * count_points(divisions) <= MAX_CACHED_VALUES


def sample_triangle_basis(
    degree: int, divisions: int, dtype: type[np.floating] = np.float64
) -> RealArray:
    """The bivariate Bernstein basis of degree n at all samples of a triangle with R divisions.

    Returns
    -------
    ndarray, shape ((n+1)(n+2)/2, (R+1)(R+2)/2); cached, read-only
    """
    return BASES.array(
        ("triangle", degree, divisions, dtype),
        lambda: round_basis(triangle_bernstein(degree, barycentric(divisions)), dtype),
    )


def row_curves(nets: FloatArray) -> FloatArray:
    """The rows of a triangular net as curves in s / (r + s), all elevated to the degree n.

    Parameters
    ----------
    nets : ndarray of float64, shape ((n+1)(n+2)/2, m)

    Returns
    -------
    ndarray of float64, shape (n+1, n+1, m)
        The control points of each row.
    """
    degree = degree_of(len(nets))
    starts = row_starts(degree)
    rows = [nets[starts[k] : starts[k + 1]] for k in range(degree + 1)]
    return np.stack([elevation_matrix(len(row) - 1, degree) @ row for row in rows])


def evaluate_rows(
    curves: FloatArray, divisions: int, rows: range, dtype: type[np.floating], out: RealArray
) -> None:
    """Evaluate polynomials over a triangle at some rows of samples, each row as a curve.

    Along a row of samples t is constant, and the surface is the curve Σ_k B_k^n(t) c_k, where c_k
    are the row curves of the net. To evaluate this curve takes n + 1 multiplications for each
    value; with the basis of the whole triangle it would take n²/2.

    Parameters
    ----------
    curves : ndarray of float64, shape (n+1, n+1, m)
        From `row_curves`.
    divisions : int
        R.
    rows : range
        The numbers of the rows of samples; row k has t = k / R.
    dtype : float32 or float64
    out : ndarray, shape (m, samples of these rows)
        The function writes the values here.
    """
    degree, count = len(curves) - 1, curves.shape[2]
    basis_t = sample_basis(degree, divisions)[rows.start : rows.stop]
    lines = (basis_t @ curves.reshape(degree + 1, -1)).reshape(len(rows), degree + 1, count)
    # Row by row the m control points of one curve in u' = s / (r + s): shape (rows, m, n+1).
    lines = lines.transpose(0, 2, 1).astype(dtype)
    begin = 0
    for line, row in zip(lines, rows, strict=True):
        end = begin + divisions - row + 1
        np.matmul(line, _row_basis(degree, divisions - row, dtype), out=out[:, begin:end])
        begin = end


def _row_basis(degree: int, divisions: int, dtype: type[np.floating]) -> RealArray:
    """The Bernstein basis C(n, j) s^j (1 − s)^{n−j} at s = 0, 1/R, …, 1: shape (n+1, R+1).

    Each row of samples needs a basis of its own, which is used only once. The recurrence of
    `bernstein` would take n times as long as these powers. Powers may underflow; at degrees up to
    64 the powers that underflow are too small to change a sum.
    """
    powers = np.ones((degree + 1, divisions + 1))
    if degree and divisions:
        powers[1] = np.arange(divisions + 1) / divisions
        # Powers 0 … count − 1 are known, and count is a power of 2: s^(count + k) = s^count s^k.
        count = 2
        while count <= degree:
            step = min(count, degree + 1 - count)
            np.multiply(powers[count // 2] ** 2, powers[:step], out=powers[count : count + step])
            count += step
    elif degree:
        # A single sample, at s = 0.
        powers[1:] = 0.0
        return round_basis(powers, dtype)
    # In reverse order, powers of s are powers n − j of 1 − s.
    basis = powers * powers[::-1, ::-1]
    basis *= binomials(degree)[:, None]
    return round_basis(basis, dtype)


def evaluate_triangles(nets: FloatArray, divisions: int) -> FloatArray:
    """Evaluate polynomials over triangles at all samples of R divisions, in any dimension d.

    Parameters
    ----------
    nets : ndarray of float64, shape (P, (n+1)(n+2)/2, d)

    Returns
    -------
    ndarray of float64, shape (P, (R+1)(R+2)/2, d)
    """
    patches, count, dimension = nets.shape
    degree = degree_of(count)
    columns = np.ascontiguousarray(nets.transpose(1, 0, 2)).reshape(count, -1)
    values = np.empty((columns.shape[1], count_points(divisions)))
    if is_small(degree, divisions):
        np.matmul(columns.T, sample_triangle_basis(degree, divisions), out=values)
    else:
        evaluate_rows(row_curves(columns), divisions, range(divisions + 1), np.float64, values)
    return values.reshape(patches, dimension, -1).transpose(0, 2, 1)
