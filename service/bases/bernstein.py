"""Bernstein bases at equal divisions, their products and degree elevation.

Most of the arrays depend on degrees and divisions alone, not on control points. Functions that
cache such an array say so; it is read-only.
"""

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray, RealArray
from service.bases.cache import BASES


def bernstein(degree: int, t: ArrayLike) -> FloatArray:
    """Bernstein polynomials B_0^n … B_n^n at the parameters t.

        B_i^n(t) = (1 − t) B_i^{n−1}(t) + t B_{i−1}^{n−1}(t),  B_0^0 = 1

    The recurrence only adds products of non-negative numbers, so no digits are lost: at degree 100
    the relative error of a value is about 1e-15. The recurrence needs no binomials, which overflow
    at high degrees, and no powers, which underflow.

    Parameters
    ----------
    degree : int
        n ≥ 0.
    t : array_like of float64, shape (m,)
        Parameters in [0, 1]. At t = 0 (or 1) the first (or last) polynomial is exactly 1, and the
        others are 0.

    Returns
    -------
    ndarray of float64, shape (m, n+1)

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 5.1; Piegl and Tiller, The NURBS Book,
    2nd ed., Algorithm A1.3.
    """
    t = np.asarray(t, dtype=np.float64)
    if degree == 0:
        return np.ones((len(t), 1))
    complement = 1.0 - t
    basis = np.empty((degree + 1, len(t)))
    basis[0], basis[1], basis[2:] = complement, t, 0.0
    for n in range(2, degree + 1):
        upper = basis[:n] * t
        basis[:n] *= complement
        basis[1 : n + 1] += upper
    return np.ascontiguousarray(basis.T)


def sample_parameters(divisions: int) -> FloatArray:
    """The parameters i/R for i = 0 … R, shape (R+1,); the first is exactly 0, the last 1."""
    return np.arange(divisions + 1) / divisions


def sample_basis(degree: int, divisions: int, dtype: type[np.floating] = np.float64) -> RealArray:
    """Bernstein basis at R equal divisions of [0, 1], shape (R+1, n+1); cached, read-only.

    Row R − k is row k in reverse order, bit for bit.
    """

    def build() -> RealArray:
        basis = bernstein(degree, sample_parameters(divisions))
        # The last rows are the first rows in reverse order, each row reversed, too.
        basis[-1 - divisions // 2 :] = basis[divisions // 2 :: -1, ::-1].copy()
        if divisions % 2 == 0:
            # Rounding can make the middle row differ from its reverse: take the mean of both.
            middle = basis[divisions // 2]
            middle[:] = (middle + middle[::-1]) / 2
        return round_basis(basis, dtype)

    return BASES.array(("basis", degree, divisions, dtype), build)


def sample_basis_columns(
    degree: int, divisions: int, dtype: type[np.floating] = np.float64
) -> RealArray:
    """Transpose of `sample_basis`, shape (n+1, R+1): the right factor of a product; cached."""
    return BASES.array(
        ("columns", degree, divisions, dtype), lambda: sample_basis(degree, divisions, dtype).T
    )


def sample_basis_with_slopes(degree: int, divisions: int) -> RealArray:
    """The Bernstein basis at R equal divisions, and below it the derivatives of the basis ÷ n.

        d/dt B_i^n ÷ n = B_{i−1}^{n−1} − B_i^{n−1}

    The product of this matrix and the control points has the rows C, then C' ÷ n, at all samples.
    The degree n is at least 1.

    Returns
    -------
    ndarray of float64, shape (2(R+1), n+1); cached, read-only
    """

    def build() -> RealArray:
        # The basis of degree n − 1, with a column of zeros on both sides.
        lower_basis = np.pad(sample_basis(degree - 1, divisions), ((0, 0), (1, 1)))
        slopes = lower_basis[:, :-1] - lower_basis[:, 1:]
        return np.concatenate([sample_basis(degree, divisions), slopes])

    return BASES.array(("slopes", degree, divisions), build)


def sample_grid_basis(
    degree: tuple[int, int], resolution: tuple[int, int], dtype: type[np.floating] = np.float64
) -> RealArray:
    """Tensor-product Bernstein basis at every sample of a grid.

        K[(i, j), (a, b)] = B_i^p(a/Ru) B_j^q(b/Rv)

    One matrix product with K evaluates all nets of a batch.

    Returns
    -------
    ndarray, shape ((p+1)(q+1), (Ru+1)(Rv+1)); cached, read-only
    """
    return BASES.array(
        ("grid", degree, resolution, dtype), lambda: _build_grid_basis(degree, resolution, dtype)
    )


def sample_partials_basis(
    degree: tuple[int, int], resolution: tuple[int, int], dtype: type[np.floating] = np.float64
) -> RealArray:
    """The bases for S, S_u and S_v at every sample of a grid, one below another.

    They are the results of `sample_grid_basis` for the degrees (p, q), (p − 1, q) and (p, q − 1),
    with p, q ≥ 1. Multiply those for S_u and S_v by differences of control points.

    Returns
    -------
    ndarray, shape ((p+1)(q+1) + p(q+1) + (p+1)q, (Ru+1)(Rv+1)); cached, read-only
    """
    p, q = degree
    return BASES.array(
        ("partials", degree, resolution, dtype),
        lambda: np.concatenate(
            [
                _build_grid_basis(degrees, resolution, dtype)
                for degrees in ((p, q), (p - 1, q), (p, q - 1))
            ]
        ),
    )


def _build_grid_basis(
    degree: tuple[int, int], resolution: tuple[int, int], dtype: type[np.floating]
) -> RealArray:
    """Build the array that `sample_grid_basis` caches."""
    basis_u, basis_v = (sample_basis(n, r).T for n, r in zip(degree, resolution, strict=True))
    return round_basis(np.kron(basis_u, basis_v), dtype)


def sample_interleaved_basis(
    degree: int, divisions: int, dtype: type[np.floating] = np.float64
) -> RealArray:
    """The matrix kron(Bᵀ, I₃), which evaluates curves whose points are stored as x y z x y z ….

    B is `sample_basis`. A row (C_0, …, C_n) of 3(n+1) numbers times the matrix is the row of the
    3(R+1) coordinates of the samples.

    Returns
    -------
    ndarray, shape (3(n+1), 3(R+1)); cached, read-only
    """
    return BASES.array(
        ("interleaved", degree, divisions, dtype),
        lambda: round_basis(np.kron(sample_basis(degree, divisions).T, np.eye(3)), dtype),
    )


def round_basis(basis: RealArray, dtype: type[np.floating]) -> RealArray:
    """Convert a basis to `dtype`, and set values below ε³ to 0; the argument is overwritten.

    The values of a basis add up to 1; ε is the rounding error of this sum. Values below ε³
    are many at high degrees, and far too small to matter. In float32 their products would be
    subnormal numbers, with which processors compute a hundred times slower.
    """
    basis[basis < np.finfo(dtype).eps ** 3] = 0.0
    return basis.astype(dtype, copy=False)


@lru_cache(maxsize=256)
def binomials(n: int) -> FloatArray:
    """Row n of Pascal's triangle, C(n, 0) … C(n, n), shape (n+1,); cached, read-only."""
    row = np.array([float(comb(n, i)) for i in range(n + 1)])
    row.flags.writeable = False
    return row


def elevation_matrix(low: int, high: int) -> FloatArray:
    """The matrix of degree elevation from `low` to `high`, shape (high+1, low+1).

        E_lj = C(low, j) C(high − low, l − j) / C(high, l)

    No number is negative, and every row has the sum 1. The first and the last row contain one 1 and
    zeros otherwise. The matrix is cached and read-only.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 6.2.
    """

    def build() -> FloatArray:
        matrix = np.zeros((high + 1, low + 1))
        step_binomials = binomials(high - low)
        for j, factor in enumerate(binomials(low)):
            matrix[j : j + high - low + 1, j] = factor * step_binomials
        return matrix / binomials(high)[:, None]

    return BASES.array(("elevation", low, high), build)


def multiply(first: FloatArray, second: FloatArray) -> FloatArray:
    """Bernstein coefficients of the products of polynomials in two variables, for two batches.

        (f g)_kl = Σ_{i+a=k, j+b=l} C(p,i)C(r,a)/C(p+r,k) · C(q,j)C(s,b)/C(q+s,l) f_ij g_ab

    In every sum the binomial factors are positive and add up to one. So digits are lost only if the
    products f_ij g_ab cancel.

    Parameters
    ----------
    first, second : ndarray of float64, shapes (…, p+1, q+1) and (…, r+1, s+1)
        Leading axes broadcast.

    Returns
    -------
    ndarray of float64, shape (…, p+r+1, q+s+1)

    References
    ----------
    Farouki and Rajan, Algorithms for polynomials in Bernstein form, CAGD 5 (1988).
    """
    (rows_1, columns_1), (rows_2, columns_2) = first.shape[-2:], second.shape[-2:]
    # The loops below run over the coefficients of the polynomial that has fewer.
    if rows_1 * columns_1 > rows_2 * columns_2:
        return multiply(second, first)
    rows, columns = rows_1 + rows_2 - 1, columns_1 + columns_2 - 1
    leading_shape = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    scaled_1 = first * _scale_factors(rows_1, columns_1)
    scaled_2 = second * _scale_factors(rows_2, columns_2)
    product = np.zeros((*leading_shape, rows, columns))
    for i in range(rows_1):
        for j in range(columns_1):
            terms = scaled_1[..., i, j, None, None] * scaled_2
            product[..., i : i + rows_2, j : j + columns_2] += terms
    product /= _scale_factors(rows, columns)
    return product


def product_coefficients(first: tuple[int, int], second: tuple[int, int]) -> FloatArray:
    """The product of each tensor-product Bernstein polynomial of one degree with each of another.

    Parameters
    ----------
    first, second : (int, int)
        The degrees (p, q) and (r, s).

    Returns
    -------
    ndarray of float64, shape ((p+1)(q+1)(r+1)(s+1), (p+r+1)(q+s+1)); cached, read-only
        Each row has the Bernstein coefficients of one product. The number of the polynomial of the
        first degree varies slowest.
    """

    def build() -> FloatArray:
        # Polynomial k has the coefficient 1 at position k, and zeros otherwise.
        basis_1, basis_2 = (
            np.eye((m + 1) * (n + 1)).reshape(-1, m + 1, n + 1) for m, n in (first, second)
        )
        return multiply(basis_1[:, np.newaxis], basis_2).reshape(len(basis_1) * len(basis_2), -1)

    return BASES.array(("products", first, second), build)


def _scale_factors(rows: int, columns: int) -> FloatArray:
    """The binomials C(rows − 1, i) C(columns − 1, j), shape (rows, columns)."""
    return np.multiply.outer(binomials(rows - 1), binomials(columns - 1))
