"""B-splines over refined knots have the same points, compared in exact arithmetic.

Each new control point is a mean of old ones; the service computes their shares, never negative.
"""

from fractions import Fraction
from itertools import pairwise

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from oracles.splines import spline_point, to_fractions
from service.bases.affine_combination import combine
from service.bases.blossoms import find_refinement, raise_knots
from service.bases.knots import breaks, domain
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

seeds = st.integers(0, 10**6)
intervals = st.lists(st.floats(0, 1), min_size=2, max_size=2, unique=True).map(sorted)


def to_homogeneous(points: np.ndarray, weights: np.ndarray) -> list[tuple[Fraction, ...]]:
    """Control points (wx, wy, wz, w) as fractions."""
    return [
        (*(x * w for x in to_fractions(point)), w)
        for point, w in zip(points, to_fractions(weights), strict=True)
    ]


def evaluate_exactly(
    points: np.ndarray, weights: np.ndarray, knots: np.ndarray, degree: int, t: Fraction
) -> list[float]:
    """The point of the rational curve at t, computed in fractions and rounded once."""
    *x, w = spline_point(to_homogeneous(points, weights), to_fractions(knots), degree, t)
    return [float(c / w) for c in x]


@given(knot_vectors(discontinuous=True), seeds, st.integers(0, 3), intervals, st.booleans())
def test_refined_knots_give_the_same_curve(
    vector: KnotVector, seed: int, degree_steps: int, ends: list[float], is_whole_domain: bool
) -> None:
    """The new knots raise the degree, clamp the ends and restrict the domain at once.

    The shares of each new control point are not negative and add up to 1.
    """
    (knots, degree), count = vector, vector.point_count
    low, high = domain(knots, degree)
    begin, end = (low, high) if is_whole_domain else ((1 - s) * low + s * high for s in ends)
    assume(begin < end)
    new_degree = degree + degree_steps
    target = raise_knots(knots, degree, new_degree, begin, end)
    index, shares = find_refinement(knots, degree, target, new_degree)
    assert index.shape[1] == len(target) - new_degree - 1
    assert index.min() >= 0
    assert index.max() < count
    assert shares.min() >= 0
    np.testing.assert_allclose(shares.sum(axis=0), 1, rtol=1e-14)
    points, weights = random_points(count, seed), random_weights(count, seed)
    new_points, new_weights = combine(points, weights, index, shares)
    assert new_weights is not None
    for a, b in pairwise(to_fractions(breaks(target, new_degree))):
        for t in (a, a + (b - a) * Fraction(3, 8)):
            np.testing.assert_allclose(
                evaluate_exactly(new_points, new_weights, target, new_degree, t),
                evaluate_exactly(points, weights, knots, degree, t),
                atol=4e-12,
            )


@given(knot_vectors(discontinuous=True), seeds)
def test_a_clamped_spline_over_its_own_knots_keeps_its_control_points(
    vector: KnotVector, seed: int
) -> None:
    """Points and weights keep their bits, with knots of any multiplicity."""
    knots, degree = vector
    low, high = domain(knots, degree)
    clamped_knots = raise_knots(knots, degree, degree, low, high)
    count = len(clamped_knots) - degree - 1
    points, weights = random_points(count, seed), random_weights(count, seed)
    new_points, new_weights = combine(
        points, weights, *find_refinement(clamped_knots, degree, clamped_knots, degree)
    )
    np.testing.assert_array_equal(new_points, points)
    np.testing.assert_array_equal(new_weights, weights)


@given(knot_vectors(), seeds, st.integers(1, 4))
def test_elevation_keeps_the_bits_of_the_first_and_last_point(
    vector: KnotVector, seed: int, degree_steps: int
) -> None:
    knots, degree = vector
    low, high = domain(knots, degree)
    clamped_knots = raise_knots(knots, degree, degree, low, high)
    points = random_points(len(clamped_knots) - degree - 1, seed)
    target = raise_knots(clamped_knots, degree, degree + degree_steps, low, high)
    new_points, _ = combine(
        points, None, *find_refinement(clamped_knots, degree, target, degree + degree_steps)
    )
    np.testing.assert_array_equal(new_points[[0, -1]], points[[0, -1]])


def test_elevation_to_the_highest_degree_keeps_the_curve() -> None:
    knots = np.array([0.0, 0, 0, 0, 1, 2, 2, 3.5, 4, 4, 4, 4])
    points, weights = random_points(8, 2), random_weights(8, 2)
    target = raise_knots(knots, 3, 64, 0.0, 4.0)
    index, shares = find_refinement(knots, 3, target, 64)
    new_points, new_weights = combine(points, weights, index, shares)
    assert new_weights is not None
    for t in (Fraction(1, 3), Fraction(2), Fraction(15, 4)):
        np.testing.assert_allclose(
            evaluate_exactly(new_points, new_weights, target, 64, t),
            evaluate_exactly(points, weights, knots, 3, t),
            atol=4e-12,
        )
