"""Bézier points of the spans of a B-spline: exact, equal for the reversed curve, shared by
spans."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases import extraction, knots
from service.bases.blossoms import build_operators
from service.bases.cache import MESH_PLANS
from service.bases.extraction import extract_bezier_points, plan_extraction
from tests.oracles.exact import curve_point
from tests.oracles.splines import spline_point, to_fractions
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

seeds = st.integers(0, 10**6)


def to_exact_points(rows: np.ndarray) -> list[tuple[Fraction, ...]]:
    """Points as fractions."""
    return [tuple(to_fractions(row)) for row in rows]


@given(knot_vectors(parted=True), seeds)
def test_every_span_is_the_same_polynomial(vector: KnotVector, seed: int) -> None:
    """de Casteljau on the Bézier points agrees with Cox and de Boor on the control points."""
    points = random_points(vector.points, seed)
    lowered, none = extract_bezier_points(points, *vector)
    assert none is None
    exact, breaks = to_fractions(vector.knots), to_fractions(knots.breaks(*vector))
    for k, (a, b) in enumerate(pairwise(breaks)):
        for t in (Fraction(0), Fraction(1, 3), Fraction(5, 8)):
            expected = spline_point(to_exact_points(points), exact, vector.degree, a + (b - a) * t)
            actual = curve_point(to_exact_points(lowered[k]), t)
            np.testing.assert_allclose(
                [float(x) for x in actual], [float(x) for x in expected], atol=1e-13
            )


@given(knot_vectors(st.integers(1, 8), parted=True), seeds, st.booleans())
def test_reversed_curves_have_the_same_bits(vector: KnotVector, seed: int, rational: bool) -> None:
    """Knots 3 − U and points from the last to the first."""
    points = random_points(vector.points, seed)
    weights = random_weights(vector.points, seed) if rational else None
    turned = 3 - vector.knots[::-1]
    there, weighted = extract_bezier_points(points, *vector, weights)
    back, heavy_back = extract_bezier_points(
        points[::-1], turned, vector.degree, None if weights is None else weights[::-1]
    )
    np.testing.assert_array_equal(back[::-1, ::-1], there)
    if weighted is not None and heavy_back is not None:
        np.testing.assert_array_equal(heavy_back[::-1, ::-1], weighted)
    np.testing.assert_array_equal(
        build_operators(turned, vector.degree)[::-1, ::-1, ::-1], build_operators(*vector)
    )


@given(knot_vectors(parted=True), seeds, st.booleans())
def test_spans_meet_or_are_discontinuous(vector: KnotVector, seed: int, rational: bool) -> None:
    """Up to multiplicity p, spans share one point, bit for bit; at p + 1 there are two points."""
    p = vector.degree
    points = random_points(vector.points, seed)
    weights = random_weights(vector.points, seed) if rational else None
    lowered, _ = extract_bezier_points(points, *vector, weights)
    at = knots.spans(*vector)
    for k, gap in enumerate(np.diff(at)):
        if gap <= p:
            np.testing.assert_array_equal(lowered[k, -1], lowered[k + 1, 0])
        if gap >= p:
            np.testing.assert_array_equal(lowered[k, -1], points[at[k]])
            np.testing.assert_array_equal(lowered[k + 1, 0], points[at[k + 1] - p])


@pytest.mark.parametrize("rational", [False, True])
def test_equal_control_points_stay_that_point(rational: bool) -> None:
    """Equal control points with any weights stay that point, bit for bit; so poles stay poles."""
    vector = np.array([0, 0.1, 0.1, 0.27, 0.5, 0.61, 0.9, 1, 1.3, 1.7])
    points = np.broadcast_to([0.1, -1e6 / 3, 7e30 / 11], (6, 3)).copy()
    weights = random_weights(6, 3) if rational else None
    lowered, _ = extract_bezier_points(points, vector, 3, weights)
    np.testing.assert_array_equal(lowered, np.broadcast_to(points[0], lowered.shape))


@pytest.mark.parametrize("rational", [False, True])
def test_a_curve_given_with_its_first_points_repeated_closes(rational: bool) -> None:
    """It also closes over knots like k/7, whose differences are unequal in floating point."""
    points = knots.wrap_points(random_points(7, 1), 3)
    weights = knots.wrap_points(random_weights(7, 1), 3) if rational else None
    vector = knots.periodic_knots(7, 3) / 7
    assert len(set(np.diff(vector))) > 1
    lowered, weighted = extract_bezier_points(points, vector, 3, weights)
    np.testing.assert_array_equal(lowered[0, 0], lowered[-1, -1])
    if weighted is not None:
        assert weighted[0, 0] == weighted[-1, -1]


def test_other_ends_stay_apart() -> None:
    """Repeated points over knots that are not periodic do not close the curve."""
    points = knots.wrap_points(random_points(7, 1), 3)
    vector = knots.periodic_knots(7, 3)
    vector[-1] += 1e-6
    vector[-3] += 1e-6
    lowered, _ = extract_bezier_points(points, vector, 3)
    assert (lowered[0, 0] != lowered[-1, -1]).all()


@pytest.mark.parametrize("degree", [3, 40])
def test_chunks_give_the_same_points(degree: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The points are equal bit for bit, and little memory is used at a time."""
    rng = np.random.default_rng(3)
    vector = np.sort(rng.uniform(0, 1, 60 + 2 * degree))
    vector[degree + 5 : degree + 8] = vector[degree + 5]
    count = len(vector) - degree - 1
    points, weights = random_points(count, 2, 3), random_weights(count, 2, 3)
    at_once, weighted = extract_bezier_points(points, vector, degree, weights)
    monkeypatch.setattr(extraction, "CHUNK_BYTES", 1000)
    MESH_PLANS.clear()
    in_turn, other = extract_bezier_points(points, vector, degree, weights)
    np.testing.assert_array_equal(in_turn, at_once)
    np.testing.assert_array_equal(other, weighted)


def test_extractions_are_cached_by_knots_and_closure() -> None:
    """Curves with equal knots share an extraction; closed curves have another one."""
    vector, points = knots.periodic_knots(7, 3), random_points(7, 1)
    kept = plan_extraction(vector, 3, random_points(10, 2))
    assert plan_extraction(vector.copy(), 3, random_points(10, 3)) is kept
    assert plan_extraction(vector, 3, knots.wrap_points(points, 3)) is not kept
