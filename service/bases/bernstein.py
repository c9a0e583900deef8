"""Bernstein bases at equal divisions, their products and degree elevation.

All results depend on degrees and divisions alone, not on control points; they are cached and
read-only.
"""

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.cache import PLANS


def bernstein(degree: int, t: ArrayLike) -> FloatArray:
    """Bernstein polynomials B_0^n … B_n^n at the parameters t.

        B_i^n(t) = (1 − t) B_i^{n−1}(t) + t B_{i−1}^{n−1}(t),  B_0^0 = 1

    The recurrence only adds products of non-negative numbers, so the error of each value is about n
    units in its last place (3e-15 at degree 100). At that degree, binomials would overflow and
    powers underflow.

    Parameters
    ----------
    degree : int
        n ≥ 0.
    t : array_like of float64, shape (m,)
        Parameters in [0, 1]. At 0 and 1 one value is exactly 1 and the others are 0.

    Returns
    -------
    ndarray of float64, shape (m, n+1)

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 5.1; Piegl and Tiller, The NURBS Book,
    2nd ed., Algorithm A1.3.
    """
    t = np.asarray(t, dtype=np.float64)
    basis = np.zeros((degree + 1, len(t)))
    basis[0] = 1.0
    for n in range(1, degree + 1):
        upper = basis[:n] * t
        basis[:n] *= 1.0 - t
        basis[1 : n + 1] += upper
    return np.ascontiguousarray(basis.T)


def sample_parameters(divisions: int) -> FloatArray:
    """The parameters i/R, i = 0 … R, both ends exact: shape (R+1,)."""
    return np.arange(divisions + 1) / divisions


def sample_basis(degree: int, divisions: int, dtype: type[np.floating] = np.float64) -> RealArray:
    """Bernstein basis at R equal divisions of [0, 1], shape (R+1, n+1); cached, read-only.

    Row R − k is row k in reverse order, bit for bit.
    """

    def build() -> RealArray:
        basis = bernstein(degree, sample_parameters(divisions))
        basis[-1 - divisions // 2 :] = basis[divisions // 2 :: -1, ::-1].copy()
        if divisions % 2 == 0:
            middle = basis[divisions // 2]
            middle[:] = (middle + middle[::-1]) / 2
        return round_basis(basis, dtype)

    return PLANS.array(("basis", degree, divisions, dtype), build)


def sample_basis_columns(
    degree: int, divisions: int, dtype: type[np.floating] = np.float64
) -> RealArray:
    """Transpose of `sample_basis`, shape (n+1, R+1): the right factor of a product; cached."""
    return PLANS.array(
        ("columns", degree, divisions, dtype), lambda: sample_basis(degree, divisions, dtype).T
    )


def sample_basis_with_slopes(degree: int, divisions: int) -> RealArray:
    """Basis at R equal divisions, and below it the derivatives ÷ n: one product gives C and C'.

        d/dt B_i^n ÷ n = B_{i−1}^{n−1} − B_i^{n−1}

    Returns
    -------
    ndarray of float64, shape (2(R+1), n+1); cached, read-only
    """

    def build() -> RealArray:
        below = np.pad(sample_basis(degree - 1, divisions), ((0, 0), (1, 1)))
        return np.concatenate([sample_basis(degree, divisions), below[:, :-1] - below[:, 1:]])

    return PLANS.array(("slopes", degree, divisions), build)


def sample_grid_basis(
    degree: tuple[int, int], resolution: tuple[int, int], dtype: type[np.floating] = np.float64
) -> RealArray:
    """Tensor-product basis at every sample of a grid, for one product per batch of nets.

        K[(i, j), (a, b)] = B_i^p(a/Ru) B_j^q(b/Rv)

    Returns
    -------
    ndarray, shape ((p+1)(q+1), (Ru+1)(Rv+1)); cached, read-only
    """
    return PLANS.array(
        ("grid", degree, resolution, dtype), lambda: _build_grid_basis(degree, resolution, dtype)
    )


def sample_partials_basis(
    degree: tuple[int, int], resolution: tuple[int, int], dtype: type[np.floating] = np.float64
) -> RealArray:
    """The bases for S, S_u and S_v at every sample of a grid, one below another.

    They are the results of `sample_grid_basis` for the degrees (p, q), (p − 1, q) and (p, q − 1).

    Returns
    -------
    ndarray, shape ((p+1)(q+1) + p(q+1) + (p+1)q, (Ru+1)(Rv+1)); cached, read-only
    """
    p, q = degree
    return PLANS.array(
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
    along_u, along_v = (sample_basis(n, r).T for n, r in zip(degree, resolution, strict=True))
    return round_basis(np.kron(along_u, along_v), dtype)


def sample_interleaved_basis(
    degree: int, divisions: int, dtype: type[np.floating] = np.float64
) -> RealArray:
    """Basis whose product with rows of points gives points side by side: kron(Bᵀ, I₃).

    Returns
    -------
    ndarray, shape (3(n+1), 3(R+1)); cached, read-only
    """
    return PLANS.array(
        ("interleaved", degree, divisions, dtype),
        lambda: round_basis(np.kron(sample_basis(degree, divisions).T, np.eye(3)), dtype),
    )


def round_basis(basis: RealArray, dtype: type[np.floating]) -> RealArray:
    """A basis in working precision, with negligible values set to 0; the argument is overwritten.

    At degree 64 most values are below any rounding of their sum, which is 1. Their products would
    be subnormal numbers, with which processors compute a hundred times slower.
    """
    basis[basis < np.finfo(dtype).eps ** 3] = 0.0
    return basis.astype(dtype, copy=False)


@lru_cache(maxsize=256)
def binomials(n: int) -> FloatArray:
    """Row n of Pascal's triangle, C(n, 0) … C(n, n), shape (n+1,); read-only."""
    row = np.array([float(comb(n, i)) for i in range(n + 1)])
    row.flags.writeable = False
    return row


def elevation_matrix(low: int, high: int) -> FloatArray:
    """Degree elevation as a matrix: shape (high+1, low+1); cached, read-only.

        E_lj = C(low, j) C(high − low, l − j) / C(high, l)

    Every row has non-negative numbers of sum 1; the first and the last row have one 1 and zeros.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 6.2.
    """

    def build() -> FloatArray:
        matrix = np.zeros((high + 1, low + 1))
        more = binomials(high - low)
        for j, factor in enumerate(binomials(low)):
            matrix[j : j + high - low + 1, j] = factor * more
        return matrix / binomials(high)[:, None]

    return PLANS.array(("elevation", low, high), build)


def multiply(first: FloatArray, second: FloatArray) -> FloatArray:
    """Product of two batches of Bernstein tensor polynomials, coefficient by coefficient.

        (f g)_kl = Σ_{i+a=k, j+b=l} C(p,i)C(r,a)/C(p+r,k) · C(q,j)C(s,b)/C(q+s,l) f_ij g_ab

    The factors of every sum are non-negative and add up to one: digits are lost only if the
    coefficients themselves cancel.

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
    (m, n), (r, s) = first.shape[-2:], second.shape[-2:]
    if m * n > r * s:
        return multiply(second, first)
    lead = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    left = first * _scale_factors(m, n)
    right = second * _scale_factors(r, s)
    product = np.zeros((*lead, m + r - 1, n + s - 1))
    for i in range(m):
        for j in range(n):
            product[..., i : i + r, j : j + s] += left[..., i, j, None, None] * right
    product /= _scale_factors(m + r - 1, n + s - 1)
    return product


def product_coefficients(first: tuple[int, int], second: tuple[int, int]) -> FloatArray:
    """The products of all pairs of Bernstein tensor polynomials of degrees (p, q) and (r, s).

    Returns
    -------
    ndarray of float64, shape ((p+1)(q+1)(r+1)(s+1), (p+r+1)(q+s+1)); cached, read-only
        Coefficients of the product of one polynomial of each basis; the index of the first basis
        varies slowest.
    """

    def build() -> FloatArray:
        one, other = ((m + 1, n + 1) for m, n in (first, second))
        bases = (np.eye(m * n).reshape(-1, m, n) for m, n in (one, other))
        left, right = bases
        return multiply(left[:, np.newaxis], right).reshape(len(left) * len(right), -1)

    return PLANS.array(("products", first, second), build)


def _scale_factors(rows: int, columns: int) -> NDArray[np.float64]:
    return np.multiply.outer(binomials(rows - 1), binomials(columns - 1))
