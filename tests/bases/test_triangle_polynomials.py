"""Triangular nets raised, cut in three, turned about, and made of tensor nets: exact points."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.bases import polynomials
from service.bases.polynomials import Net
from service.bases.triangle_polynomials import (
    elevate,
    exchanged,
    lower_half,
    place,
    split,
)
from tests.oracles.exact import exact_net, surface_point
from tests.oracles.triangles import exact_triangle, value

Barycentric = tuple[Fraction, Fraction, Fraction]
HALF = Fraction(1, 2)
POINTS: tuple[Barycentric, ...] = (
    (Fraction(1), Fraction(0), Fraction(0)),
    (Fraction(0), Fraction(1, 3), Fraction(2, 3)),
    (HALF, Fraction(0), HALF),
    (Fraction(1, 5), Fraction(3, 10), HALF),
)
seeds = st.integers(0, 10**6)
small = st.integers(1, 5)


def net_for(degree: int, seed: int) -> Net:
    rng = np.random.default_rng(seed)
    count = (degree + 1) * (degree + 2) // 2
    return rng.uniform(-4, 4, (count, 3)), rng.uniform(0.2, 5, count)


def point_of(net: Net, at: Barycentric) -> list[float]:
    """The triangle at (r, s, t), exactly."""
    *x, w = value(exact_triangle(*net), at)
    return [float(c / w) for c in x]


@settings(max_examples=30)
@given(small, st.integers(0, 4), seeds)
def test_raised_it_has_the_same_points(degree: int, more: int, seed: int) -> None:
    net = net_for(degree, seed)
    higher = elevate(net, degree + more)
    for at in POINTS:
        np.testing.assert_allclose(point_of(higher, at), point_of(net, at), atol=4e-12)


@settings(max_examples=20)
@given(small, st.integers(1, 4), seeds)
def test_its_sides_are_raised_as_those_of_other_patches(degree: int, more: int, seed: int) -> None:
    """Bit for bit, in either direction: what shares an edge shares it afterwards."""
    points, weights = net_for(degree, seed)
    assert weights is not None
    n = degree + more
    higher = elevate((points, weights), n)
    for chosen, raised in zip(_sides(degree), _sides(n), strict=True):
        for step in (1, -1):
            old, new = chosen[::step], raised[::step]
            side = polynomials.elevate((points[old], weights[old]), n)
            np.testing.assert_array_equal(side[0], higher[0][new])
            np.testing.assert_array_equal(side[1], higher[1][new])  # type: ignore[index]


def _sides(degree: int) -> list[np.ndarray]:
    rising, nothing = np.arange(degree + 1), np.zeros(degree + 1, dtype=int)
    return [
        place(degree, rising, nothing),
        place(degree, nothing, rising),
        place(degree, degree - rising, rising),
    ]


@settings(max_examples=20)
@given(small, seeds, st.integers(1, 8), st.integers(1, 8), st.integers(1, 8))
def test_cut_in_three(degree: int, seed: int, a: int, b: int, c: int) -> None:
    """Each piece is the triangle with the point in the place of one corner."""
    net = net_for(degree, seed)
    at = a / (a + b + c), b / (a + b + c), c / (a + b + c)
    whole = [Fraction(x) for x in at]
    whole = [x / sum(whole) for x in whole]
    pieces = split(net, at)
    for corner, piece in enumerate(pieces):
        for point in POINTS:
            here = [whole[m] * point[corner] for m in range(3)]
            for m in range(3):
                here[m] += point[m] if m != corner else 0
            wanted = point_of(net, (here[0], here[1], here[2]))
            np.testing.assert_allclose(point_of(piece, point), wanted, atol=4e-12)
    # Two of them share the line from the point to the third corner.
    last = place(degree, np.zeros(degree + 1, dtype=int), np.arange(degree + 1))
    other = place(degree, degree - np.arange(degree + 1), np.arange(degree + 1))
    np.testing.assert_array_equal(pieces[0][0][last], pieces[1][0][other])


@pytest.mark.parametrize("two", [(0, 1), (0, 2), (1, 2)])
def test_turned_about(two: tuple[int, int]) -> None:
    points, weights = net_for(4, 7)
    assert weights is not None
    order = exchanged(4, *two)
    for at in POINTS:
        there = list(at)
        there[two[0]], there[two[1]] = there[two[1]], there[two[0]]
        turned = point_of((points[order], weights[order]), (there[0], there[1], there[2]))
        assert turned == point_of((points, weights), at)
    np.testing.assert_array_equal(order[order], np.arange(15))


@settings(max_examples=20)
@given(small, small, seeds)
def test_half_of_a_square(p: int, q: int, seed: int) -> None:
    """u = s, v = t."""
    rng = np.random.default_rng(seed)
    points, weights = rng.uniform(-4, 4, (p + 1, q + 1, 3)), rng.uniform(0.2, 5, (p + 1, q + 1))
    half = lower_half((points, weights))
    assert len(half[0]) == (p + q + 1) * (p + q + 2) // 2
    for at in POINTS:
        *x, w = surface_point(exact_net(points, weights), at[1], at[2])
        np.testing.assert_allclose(point_of(half, at), [float(c / w) for c in x], atol=4e-12)
    np.testing.assert_array_equal(half[0][0], points[0, 0])
    np.testing.assert_array_equal(half[0][p + q], points[-1, 0])
    np.testing.assert_array_equal(half[0][-1], points[0, -1])
