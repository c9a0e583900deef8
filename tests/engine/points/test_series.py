"""Power series, compared with fractions; their bounds of errors, compared with true errors."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.bernstein import bernstein
from service.engine.points.series import Series, expand

COUNT = 6

numbers = st.integers(-64, 64).map(lambda k: k / 7)
lists = st.lists(numbers, min_size=COUNT, max_size=COUNT)


def build_series(terms: list[float]) -> Series:
    """A series with exact terms."""
    array = np.array(terms)
    return Series(array, np.zeros(array.shape))


def multiply(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    """The exact Cauchy product, truncated to `COUNT` terms."""
    return [sum((a[i] * b[k - i] for i in range(k + 1)), Fraction(0)) for k in range(COUNT)]


def check_errors(series: Series, exact_terms: list[Fraction]) -> None:
    """Checks that each term is within its bound of the exact term, and that bounds are small."""
    scale = max(1.0, *(abs(float(x)) for x in exact_terms))
    for term, error, exact_term in zip(series.terms, series.errors, exact_terms, strict=True):
        assert abs(Fraction(float(term)) - exact_term) <= Fraction(float(error))
        assert error <= 1e-11 * scale


@given(lists, lists, lists)
def test_error_bounds_hold(a: list[float], b: list[float], c: list[float]) -> None:
    """Computes a b − c and (a b − c)/d, where the first term of d is 8."""
    exact = [[Fraction(x) for x in terms] for terms in (a, b, c)]
    difference = [x - y for x, y in zip(multiply(exact[0], exact[1]), exact[2], strict=True)]
    result = build_series(a) * build_series(b) - build_series(c)
    check_errors(result, difference)
    divisor = [8.0, *(x / 16 for x in b[1:])]
    quotient: list[Fraction] = []
    for k, x in enumerate(difference):
        # The term k of divisor · quotient is 8 times the new term, plus products of earlier terms.
        earlier_products = sum(
            (Fraction(divisor[i]) * quotient[k - i] for i in range(1, k + 1)), Fraction(0)
        )
        quotient.append((x - earlier_products) / 8)
    check_errors(result / build_series(divisor), quotient)
    check_errors((result + result).times(2.0), [4 * x for x in difference])


def test_errors_of_operands_propagate_to_results() -> None:
    """An error of 1e-3 in an operand gives an error of about 1e-3 in each result."""
    uncertain, one = Series(np.array([1.0, 1.0]), np.array([0.0, 1e-3])), build_series([1.0, 2.0])
    for result in (
        uncertain * one,
        uncertain / one,
        uncertain + one,
        uncertain - one,
        one / uncertain,
    ):
        assert 0.9e-3 <= result.errors[1] <= 1.2e-3
        assert result.errors[0] < 1e-12


def test_the_series_of_a_polynomial_is_the_polynomial() -> None:
    """Σ b_i B_i^n(t) = Σ a_k t^k; terms above the degree are zero."""
    coefficients = np.array([[3.0, -1, 4, 1, 5]])
    t = np.linspace(0, 1, 5)
    values = bernstein(4, t) @ coefficients[0]
    for count in (5, 8):
        terms = expand(coefficients, count).terms[0]
        np.testing.assert_allclose(np.polynomial.polynomial.polyval(t, terms), values, atol=1e-13)
    assert expand(coefficients, 3).terms.shape == (1, 3)


def test_the_tail_begins_with_the_term_of_its_order() -> None:
    """The tail of order 2 at s is 3 + 1 s. A series of four terms has no tail of order 4.

    The error includes the last term, here 1 s, as an estimate of the truncated terms.
    """
    result = Series(np.array([[1e-20, 1e-9, 3, 1]] * 3), np.full((3, 4), 1e-6))
    value, error = result.tail(np.array([2.0, 2.0, 4.0]), np.array([0.0, 0.5, 0.0]))
    np.testing.assert_array_equal(value, [3, 3.5, np.nan])
    assert error[0] == pytest.approx(1e-6)
    assert error[1] == pytest.approx(1.5e-6 + 0.5)
    assert np.isnan(error[2])
