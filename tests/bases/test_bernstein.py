"""Bernstein bases: exact to the last digits, positive, cached."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.bernstein import (
    bernstein,
    multiply,
    sample_basis,
    sample_grid_basis,
    sample_interleaved_basis,
    sample_parameters,
    sample_partials_basis,
)
from tests.oracles import exact
from tests.strategies import Array, nets

ULP = 2.0**-52


def compute_exact_basis(degree: int, t: float) -> list[Fraction]:
    """C(n, i) tⁱ (1 − t)ⁿ⁻ⁱ in exact fractions."""
    x = Fraction(t)
    return [comb(degree, i) * x**i * (1 - x) ** (degree - i) for i in range(degree + 1)]


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 7, 15, 30, 64])
def test_every_value_is_right_to_about_n_units_in_its_last_place(degree: int) -> None:
    """The error is relative to each value, also to the smallest."""
    t = np.array([0.0, 1e-9, 0.1, 1 / 3, 0.5, 0.7, 1 - 2**-30, 1.0])
    basis = bernstein(degree, t)
    assert basis.shape == (len(t), degree + 1)
    for row, parameter in zip(basis.tolist(), t.tolist(), strict=True):
        for value, truth in zip(row, compute_exact_basis(degree, parameter), strict=True):
            # Subnormal floats have fewer digits, which is not an error of the recurrence.
            allowed = truth * Fraction((degree + 1) * ULP) + Fraction(degree * 2.0**-1074)
            assert abs(Fraction(value) - truth) <= allowed


@given(st.integers(0, 64), st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_partition_of_unity_and_positivity(degree: int, t: list[float]) -> None:
    """No value is negative, and the sum is 1."""
    basis = bernstein(degree, t)
    assert (basis >= 0).all()
    assert np.abs(basis.sum(axis=1) - 1).max() <= (degree + 1) * ULP


@given(st.integers(1, 64), st.integers(1, 40))
def test_ends_are_exactly_the_first_and_the_last_control_point(degree: int, divisions: int) -> None:
    """The values are exactly zeros and a one."""
    basis = sample_basis(degree, divisions)
    np.testing.assert_array_equal(basis[0], np.eye(degree + 1)[0])
    np.testing.assert_array_equal(basis[-1], np.eye(degree + 1)[-1])


@given(st.integers(1, 1000))
def test_samples_are_the_rounded_fractions(divisions: int) -> None:
    """i/R, each rounded once, both ends exact."""
    expected = [float(Fraction(i, divisions)) for i in range(divisions + 1)]
    assert sample_parameters(divisions).tolist() == expected


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_plans_are_cached_and_read_only(dtype: type[np.floating]) -> None:
    """The cached array is read-only, and each precision has its own."""
    first, second = (
        (
            sample_basis(5, 11, dtype),
            sample_grid_basis((5, 2), (11, 3), dtype),
            sample_interleaved_basis(5, 11, dtype),
            sample_partials_basis((5, 2), (11, 3), dtype),
        )
        for _ in range(2)
    )
    for array, again in zip(first, second, strict=True):
        assert array is again
        assert array.dtype == dtype
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_grid_basis_is_the_product_of_the_two() -> None:
    """K[(a, b), (i, j)] = B_a(i/Ru) B_b(j/Rv)."""
    grid = sample_grid_basis((3, 2), (4, 5)).reshape(4, 3, 5, 6)
    u, v = sample_basis(3, 4), sample_basis(2, 5)
    for a, b, i, j in np.ndindex(*grid.shape):
        assert grid[a, b, i, j] == u[i, a] * v[j, b]


@given(nets(limit=2), nets(limit=2))
def test_product_of_polynomials_is_the_product_of_their_values(first: Array, second: Array) -> None:
    """The product agrees with exact values of both factors, coordinate by coordinate."""
    product = multiply(np.moveaxis(first, -1, 0), np.moveaxis(second, -1, 0))
    net = exact.to_exact_net(np.moveaxis(product, 0, -1))
    one, other = exact.to_exact_net(first), exact.to_exact_net(second)
    for u, v in ((Fraction(0), Fraction(1)), (Fraction(1, 3), Fraction(3, 4))):
        result = exact.surface_point(net, u, v)
        factors = exact.surface_point(one, u, v), exact.surface_point(other, u, v)
        for value, a, b in zip(result, *factors, strict=True):
            assert abs(value - a * b) <= Fraction(64 * 4 * ULP)
