"""Curves and surfaces against B-splines in exact rational arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from oracles.splines import spline_point
from service.decoders.cad import splines
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.knot_vectors import check_knots, expand_knots, imply_knots
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

Array = NDArray[np.float64]

SEEDS = st.integers(0, 2**32 - 1)


def evaluate_exactly(
    degree: int, knots: Array, points: Array, weights: Array, parameters: Array
) -> Array:
    """Points (k, D) of a rational curve, rounded once."""
    homogeneous = [
        tuple(Fraction(w) * Fraction(x) for x in (*p, 1.0))
        for p, w in zip(points.tolist(), weights.tolist(), strict=True)
    ]
    exact_knots = [Fraction(x) for x in knots.tolist()]
    rows = [
        spline_point(homogeneous, exact_knots, degree, Fraction(t)) for t in parameters.tolist()
    ]
    return np.array([[float(x / row[-1]) for x in row[:-1]] for row in rows])


def spread(vector: KnotVector, count: int = 13) -> Array:
    """Parameters of the whole domain, with its ends."""
    return np.linspace(vector.knots[vector.degree], vector.knots[-vector.degree - 1], count)


def make(vector: KnotVector, seed: int) -> tuple[Curve, Array, Array]:
    """A rational curve over knots, with its control points and weights."""
    points = random_points(vector.point_count, seed)
    weights = random_weights(vector.point_count, seed)
    return splines.build_curve(vector.degree, vector.knots, points, weights), points, weights


@given(vector=knot_vectors(), seed=SEEDS)
def test_curves_are_clamped_and_keep_their_points(vector: KnotVector, seed: int) -> None:
    curve, points, weights = make(vector, seed)
    t = spread(vector)
    expected = evaluate_exactly(vector.degree, vector.knots, points, weights, t)
    assert splines.evaluate(curve, t) == pytest.approx(expected, abs=1e-12)
    assert splines.find_ends(curve) == pytest.approx(expected[[0, -1]], abs=1e-12)
    degree = vector.degree
    assert (curve.knots[: degree + 1] == t[0]).all()
    assert (curve.knots[-degree - 1 :] == t[-1]).all()


@given(vector=knot_vectors(), seed=SEEDS)
def test_reversed_and_elevated_curves_have_the_same_points(vector: KnotVector, seed: int) -> None:
    curve, _, _ = make(vector, seed)
    t = spread(vector)
    expected = splines.evaluate(curve, t)
    backwards = splines.reverse(curve)
    assert splines.evaluate(backwards, t[0] + t[-1] - t) == pytest.approx(expected, abs=1e-11)
    higher = splines.elevate(curve, curve.degree + 2)
    assert higher.degree == curve.degree + 2
    assert splines.evaluate(higher, t) == pytest.approx(expected, abs=1e-11)
    assert splines.elevate(curve, curve.degree) is curve


@given(vector=knot_vectors(), seed=SEEDS, cuts=st.tuples(*[st.integers(0, 64)] * 2))
def test_segments_and_their_joins(vector: KnotVector, seed: int, cuts: tuple[int, int]) -> None:
    curve, _, _ = make(vector, seed)
    low, high = splines.find_domain(curve)
    first, last = sorted(low + (high - low) * k / 64 for k in cuts)
    if first == last:
        with pytest.raises(InvalidGeometry, match="no length"):
            splines.segment(curve, first, last)
        return
    piece = splines.segment(curve, first, last)
    assert splines.find_domain(piece) == (first, last)
    t = np.linspace(first, last, 9)
    assert splines.evaluate(piece, t) == pytest.approx(splines.evaluate(curve, t), abs=1e-11)
    if first == low or last == high:
        return
    pieces = [splines.segment(curve, *ends) for ends in ((low, first), (first, last), (last, high))]
    pieces[1] = splines.elevate(pieces[1], curve.degree + 1)
    joined = splines.join(pieces, 1e-9)
    t = np.linspace(low, high, 33)
    assert splines.evaluate(joined, t) == pytest.approx(splines.evaluate(curve, t), abs=1e-10)
    with pytest.raises(InvalidGeometry, match="do not meet"):
        splines.join([pieces[0], pieces[2]], 1e-9)


@given(
    vector=knot_vectors(st.integers(1, 3), max_spans=25),
    seed=SEEDS,
    cuts=st.tuples(*[st.integers(0, 300)] * 2),
)
def test_segments_of_long_curves(vector: KnotVector, seed: int, cuts: tuple[int, int]) -> None:
    curve, _, _ = make(vector, seed)
    low, high = splines.find_domain(curve)
    first, last = sorted(low + (high - low) * k / 300 for k in cuts)
    assume(first < last)
    piece = splines.segment(curve, first, last)
    assert len(piece.points) == len(piece.knots) - piece.degree - 1
    t = np.linspace(*splines.find_domain(piece), 60)
    assert splines.evaluate(piece, t) == pytest.approx(splines.evaluate(curve, t), abs=1e-10)


@given(vector=knot_vectors(), seed=SEEDS)
def test_knots_are_inserted(vector: KnotVector, seed: int) -> None:
    curve, _, _ = make(vector, seed)
    low, high = splines.find_domain(curve)
    new = low + (high - low) * np.array([0.3, 0.7])
    refined = splines.insert_knots(curve, new.tolist())
    assert np.isin(new, refined.knots).all()
    t = spread(vector)
    assert splines.evaluate(refined, t) == pytest.approx(splines.evaluate(curve, t), abs=1e-11)


@given(vector=knot_vectors(), seed=SEEDS)
def test_derivatives_are_limits_of_differences(vector: KnotVector, seed: int) -> None:
    curve, _, _ = make(vector, seed)
    breaks = np.unique(curve.knots)
    t = (breaks[:-1] + breaks[1:]) / 2
    step = 1e-4 * np.diff(breaks)
    point, first, second = splines.evaluate_derivatives(curve, t)
    before, after = splines.evaluate(curve, t - step), splines.evaluate(curve, t + step)
    assert point == pytest.approx(splines.evaluate(curve, t), abs=1e-12)
    size = step[:, np.newaxis]
    assert first * size == pytest.approx((after - before) / 2, abs=1e-7)
    assert second * size**2 == pytest.approx(after - 2 * point + before, abs=1e-7)


@given(u=knot_vectors(max_spans=3), v=knot_vectors(max_spans=3), seed=SEEDS)
def test_surfaces_are_clamped_and_cut(u: KnotVector, v: KnotVector, seed: int) -> None:
    points = random_points(u.point_count, seed, v.point_count)
    weights = random_weights(u.point_count, seed, v.point_count)
    surface = splines.build_surface((u.degree, v.degree), (u.knots, v.knots), points, weights)
    s, t = spread(u, 5), spread(v, 5)
    rows = np.repeat(s, 5), np.tile(t, 5)
    # Along v first: each row of the net is a curve.
    homogeneous = np.concatenate([points * weights[..., np.newaxis], weights[..., np.newaxis]], 2)
    ones = np.ones(u.point_count)
    inner = np.stack(
        [evaluate_exactly(v.degree, v.knots, row, np.ones(v.point_count), t) for row in homogeneous]
    )
    nets = [evaluate_exactly(u.degree, u.knots, inner[:, k], ones, s) for k in range(5)]
    expected = np.stack(nets, axis=1)
    expected = (expected[..., :3] / expected[..., 3:]).reshape(-1, 3)
    assert splines.evaluate_surface(surface, *rows) == pytest.approx(expected, abs=1e-10)
    flipped = splines.reverse_surface(splines.swap_axes(surface), 1)
    mirrored = rows[1], s[0] + s[-1] - rows[0]
    assert splines.evaluate_surface(flipped, *mirrored) == pytest.approx(expected, abs=1e-10)
    middle = (t[0] + t[-1]) / 2
    part = splines.segment_surface(surface, 1, t[0], middle)
    columns = np.minimum(rows[1], middle)
    assert part.knots[1][-1] == middle
    assert splines.evaluate_surface(part, rows[0], columns) == pytest.approx(
        splines.evaluate_surface(surface, rows[0], columns), abs=1e-10
    )


def test_affine_maps_move_points_and_keep_weights() -> None:
    matrix = np.array([[0, -2, 0, 1], [1, 0, 0, 2], [0, 0, -3, 3], [0, 0, 0, 1.0]])
    weights = random_weights(4, 5)
    points = random_points(4, 5)
    curve = splines.build_curve(3, [0, 0, 0, 0, 1, 1, 1, 1], points, weights)
    moved = splines.transform(curve, matrix)
    t = np.linspace(0, 1, 7)
    expected = splines.evaluate(curve, t) @ matrix[:3, :3].T + matrix[:3, 3]
    assert splines.evaluate(moved, t) == pytest.approx(expected)
    assert (moved.points[:, 3] == curve.points[:, 3]).all()
    net = random_points(2, 6, 2)
    surface = splines.build_surface((1, 1), ([0, 0, 1, 1],) * 2, net)
    assert isinstance(splines.transform(surface, matrix), Surface)
    flat = splines.drop_z(curve)
    assert splines.evaluate(flat, t) == pytest.approx(splines.evaluate(curve, t)[:, :2])


def test_a_spline_of_two_pieces_that_meet_becomes_continuous() -> None:
    knots = [0, 0, 0, 1, 1, 1, 2, 2, 2]
    points = [[0, 0, 0], [1, 2, 0], [2, 0, 0], [2, 0, 0], [3, 1, 0], [4, 0, 0]]
    curve = splines.build_curve(2, knots, points)
    assert curve.knots.tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    assert splines.evaluate(curve, [0.5, 1.0, 1.5]).tolist() == [[1, 1, 0], [2, 0, 0], [3, 0.5, 0]]
    points[3] = [2, 1, 0]
    with pytest.raises(InvalidGeometry, match="discontinuous"):
        splines.build_curve(2, knots, points)


def test_implied_knots() -> None:
    assert imply_knots("uniform", 2, 4).tolist() == [-2, -1, 0, 1, 2, 3, 4]
    assert imply_knots("quasi_uniform", 2, 4).tolist() == [0, 0, 0, 1, 2, 2, 2]
    assert imply_knots("bezier", 2, 5).tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    with pytest.raises(InvalidGeometry, match="piecewise"):
        imply_knots("bezier", 2, 4)
    with pytest.raises(InvalidGeometry, match="fewer"):
        imply_knots("uniform", 4, 4)


def test_knots_with_multiplicities() -> None:
    assert expand_knots([0, 0.5, 1], [3, 1, 3], 2, 4).tolist() == [0, 0, 0, 0.5, 1, 1, 1]
    for multiplicities in ([3, 3], [3, 1, 2], [3, 0, 4], [7], [3, 10**18, 3], [-1, 5, 3]):
        with pytest.raises(InvalidGeometry, match="multiplicit"):
            expand_knots([0, 0.5, 1], multiplicities, 2, 4)


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
INF, NAN = float("inf"), float("nan")


@pytest.mark.parametrize(
    ("degree", "knots", "points", "weights", "reason"),
    [
        (0, [0, 1, 2, 3], SQUARE, None, "degree"),
        (31, [0] * 35, SQUARE, None, "degree"),
        (3, [0] * 7, SQUARE, None, "fewer"),
        (2, [0, 0, 0, 1, 1], SQUARE, None, "number of knots"),
        (2, [0, 0, 0, 1, 1, NAN], SQUARE, None, "finite"),
        (2, [0, 0, 0, 1, 1, 1e13], SQUARE, None, "too large"),
        (2, [0, 0, 1, 0, 1, 1], SQUARE, None, "decrease"),
        (2, [0, 0, 0, 0, 1, 1], SQUARE, None, "no length"),
        (1, [0, 0, 0, 1, 1], SQUARE, None, "more than"),
        (2, [0, 0, 0, 1e-300, 1e-300, 1e-300], SQUARE, None, "no length|too short"),
        (2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [1, 0, INF], [1, 1, 0]], None, "finite"),
        (2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [1, 0, NAN], [1, 1, 0]], None, "finite"),
        (2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [1, 0, 2e12], [1, 1, 0]], None, "too large"),
        (2, [0, 0, 0, 1, 1, 1], [[2, 2, 2]] * 3, None, "equal"),
        (2, [0, 0, 0, 1, 1, 1], [], None, "missing"),
        (2, [0, 0, 0, 1, 1, 1], SQUARE, [1, 0, 1], "not positive"),
        (2, [0, 0, 0, 1, 1, 1], SQUARE, [1, NAN, 1], "not positive"),
        (2, [0, 0, 0, 1, 1, 1], SQUARE, [1, INF, 1], "not positive"),
        (2, [0, 0, 0, 1, 1, 1], SQUARE, [1, 1e-9, 1], "differ"),
        (2, [0, 0, 0, 1, 1, 1], SQUARE, [1, 1], "one weight"),
        (2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [1, 0], [1, 1, 0]], None, "incomplete"),
        (2, [0, 0, 0, 1, 1, 1], [[0, 0, 0], [1, 0, "x"], [1, 1, 0]], None, "incomplete"),
        (2, [0, 0, 0, 1, 1, 10**400], SQUARE, None, "incomplete"),
        (2, [0, 0, 0, 1, 1, None], SQUARE, None, "finite|incomplete"),
    ],
)
def test_damaged_curves_are_refused(
    degree: int, knots: list[float], points: list[list[float]], weights: list[float], reason: str
) -> None:
    with pytest.raises(InvalidGeometry, match=reason):
        splines.build_curve(degree, knots, points, weights)


def test_damaged_surfaces_are_refused() -> None:
    net = random_points(3, 1, 2)
    knots = [0, 0, 0, 1, 1, 1], [0, 0, 1, 1]
    assert splines.build_surface((2, 1), knots, net).points.shape == (3, 2, 4)
    for degrees, vectors in (((1, 2), knots), ((2, 1), knots[::-1]), ((2, 99), knots)):
        with pytest.raises(InvalidGeometry):
            splines.build_surface(degrees, vectors, net)
    with pytest.raises(InvalidGeometry, match="weights differ"):
        splines.build_surface((2, 1), knots, net, [[1.0, 1.0], [1.0, 1e9], [1.0, 1.0]])


def test_knots_that_differ_by_rounding_are_merged() -> None:
    knots = check_knots(np.array([0, 0, 0, 0.5, 0.5 + 1e-16, 1, 1, 1 + 1e-15]), 2, 5)
    assert knots[3] == knots[4]
    assert knots[5] == knots[7]


def test_too_many_spans_are_refused() -> None:
    count = 1010
    knots = np.arange(count + 2.0)
    net = np.zeros((count, count, 3))
    net[..., 0] = np.arange(count)
    with pytest.raises(InvalidGeometry, match="too many spans"):
        splines.build_surface((1, 1), (knots, knots), net)
    degree = 30
    long = np.arange(10_000.0)
    with pytest.raises(InvalidGeometry, match="too many spans"):
        splines.build_curve(degree, long, random_points(10_000 - degree - 1, 3))
