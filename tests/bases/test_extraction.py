"""Bézier points of the spans of a B-spline: they are accurate, the reversed curve has the same
bits, and neighbouring spans share a point.

`*vector` passes the two fields of a `KnotVector`, the knots and the degree.
"""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.exact import curve_point
from oracles.splines import spline_point, to_fractions
from service.bases import extraction, knots
from service.bases.blossoms import build_operators
from service.bases.cache import MESH_PLANS
from service.bases.extraction import extract_bezier_points, plan_extraction
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

seeds = st.integers(0, 10**6)


def to_exact_points(rows: np.ndarray) -> list[tuple[Fraction, ...]]:
    """Points as fractions."""
    return [tuple(to_fractions(row)) for row in rows]


@given(knot_vectors(discontinuous=True), seeds)
def test_bezier_points_of_every_span_give_the_same_polynomial(
    vector: KnotVector, seed: int
) -> None:
    """de Casteljau on the Bézier points agrees with Cox and de Boor on the control points."""
    points = random_points(vector.point_count, seed)
    lowered, lowered_weights = extract_bezier_points(points, *vector)
    assert lowered_weights is None
    exact_knots, breaks = to_fractions(vector.knots), to_fractions(knots.breaks(*vector))
    for k, (a, b) in enumerate(pairwise(breaks)):
        for t in (Fraction(0), Fraction(1, 3), Fraction(5, 8)):
            expected = spline_point(
                to_exact_points(points), exact_knots, vector.degree, a + (b - a) * t
            )
            actual = curve_point(to_exact_points(lowered[k]), t)
            np.testing.assert_allclose(
                [float(x) for x in actual], [float(x) for x in expected], atol=1e-13
            )


@given(knot_vectors(st.integers(1, 8), discontinuous=True), seeds, st.booleans())
def test_reversed_curves_have_bezier_points_with_the_same_bits(
    vector: KnotVector, seed: int, is_rational: bool
) -> None:
    """The reversed curve has the knots c − U, here c = 3, and its points run backwards.

    Its spans, Bézier points and operators (spans, p+1, p+1) are in reverse order along each axis.
    """
    points = random_points(vector.point_count, seed)
    weights = random_weights(vector.point_count, seed) if is_rational else None
    reversed_knots = 3 - vector.knots[::-1]
    lowered, lowered_weights = extract_bezier_points(points, *vector, weights)
    reversed_points, reversed_weights = extract_bezier_points(
        points[::-1], reversed_knots, vector.degree, None if weights is None else weights[::-1]
    )
    np.testing.assert_array_equal(reversed_points[::-1, ::-1], lowered)
    if lowered_weights is not None and reversed_weights is not None:
        np.testing.assert_array_equal(reversed_weights[::-1, ::-1], lowered_weights)
    np.testing.assert_array_equal(
        build_operators(reversed_knots, vector.degree)[::-1, ::-1, ::-1], build_operators(*vector)
    )


@given(knot_vectors(discontinuous=True), seeds, st.booleans())
def test_spans_share_a_point_unless_the_knot_has_multiplicity_p_plus_1(
    vector: KnotVector, seed: int, is_rational: bool
) -> None:
    """At a knot of multiplicity p the curve is a control point.

    At a knot of multiplicity p + 1 a span ends at a control point, and the next begins at another.
    """
    p = vector.degree
    points = random_points(vector.point_count, seed)
    weights = random_weights(vector.point_count, seed) if is_rational else None
    lowered, _ = extract_bezier_points(points, *vector, weights)
    spans = knots.spans(*vector)
    # The number of a span is that of the last knot at its beginning. So the numbers of two
    # neighbours differ by the multiplicity of the knot between them.
    for k, multiplicity in enumerate(np.diff(spans)):
        if multiplicity <= p:
            np.testing.assert_array_equal(lowered[k, -1], lowered[k + 1, 0])
        if multiplicity >= p:
            np.testing.assert_array_equal(lowered[k, -1], points[spans[k]])
            np.testing.assert_array_equal(lowered[k + 1, 0], points[spans[k + 1] - p])


@pytest.mark.parametrize("is_rational", [False, True])
def test_equal_control_points_give_equal_bezier_points(is_rational: bool) -> None:
    """The points are equal bit for bit, with any weights, so that poles stay poles."""
    vector = np.array([0, 0.1, 0.1, 0.27, 0.5, 0.61, 0.9, 1, 1.3, 1.7])
    points = np.broadcast_to([0.1, -1e6 / 3, 7e30 / 11], (6, 3)).copy()
    weights = random_weights(6, 3) if is_rational else None
    lowered, _ = extract_bezier_points(points, vector, 3, weights)
    np.testing.assert_array_equal(lowered, np.broadcast_to(points[0], lowered.shape))


@pytest.mark.parametrize("is_rational", [False, True])
def test_a_curve_that_repeats_its_first_points_at_the_end_closes(is_rational: bool) -> None:
    """The curve closes bit for bit, also over knots k/7, whose differences differ by rounding."""
    points = knots.wrap_points(random_points(7, 1), 3)
    weights = knots.wrap_points(random_weights(7, 1), 3) if is_rational else None
    vector = knots.periodic_knots(7, 3) / 7
    assert len(set(np.diff(vector))) > 1
    lowered, lowered_weights = extract_bezier_points(points, vector, 3, weights)
    np.testing.assert_array_equal(lowered[0, 0], lowered[-1, -1])
    if lowered_weights is not None:
        assert lowered_weights[0, 0] == lowered_weights[-1, -1]


def test_repeated_points_over_knots_that_are_not_periodic_do_not_close() -> None:
    points = knots.wrap_points(random_points(7, 1), 3)
    vector = knots.periodic_knots(7, 3)
    # These knots are after the domain, which ends at vector[-4].
    vector[-1] += 1e-6
    vector[-3] += 1e-6
    lowered, _ = extract_bezier_points(points, vector, 3)
    assert (lowered[0, 0] != lowered[-1, -1]).all()


@pytest.mark.parametrize("degree", [3, 40])
def test_extraction_in_small_chunks_gives_the_same_points(
    degree: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The points are equal bit for bit, whether one chunk or many chunks of spans are computed."""
    rng = np.random.default_rng(3)
    vector = np.sort(rng.uniform(0, 1, 60 + 2 * degree))
    vector[degree + 5 : degree + 8] = vector[degree + 5]
    count = len(vector) - degree - 1
    # 3 curves at once, made with the seed 2.
    points, weights = random_points(count, 2, 3), random_weights(count, 2, 3)
    in_one_chunk, lowered_weights = extract_bezier_points(points, vector, degree, weights)
    monkeypatch.setattr(extraction, "CHUNK_BYTES", 1000)
    MESH_PLANS.clear()  # the plan too is computed in chunks
    in_chunks, chunk_weights = extract_bezier_points(points, vector, degree, weights)
    np.testing.assert_array_equal(in_chunks, in_one_chunk)
    np.testing.assert_array_equal(chunk_weights, lowered_weights)


def test_extractions_are_cached_by_knots_and_closure() -> None:
    """Curves with equal knots share a plan; a closed curve over these knots needs another plan."""
    vector, points = knots.periodic_knots(7, 3), random_points(7, 1)
    plan = plan_extraction(vector, 3, random_points(10, 2))
    assert plan_extraction(vector.copy(), 3, random_points(10, 3)) is plan
    assert plan_extraction(vector, 3, knots.wrap_points(points, 3)) is not plan
