"""Sides of elevated triangular nets; the tests in tests/surface/convert compare inner points."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.bases import polynomials
from service.bases.polynomials import Net
from service.bases.triangle import elevate, find_index

seeds = st.integers(0, 10**6)
small_degrees = st.integers(1, 5)


def build_net(degree: int, seed: int) -> Net:
    """A random rational triangular net: points (count, 3) and weights (count,)."""
    rng = np.random.default_rng(seed)
    count = (degree + 1) * (degree + 2) // 2
    return rng.uniform(-4, 4, (count, 3)), rng.uniform(0.2, 5, count)


@given(small_degrees, st.integers(1, 4), seeds)
def test_sides_are_elevated_like_curves(degree: int, degree_steps: int, seed: int) -> None:
    """The sides of the elevated net have the bits of the sides that are elevated as curves.

    This holds in both directions, so that two patches with a common edge still share it.
    """
    points, weights = build_net(degree, seed)
    assert weights is not None
    new_degree = degree + degree_steps
    elevated_points, elevated_weights = elevate((points, weights), new_degree)
    assert elevated_weights is not None
    for old_side, new_side in zip(_list_sides(degree), _list_sides(new_degree), strict=True):
        for step in (1, -1):
            old, new = old_side[::step], new_side[::step]
            side_points, side_weights = polynomials.elevate((points[old], weights[old]), new_degree)
            np.testing.assert_array_equal(side_points, elevated_points[new])
            np.testing.assert_array_equal(side_weights, elevated_weights[new])


def _list_sides(degree: int) -> list[np.ndarray]:
    """Indices (degree + 1,) of the control points of each side of a triangular net."""
    rising, zeros = np.arange(degree + 1), np.zeros(degree + 1, dtype=int)
    return [
        find_index(degree, rising, zeros),
        find_index(degree, zeros, rising),
        find_index(degree, degree - rising, rising),
    ]
