"""Sides of elevated triangular nets; tests/surface/convert tests all points."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.bases import polynomials
from service.bases.polynomials import Net
from service.bases.triangle_polynomials import elevate, row_number

seeds = st.integers(0, 10**6)
small = st.integers(1, 5)


def build_net(degree: int, seed: int) -> Net:
    rng = np.random.default_rng(seed)
    count = (degree + 1) * (degree + 2) // 2
    return rng.uniform(-4, 4, (count, 3)), rng.uniform(0.2, 5, count)


@given(small, st.integers(1, 4), seeds)
def test_sides_are_elevated_like_curves(degree: int, more: int, seed: int) -> None:
    """Sides are equal bit for bit, in either direction, so patches that share an edge still share
    it."""
    points, weights = build_net(degree, seed)
    assert weights is not None
    n = degree + more
    higher = elevate((points, weights), n)
    for chosen, raised in zip(_list_sides(degree), _list_sides(n), strict=True):
        for step in (1, -1):
            old, new = chosen[::step], raised[::step]
            side = polynomials.elevate((points[old], weights[old]), n)
            np.testing.assert_array_equal(side[0], higher[0][new])
            np.testing.assert_array_equal(side[1], higher[1][new])  # type: ignore[index]


def _list_sides(degree: int) -> list[np.ndarray]:
    rising, nothing = np.arange(degree + 1), np.zeros(degree + 1, dtype=int)
    return [
        row_number(degree, rising, nothing),
        row_number(degree, nothing, rising),
        row_number(degree, degree - rising, rising),
    ]
