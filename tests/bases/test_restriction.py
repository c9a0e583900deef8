"""Restrictions of Bézier polynomials to cells, compared with de Casteljau in exact arithmetic."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from oracles.exact import curve_point, surface_point, to_exact_net
from service.bases.polynomials import restrict_to_cells, restriction_matrices

breaks_in_quarters = st.lists(st.integers(-20, 20), min_size=2, max_size=6, unique=True).map(
    lambda numbers: np.array(sorted(numbers)) / 4
)


def evaluate_blossom(
    points: list[tuple[Fraction, ...]], parameters: list[Fraction]
) -> tuple[Fraction, ...]:
    """The blossom of a polynomial: de Casteljau's algorithm with another parameter at each step."""
    for t in parameters:
        points = [
            tuple((1 - t) * x + t * y for x, y in zip(a, b, strict=True))
            for a, b in pairwise(points)
        ]
    return points[0]


@given(st.integers(0, 7), breaks_in_quarters)
def test_rows_of_restriction_matrices_are_blossoms(degree: int, breaks: np.ndarray) -> None:
    rows = restriction_matrices(degree, breaks)
    unit = [tuple(Fraction(int(i == k)) for k in range(degree + 1)) for i in range(degree + 1)]
    low, high = Fraction(breaks[0]), Fraction(breaks[-1])
    t = [(Fraction(b) - low) / (high - low) for b in breaks]
    for k, (begin, end) in enumerate(pairwise(t)):
        for j in range(degree + 1):
            exact = [float(x) for x in evaluate_blossom(unit, [begin] * (degree - j) + [end] * j)]
            np.testing.assert_allclose(rows[k, j], exact, rtol=1e-13, atol=1e-16)


def test_cells_of_high_degree_are_accurate_and_share_their_ends() -> None:
    rows = restriction_matrices(64, np.array([0.0, 1e-3, 0.3, 0.5, 0.9, 1.0]))
    assert rows.min() >= 0
    np.testing.assert_allclose(rows.sum(axis=2), 1, rtol=1e-14)
    np.testing.assert_array_equal(rows[1:, 0], rows[:-1, -1])
    np.testing.assert_array_equal(rows[0, 0], np.eye(65)[0])
    np.testing.assert_array_equal(rows[-1, -1], np.eye(65)[-1])


def test_cells_are_in_order_and_have_the_values_of_the_whole_net() -> None:
    net = np.random.default_rng(4).random((4, 3, 2))
    u, v = np.array([0.0, 1.0, 4.0]), np.array([1.0, 2.0, 2.5, 3.0])
    cells = restrict_to_cells(net, u, v)
    assert cells.shape == (6, 4, 3, 2)
    exact_net = to_exact_net(net)
    half = Fraction(1, 2)
    for number, cell in enumerate(cells):
        row, column = divmod(number, 3)
        # The middle of the cell as a share of the domain [0, 4] × [1, 3].
        middle = (u[row] + u[row + 1]) / 8, ((v[column] + v[column + 1]) / 2 - 1) / 2
        expected = surface_point(exact_net, Fraction(middle[0]), Fraction(middle[1]))
        result = surface_point(to_exact_net(cell), half, half)
        np.testing.assert_allclose(
            [float(x) for x in result], [float(x) for x in expected], rtol=1e-14
        )
    # Cell 3 begins at u = 1, a quarter of [0, 4], and at v = 1, which is a side of the net.
    corner = curve_point([row_points[0] for row_points in exact_net], Fraction(1, 4))
    np.testing.assert_allclose(cells[3, 0, 0], [float(x) for x in corner], rtol=1e-15)
