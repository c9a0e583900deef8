"""Elevation, split and restriction keep the points of a curve, compared in exact arithmetic.

Operations on the reversed net give the same bits.
"""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from oracles.exact import Vector, curve_point
from service.bases.affine_combination import combine
from service.bases.polynomials import Net, elevate, restrict, split

Array = np.ndarray
PARAMETERS = (Fraction(0), Fraction(1, 3), Fraction(5, 8), Fraction(1))
numbers = st.floats(-8, 8, allow_subnormal=False).map(lambda x: x + 0.0)
"""Coordinates; as in all surfaces, without -0."""
inner_parameters = st.floats(0.01, 0.99)


@st.composite
def curves(draw: st.DrawFn, max_degree: int = 6) -> Net:
    """Control points (n + 1, 3) of a curve, and its weights (n + 1,) or None."""
    count = draw(st.integers(2, max_degree + 1))
    points = draw(arrays.arrays(np.float64, (count, 3), elements=numbers))
    weight = arrays.arrays(np.float64, count, elements=st.floats(0.2, 5))
    return points, draw(st.none() | weight)


def evaluate_exactly(net: Net, t: Fraction) -> Vector:
    """The point of the curve at t, as fractions."""
    points, weights = net
    point_weights = np.ones(len(points)) if weights is None else weights
    homogeneous = [
        (*(Fraction(w) * Fraction(x) for x in point), Fraction(w))
        for point, w in zip(points.tolist(), point_weights.tolist(), strict=True)
    ]
    *spatial, w = curve_point(homogeneous, t)
    return tuple(x / w for x in spatial)


def assert_near(point: Vector, expected: Vector) -> None:
    """Checks that points differ by less than 1e-12 times 8, the largest coordinate of the nets."""
    assert max(abs(a - b) for a, b in zip(point, expected, strict=True)) < 1e-12 * 8


def read_bits(net: Net) -> tuple[bytes, bytes | None]:
    """The bytes of points and weights, to compare nets bit for bit."""
    points, weights = net
    return points.tobytes(), None if weights is None else weights.tobytes()


def reverse_net(net: Net) -> Net:
    """The net with its control points in reverse order."""
    points, weights = net
    return points[::-1].copy(), None if weights is None else weights[::-1].copy()


@given(curves(), st.integers(0, 6))
def test_elevation_keeps_the_curve(net: Net, degree_steps: int) -> None:
    elevated = elevate(net, len(net[0]) - 1 + degree_steps)
    assert len(elevated[0]) == len(net[0]) + degree_steps
    for t in PARAMETERS:
        assert_near(evaluate_exactly(elevated, t), evaluate_exactly(net, t))
    np.testing.assert_array_equal(elevated[0][[0, -1]], net[0][[0, -1]])


@given(curves(), st.integers(1, 6))
def test_elevation_of_the_reversed_net_has_the_same_bits(net: Net, degree_steps: int) -> None:
    degree = len(net[0]) - 1 + degree_steps
    assert read_bits(reverse_net(elevate(reverse_net(net), degree))) == read_bits(
        elevate(net, degree)
    )


def test_elevation_to_the_highest_degree_keeps_the_curve() -> None:
    points = np.random.default_rng(3).uniform(-1, 1, (4, 3))
    weights = np.random.default_rng(4).uniform(0.2, 5, 4)
    elevated = elevate((points, weights), 64)
    for t in PARAMETERS:
        assert_near(evaluate_exactly(elevated, t), evaluate_exactly((points, weights), t))


@given(curves(), inner_parameters)
def test_split_keeps_the_curve_on_both_sides(net: Net, t: float) -> None:
    left, right = split(net, t)
    exact_t = Fraction(t)
    for s in PARAMETERS:
        assert_near(evaluate_exactly(left, s), evaluate_exactly(net, s * exact_t))
        assert_near(evaluate_exactly(right, s), evaluate_exactly(net, exact_t + s * (1 - exact_t)))
    (points, _), (left_points, _), (right_points, _) = net, left, right
    np.testing.assert_array_equal(left_points[0], points[0])
    np.testing.assert_array_equal(right_points[-1], points[-1])
    np.testing.assert_array_equal(left_points[-1], right_points[0])


@given(curves(), st.lists(st.floats(0, 1), min_size=2, max_size=2, unique=True).map(sorted))
def test_restrict_keeps_the_curve(net: Net, ends: list[float]) -> None:
    begin, end = ends
    piece = restrict(net, begin, end)
    for s in PARAMETERS:
        t = Fraction(begin) + s * (Fraction(end) - Fraction(begin))
        assert_near(evaluate_exactly(piece, s), evaluate_exactly(net, t))


@given(st.integers(2, 5), numbers, st.floats(0.2, 5), inner_parameters)
def test_equal_points_stay_equal(count: int, x: float, weight: float, t: float) -> None:
    """Points stay equal bit for bit, with any weights: the service finds poles by equality."""
    points = np.full((count, 3), x)
    weights = np.linspace(1, weight, count)
    for point_weights in (None, weights):
        net = (points, point_weights)
        for result in (elevate(net, count + 9), *split(net, t), restrict(net, t / 2, t)):
            assert (result[0] == x).all()


def test_many_curves_are_elevated_at_once() -> None:
    """Control points are along axis 0, and the 5 × 2 curves along the axes after it."""
    rng = np.random.default_rng(5)
    points, weights = rng.uniform(-1, 1, (4, 5, 2, 3)), rng.uniform(1, 2, (4, 5, 2))
    all_points, all_weights = elevate((points, weights), 6)
    single_points, single_weights = elevate((points[:, 3, 1], weights[:, 3, 1]), 6)
    assert all_weights is not None
    assert single_weights is not None
    np.testing.assert_array_equal(all_points[:, 3, 1], single_points)
    np.testing.assert_array_equal(all_weights[:, 3, 1], single_weights)


def test_points_with_weight_0_in_a_mean_have_no_effect() -> None:
    """The mean of 0.1, 0.1 and 0 times 9.0 is exactly 0.1."""
    points = np.array([[0.1], [0.1], [9.0]])
    index = np.array([[0], [2], [1]])
    mean, _ = combine(points, None, index, np.array([[1 / 3], [0.0], [2 / 3]]))
    assert mean[0, 0] == 0.1
