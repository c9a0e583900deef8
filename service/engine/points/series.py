"""Truncated power series with bounds of the errors of their coefficients.

The limit of a quotient of the form 0/0 is the quotient of the lowest coefficients that do not
vanish. Only a bound of the rounding error distinguishes a coefficient that vanishes from a small
coefficient.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import binomials

ROUNDING = 2.0**-50
"""A bound of the relative rounding error of one operation: more than a unit in the last place."""


@dataclass(frozen=True, eq=False, slots=True)
class Series:
    """An array of truncated power series a_0 + a_1 s + … + a_{T−1} s^{T−1}.

    Attributes
    ----------
    terms : ndarray of float64, shape (…, T)
    errors : ndarray of float64, shape (…, T)
        Bounds of the errors of the terms.
    """

    terms: FloatArray
    errors: FloatArray

    def axes(self, coordinates: slice | list[int]) -> "Series":
        """These coordinates of vectors (m, d, T)."""
        return Series(self.terms[:, coordinates], self.errors[:, coordinates])

    def __add__(self, other: "Series") -> "Series":
        """The sum, term by term."""
        terms = self.terms + other.terms
        return Series(terms, self.errors + other.errors + ROUNDING * np.abs(terms))

    def __sub__(self, other: "Series") -> "Series":
        """The difference, term by term."""
        terms = self.terms - other.terms
        return Series(terms, self.errors + other.errors + ROUNDING * np.abs(terms))

    def __mul__(self, other: "Series") -> "Series":
        """The Cauchy product c_k = Σ_i a_i b_{k−i}."""
        size, other_size = np.abs(self.terms), np.abs(other.terms)
        errors = _multiply_series(size + self.errors, other.errors + ROUNDING * other_size)
        errors += _multiply_series(self.errors, other_size)
        return Series(_multiply_series(self.terms, other.terms), errors)

    def __truediv__(self, other: "Series") -> "Series":
        """The quotient by a series that begins with a positive number, far from zero.

            q_k = (a_k − Σ_{i=1}^k b_i q_{k−i}) / b_0

        The error of each term affects all later terms.
        """
        terms, errors = np.array(self.terms), np.array(self.errors)
        first_divisor = other.terms[..., 0]
        size = np.abs(other.terms)
        for k in range(terms.shape[-1]):
            # b_1 … b_k, and q_{k−1} … q_0, which `terms` has already.
            b, size_b, error_b = (
                values[..., 1 : k + 1] for values in (other.terms, size, other.errors)
            )
            q, error_q = terms[..., :k][..., ::-1], errors[..., :k][..., ::-1]
            terms[..., k] -= (b * q).sum(axis=-1)
            term_errors = size_b * error_q + (ROUNDING * size_b + error_b) * np.abs(q)
            errors[..., k] += term_errors.sum(axis=-1)
            terms[..., k] /= first_divisor
            errors[..., k] /= first_divisor
            errors[..., k] += (ROUNDING + other.errors[..., 0] / first_divisor) * np.abs(
                terms[..., k]
            )
        return Series(terms, errors)

    def times(self, factor: float) -> "Series":
        """The series times a power of two, which is exact."""
        return Series(self.terms * factor, self.errors * abs(factor))

    def first(self) -> FloatArray:
        """The order (…) of the first term that certainly does not vanish, or T."""
        is_nonzero = np.abs(self.terms) > self.errors
        order: FloatArray = np.where(
            is_nonzero.any(axis=-1), is_nonzero.argmax(axis=-1), is_nonzero.shape[-1]
        ).astype(np.float64)
        return order

    def tail(self, order: FloatArray, s: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """The sum of the terms of each series from its `order` on, ÷ s^order, and its error.

            Σ_{j ≥ order} a_j s^{j−order}

        Both are NaN if the series has no term of that order. The error includes the absolute value
        of the last term, as an estimate of the truncated terms, unless the sum has only this term.
        """
        exponent = np.arange(self.terms.shape[-1]) - order[..., np.newaxis]
        powers = np.where(
            exponent >= 0, np.asarray(s)[..., np.newaxis] ** np.maximum(exponent, 0), 0.0
        )
        is_beyond = order >= self.terms.shape[-1]
        value = np.where(is_beyond, np.nan, (self.terms * powers).sum(axis=-1))
        truncation = np.where(exponent > 0, np.abs(self.terms * powers), 0.0)[..., -1]
        error = (self.errors * powers).sum(axis=-1) + truncation
        return value, np.where(is_beyond, np.nan, error)


def expand(coefficients: FloatArray, count: int, error: FloatArray | None = None) -> Series:
    """Polynomials in the Bernstein basis (…, n+1) as series of `count` terms about s = 0.

        a_k = C(n, k) Δ^k b_0

    A difference Δ^k is a sum of 2^k coefficients b_i, each with an error of at most `error` (…), by
    default `ROUNDING` times the largest coefficient.
    """
    degree = coefficients.shape[-1] - 1
    terms = np.zeros((*coefficients.shape[:-1], count))
    errors = np.zeros(terms.shape)
    error = ROUNDING * np.abs(coefficients).max(axis=-1) if error is None else error
    difference = coefficients
    for k in range(min(degree + 1, count)):
        factor = float(binomials(degree)[k])
        terms[..., k] = factor * difference[..., 0]
        errors[..., k] = factor * 2.0**k * error
        difference = np.diff(difference, axis=-1)
    return Series(terms, errors)


def dot_series(a: Series, b: Series) -> Series:
    """Scalar product of vectors (m, 3, T) of series: (m, T)."""
    products = a * b
    first, second, third = (Series(products.terms[:, k], products.errors[:, k]) for k in range(3))
    return first + second + third


def cross_series(a: Series, b: Series) -> Series:
    """Cross product of vectors (m, 3, T) of series."""
    # y, z, x times z, x, y, minus z, x, y times y, z, x.
    return a.axes([1, 2, 0]) * b.axes([2, 0, 1]) - a.axes([2, 0, 1]) * b.axes([1, 2, 0])


def _multiply_series(a: FloatArray, b: FloatArray) -> FloatArray:
    """The terms Σ_i a_i b_{k−i}, by a product with the matrix of all b_{k−i}."""
    count = a.shape[-1]
    exponent = np.subtract.outer(np.arange(count), np.arange(count))
    matrix = np.where(exponent >= 0, b[..., np.maximum(exponent, 0)], 0.0)
    product: FloatArray = np.einsum("...i,...ki->...k", a, matrix)
    return product
