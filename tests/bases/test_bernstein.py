"""Bernstein bases: accurate to the last digits, never negative, cached."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact
from service.bases.bernstein import (
    bernstein,
    multiply,
    sample_basis,
    sample_grid_basis,
    sample_interleaved_basis,
    sample_parameters,
    sample_partials_basis,
)
from tests.strategies import Array, nets

ULP = 2.0**-52


def compute_exact_basis(degree: int, t: float) -> list[Fraction]:
    """C(n, i) tⁱ (1 − t)ⁿ⁻ⁱ in exact fractions."""
    x = Fraction(t)
    return [comb(degree, i) * x**i * (1 - x) ** (degree - i) for i in range(degree + 1)]


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 7, 15, 30, 64])
def test_every_value_is_right_to_about_n_units_in_its_last_place(degree: int) -> None:
    """The error of each value, also of the smallest, is compared with that value."""
    t = np.array([0.0, 1e-9, 0.1, 1 / 3, 0.5, 0.7, 1 - 2**-30, 1.0])
    basis = bernstein(degree, t)
    assert basis.shape == (len(t), degree + 1)
    for row, parameter in zip(basis.tolist(), t.tolist(), strict=True):
        for value, truth in zip(row, compute_exact_basis(degree, parameter), strict=True):
            # Subnormal floats have fewer digits, which is not an error of the recurrence.
            max_error = truth * Fraction((degree + 1) * ULP) + Fraction(degree * 2.0**-1074)
            assert abs(Fraction(value) - truth) <= max_error


@given(st.integers(0, 64), st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_values_are_not_negative_and_add_up_to_one(degree: int, t: list[float]) -> None:
    """The sum of each row is 1 up to one unit in the last place for each of its values."""
    basis = bernstein(degree, t)
    assert (basis >= 0).all()
    assert np.abs(basis.sum(axis=1) - 1).max() <= (degree + 1) * ULP


@given(st.integers(1, 64), st.integers(1, 40))
def test_curves_begin_and_end_exactly_at_control_points(degree: int, divisions: int) -> None:
    """At t = 0 and t = 1 one value is exactly 1 and the others are exactly 0."""
    basis = sample_basis(degree, divisions)
    np.testing.assert_array_equal(basis[0], np.eye(degree + 1)[0])
    np.testing.assert_array_equal(basis[-1], np.eye(degree + 1)[-1])


@given(st.integers(1, 1000))
def test_sample_parameters_are_correctly_rounded_fractions(divisions: int) -> None:
    """Sample i is i/divisions, rounded once; 0 and 1 are exact."""
    expected = [float(Fraction(i, divisions)) for i in range(divisions + 1)]
    assert sample_parameters(divisions).tolist() == expected


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_sampled_bases_are_cached_and_read_only(dtype: type[np.floating]) -> None:
    """A second call returns the same read-only array; each precision has an array of its own."""
    first, second = (
        (
            sample_basis(5, 11, dtype),
            sample_grid_basis((5, 2), (11, 3), dtype),
            sample_interleaved_basis(5, 11, dtype),
            sample_partials_basis((5, 2), (11, 3), dtype),
        )
        for _ in range(2)
    )
    for array, same_array in zip(first, second, strict=True):
        assert array is same_array
        assert array.dtype == dtype
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_grid_basis_is_the_product_of_the_bases_along_u_and_v() -> None:
    """The value of B_a B_b at sample (i, j) is B_a(i/4) B_b(j/5)."""
    grid = sample_grid_basis((3, 2), (4, 5)).reshape(4, 3, 5, 6)
    u, v = sample_basis(3, 4), sample_basis(2, 5)
    for a, b, i, j in np.ndindex(*grid.shape):
        assert grid[a, b, i, j] == u[i, a] * v[j, b]


@given(nets(limit=2), nets(limit=2))
def test_product_of_polynomials_is_the_product_of_their_values(first: Array, second: Array) -> None:
    """The product agrees with exact values of both factors, coordinate by coordinate.

    Coordinates of the factors are at most 2, so coordinates of the product are at most 4. 64 units
    in the last place of 4 are allowed.
    """
    product = multiply(np.moveaxis(first, -1, 0), np.moveaxis(second, -1, 0))
    net = exact.to_exact_net(np.moveaxis(product, 0, -1))
    first_net, second_net = exact.to_exact_net(first), exact.to_exact_net(second)
    for u, v in ((Fraction(0), Fraction(1)), (Fraction(1, 3), Fraction(3, 4))):
        result = exact.surface_point(net, u, v)
        factors = exact.surface_point(first_net, u, v), exact.surface_point(second_net, u, v)
        for value, a, b in zip(result, *factors, strict=True):
            assert abs(value - a * b) <= Fraction(64 * 4 * ULP)
