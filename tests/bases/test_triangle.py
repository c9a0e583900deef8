"""Rows of a triangle and the bivariate Bernstein basis, compared with exact arithmetic."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import triangles
from service.bases import triangle, triangle_basis
from service.bases.bernstein import bernstein, elevation_matrix


def compute_exact_basis(degree: int, place: tuple[Fraction, ...]) -> list[Fraction]:
    """n!/(i! j! k!) rⁱ sʲ tᵏ for all (i, j, k), in the order in which the service stores them."""
    r, s, t = place
    return [
        factorial(degree) // (factorial(i) * factorial(j) * factorial(k)) * r**i * s**j * t**k
        for i, j, k in triangles.keys(degree)
    ]


def test_degree_and_number_of_points_determine_each_other() -> None:
    sizes = {triangle.count_points(n): n for n in range(70)}
    assert list(sizes)[:5] == [1, 3, 6, 10, 15]
    for count in range(max(sizes)):
        assert triangle.degree_or_none(count) == sizes.get(count)
    with pytest.raises(ValueError, match="no triangle"):
        triangle.degree_of(4)


@pytest.mark.parametrize("degree", range(6))
def test_points_are_stored_row_by_row(degree: int) -> None:
    """k is constant in a row, in which j rises.

    `side_rows` returns the numbers of the points of the sides s = 0, r = 0 and t = 0. k rises along
    the first two sides, and j along the third.
    """
    keys = triangles.keys(degree)
    starts = triangle.row_starts(degree)
    assert [keys[first][1:] for first in starts[:-1]] == [(0, k) for k in range(degree + 1)]
    assert starts[-1] == triangle.count_points(degree)
    # For each side: which of i, j and k is 0, and which of them rises.
    for numbers, (zero_index, rising_index) in zip(
        triangle.side_rows(degree), ((1, 2), (0, 2), (2, 1)), strict=True
    ):
        assert [keys[number] for number in numbers] == sorted(
            (key for key in keys if key[zero_index] == 0), key=lambda key: key[rising_index]
        )


@pytest.mark.parametrize("divisions", [1, 2, 3, 7, 49])
def test_barycentric_samples_are_correctly_rounded(divisions: int) -> None:
    truth = [[float(x) for x in place] for place in triangles.places(divisions)]
    assert triangle.barycentric(divisions).tolist() == truth
    assert triangle.barycentric(divisions, 1, 3).tolist() == truth[1:3]


@given(st.integers(0, 12), st.integers(1, 4))
def test_basis_values_are_accurate(degree: int, divisions: int) -> None:
    """Each value, also the smallest, has an error of a few units in its last place."""
    places = triangles.places(divisions)
    result = triangle_basis.triangle_bernstein(degree, triangle.barycentric(divisions))
    truth = np.array([compute_exact_basis(degree, place) for place in places]).astype(float).T
    np.testing.assert_allclose(result, truth, rtol=1e-14 * (degree + 1), atol=0)


@pytest.mark.parametrize("degree", [1, 3, 20, 64])
def test_basis_is_a_partition_of_unity(degree: int) -> None:
    """The sum is 1 also close to the corners, where r + s or t is tiny."""
    small = 2.0 ** -np.arange(1, 50)
    places = np.concatenate(
        [triangle.barycentric(9)]
        + [np.roll([1 - 3 * x, x, 2 * x], k)[None] for x in small for k in range(3)]
    )
    # For x = 1/2 the number 1 − 3x is below zero.
    places = np.abs(places)
    places /= places.sum(axis=1, keepdims=True)
    basis = triangle_basis.triangle_bernstein(degree, places)
    assert basis.min() >= 0
    assert np.abs(basis.sum(axis=0) - 1).max() < 1e-14
    # The net b_ijk = (i, j, k)/n has the value (r, s, t) at (r, s, t).
    assert np.abs(basis.T @ triangle.barycentric(degree) - places).max() < 1e-14


def test_basis_at_corners_is_exact_and_on_a_side_univariate() -> None:
    """At a corner one value is exactly 1, and the others are 0.

    On the side t = 0 the values are the values of the univariate basis.
    """
    corners = triangle_basis.triangle_bernstein(5, np.eye(3))
    assert (corners == 1).sum() == 3
    assert (corners == 0).sum() == 3 * 21 - 3
    s = np.arange(8) / 7
    side = triangle_basis.triangle_bernstein(5, np.stack([1 - s, s, np.zeros(8)], axis=1))
    np.testing.assert_allclose(side[:6].T, bernstein(5, s), rtol=1e-15)
    assert not side[6:].any()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_sampled_basis_is_cached_and_read_only(dtype: type[np.floating]) -> None:
    basis = triangle_basis.sample_triangle_basis(4, 11, dtype)
    assert basis is triangle_basis.sample_triangle_basis(4, 11, dtype)
    assert basis.shape == (15, 78)
    assert basis.dtype == dtype
    with pytest.raises(ValueError, match="read-only"):
        basis[0] = 1


@pytest.mark.parametrize("degree", [0, 1, 2, 5, 17, 40, 64])
@pytest.mark.parametrize("divisions", [1, 2, 33])
def test_evaluation_in_blocks_of_rows_agrees_with_the_whole_basis(
    degree: int, divisions: int
) -> None:
    rng = np.random.default_rng(degree)
    nets = rng.uniform(-1, 1, (triangle.count_points(degree), 4))
    truth = triangle_basis.triangle_bernstein(degree, triangle.barycentric(divisions)).T @ nets
    curves = triangle_basis.row_curves(nets)
    assert curves.shape == (degree + 1, degree + 1, 4)
    starts = triangle.row_starts(divisions)
    for dtype, limit in ((np.float64, 2e-14), (np.float32, 1e-5)):
        for low, high in ((0, divisions + 1), (1, 2), (divisions, divisions + 1)):
            out = np.empty((4, starts[high] - starts[low]), dtype)
            triangle_basis.evaluate_rows(curves, divisions, range(low, high), dtype, out)
            assert np.abs(out.T - truth[starts[low] : starts[high]]).max() < limit


@pytest.mark.parametrize(("low", "high"), [(0, 0), (0, 3), (1, 2), (2, 5), (3, 3), (20, 64)])
def test_elevation_matrix_expresses_lower_bernstein_polynomials(low: int, high: int) -> None:
    """Column i has the coefficients of polynomial i of degree `low` in the basis of degree
    `high`."""
    matrix = elevation_matrix(low, high)
    t = np.arange(12) / 11
    np.testing.assert_allclose(bernstein(high, t) @ matrix, bernstein(low, t), atol=1e-15)
    assert matrix.min() >= 0
    np.testing.assert_allclose(matrix.sum(axis=1), 1, rtol=1e-14)
    assert matrix[0].tolist() == [1.0] + [0.0] * low
    assert matrix[-1].tolist() == [0.0] * low + [1.0]


@given(st.integers(1, 6), st.integers(0, 5), st.integers(0, 5))
def test_the_tensor_net_of_a_triangle_is_the_same_polynomial(degree: int, i: int, j: int) -> None:
    """The tensor net at (u, v) equals the triangle at s = u (1 − v), t = v."""
    net = np.random.default_rng(degree).uniform(-1, 1, (1, triangle.count_points(degree), 2))
    u, v = i / 5, j / 5
    place = np.array([[(1 - u) * (1 - v), u * (1 - v), v]])
    tensor_net = triangle.tensor_net(net)[0]
    result = bernstein(degree, [u])[0] @ (bernstein(degree, [v])[0] @ tensor_net)
    truth = triangle_basis.triangle_bernstein(degree, place)[:, 0] @ net[0]
    np.testing.assert_allclose(result, truth, atol=1e-15)
