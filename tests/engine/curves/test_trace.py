"""Points, tangents, lengths and chords of curves, compared with exact arithmetic and formulas."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from oracles.curves import bezier_length, bezier_point, bezier_tangent, bspline_point
from service.bases.arrays import FloatArray
from service.engine.curves.arc_length import arc_lengths
from service.engine.curves.evaluation import CurveSamples, evaluate_positions, evaluate_tangents
from service.engine.curves.polyline import CurveOptions, SampledCurve
from service.engine.curves.trace import choose_samples, trace_curve
from service.errors import InvalidRequest, TooLarge
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.curve_model import CurvePieces

ROOT = math.sqrt(0.5)
QUARTER = BezierCurve(np.array([[1.0, 0], [1, 1], [0, 1]]), np.array([1, ROOT, 1]))
CUSP = BezierCurve(np.array([[0.0, 0], [1, 1], [0, 1], [1, 0]]))


@st.composite
def bezier_curves(draw: st.DrawFn) -> BezierCurve:
    """Curves of degrees 1 to 9, in the plane or in space; coordinates are in [−8, 8].

    Curves have no weights, or weights in [0.2, 5].
    """
    shape = (draw(st.integers(2, 10)), draw(st.integers(2, 3)))
    numbers = st.integers(-128, 128).map(lambda k: k / 16)
    points = draw(arrays.arrays(np.float64, shape, elements=numbers))
    if (points == points[0]).all():
        points[0] += 1
    weight_values = st.integers(13, 320).map(lambda k: k / 64)
    weights = draw(st.none() | arrays.arrays(np.float64, shape[0], elements=weight_values))
    return BezierCurve(points, weights)


@st.composite
def bspline_curves(draw: st.DrawFn) -> BsplineCurve:
    """Curves of degrees 1 to 5; coordinates are in [−4, 4], and weights in [0.2, 5].

    The knots have a name, or are numbers with repetitions.
    """
    degree = draw(st.integers(1, 5))
    count = draw(st.integers(max(degree + 1, 3), degree + 7))
    points = draw(
        arrays.arrays(
            np.float64,
            (count, draw(st.integers(2, 3))),
            elements=st.integers(-64, 64).map(lambda k: k / 16),
            unique=True,
        )
    )
    knots: str | FloatArray = draw(st.sampled_from(["uniform", "clamped", "periodic", "numbers"]))
    if knots == "numbers":
        length = count + degree + 1
        steps = draw(st.lists(st.integers(0, 3), min_size=length, max_size=length))
        knots = _separate_knots(np.cumsum(steps) / 4, degree)
        if knots[degree] == knots[count]:
            knots[count:] += 0.5  # the domain must have a length
    weight_values = st.integers(13, 320).map(lambda k: k / 64)
    weights = draw(st.none() | arrays.arrays(np.float64, count, elements=weight_values))
    return BsplineCurve(points, degree, knots, weights)  # type: ignore[arg-type]


def _separate_knots(knots: FloatArray, degree: int) -> FloatArray:
    """The knots, moved apart where one would occur more than `degree` times."""
    result = knots.copy()
    for i in range(degree, len(result)):
        if result[i] <= result[i - degree]:
            result[i:] += 0.5
    return result


def trace_samples(curve: Curve, options: CurveOptions, *, is_float32: bool = False) -> SampledCurve:
    """The polyline of a curve with these options."""
    pieces = curve.lower()
    samples = choose_samples(pieces, options, 1_000_000, is_float32=is_float32)
    return trace_curve(pieces, samples, options, is_float32=is_float32)


def bound_deviation(line: SampledCurve) -> float:
    """The bound of a polyline."""
    assert line.report.deviation_bound is not None
    return line.report.deviation_bound


def measure_length(pieces: CurvePieces, divisions: int) -> float:
    """The computed length of a curve with this number of divisions of each piece."""
    return float(arc_lengths(pieces, CurveSamples.uniform(pieces.count, divisions))[-1])


def measure_distances(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distance of each point (M, d) to a polyline (N, d)."""
    begin, segment = line[:-1], np.diff(line, axis=0)
    squared_lengths = np.maximum((segment**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begin) * segment).sum(axis=2) / squared_lengths, 0, 1)
    difference = points[:, None] - (begin + share[..., None] * segment)
    nearest: FloatArray = np.sqrt((difference**2).sum(axis=2)).min(axis=1)
    return nearest


@given(bezier_curves(), st.integers(1, 9))
def test_points_and_tangents_of_bezier_curves_agree_with_exact_arithmetic(
    curve: BezierCurve, divisions: int
) -> None:
    pieces = curve.lower()
    samples = CurveSamples.uniform(1, divisions)
    actual, directions = evaluate_positions(pieces, samples), evaluate_tangents(pieces, samples)
    size = np.abs(curve.control_points).max()
    for k in range(divisions + 1):
        t = Fraction(k, divisions)
        exact_point = bezier_point(
            curve.control_points, curve.weights, Fraction(float(samples.t[k]))
        )
        assert actual[k] == pytest.approx([float(x) for x in exact_point], abs=1e-13 * size)
        expected = bezier_tangent(curve.control_points, curve.weights, t)
        # If the denominator is a power of two, t is exact in floating point. A rounded parameter
        # misses a cusp at t, and beside a cusp the tangent has another direction.
        if t.denominator & (t.denominator - 1) == 0:
            assert directions[k] == pytest.approx(expected, abs=1e-9)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1, abs=1e-15)


@given(bspline_curves(), st.integers(1, 4))
def test_points_of_bspline_curves_agree_with_exact_arithmetic(
    curve: BsplineCurve, divisions: int
) -> None:
    pieces = curve.lower()
    samples = CurveSamples.uniform(pieces.count, divisions)
    actual = evaluate_positions(pieces, samples)
    points, weights, knots = curve.control_points, curve.weights, curve.knot_vector
    if curve.periodic:
        # The first points and weights are repeated at the end.
        points = np.resize(points, (len(points) + curve.degree, points.shape[1]))
        weights = None if weights is None else np.resize(weights, len(points))
    for u, point in zip(samples.parameters(pieces.breaks).tolist(), actual, strict=True):
        exact_point = bspline_point(points, weights, knots.tolist(), curve.degree, Fraction(u))
        assert point == pytest.approx([float(x) for x in exact_point], abs=4e-12)
    assert pieces.closed or not curve.periodic


def test_the_tangent_at_a_cusp_is_the_limit_from_the_chosen_side() -> None:
    pieces = CUSP.lower()
    samples = CurveSamples.uniform(1, 2)
    assert evaluate_tangents(pieces, samples)[1] == pytest.approx([0, -1])
    assert evaluate_tangents(pieces, samples, before=True)[1] == pytest.approx([0, 1])


def test_a_piece_that_is_one_point_has_the_direction_of_the_next_piece() -> None:
    points = np.array([[0.0, 0], [1, 0], [1, 0], [1, 0], [1, 1]])
    pieces = BsplineCurve(points, 1).lower()
    samples = CurveSamples.uniform(4, 1)
    assert evaluate_tangents(pieces, samples).tolist() == [[1, 0], [0, 1], [0, 1], [0, 1], [0, 1]]
    assert evaluate_tangents(pieces, samples, before=True)[2].tolist() == [0, 1]
    assert arc_lengths(pieces, samples).tolist() == [0, 1, 1, 1, 2]


@pytest.mark.parametrize("divisions", [1, 2, 3, 16, 1000])
def test_the_length_of_an_arc_is_right(divisions: int) -> None:
    assert measure_length(QUARTER.lower(), divisions) == pytest.approx(math.pi / 2, rel=1e-12)


@pytest.mark.parametrize("divisions", [1, 2, 3, 16])
def test_the_length_of_a_curve_with_a_cusp_is_right(divisions: int) -> None:
    """|C′| is not smooth in the middle, where it vanishes; the total length is 2 √2 − 1."""
    expected = bezier_length(CUSP.control_points, None, breaks=[0.5])
    assert expected == pytest.approx(2 * math.sqrt(2) - 1, rel=1e-14)
    assert measure_length(CUSP.lower(), divisions) == pytest.approx(expected, rel=1e-11)


@settings(max_examples=2)
@given(bezier_curves(), st.integers(1, 4))
def test_lengths_agree_with_mpmath(curve: BezierCurve, divisions: int) -> None:
    # The oracle integrates over eight intervals.
    expected = bezier_length(
        curve.control_points, curve.weights, breaks=np.linspace(0, 1, 9)[1:-1].tolist()
    )
    assert measure_length(curve.lower(), divisions) == pytest.approx(expected, rel=1e-7)


def test_lengths_grow_along_the_curve_and_do_not_depend_on_the_unit() -> None:
    for unit in (1e-150, 1.0, 1e30):
        pieces = BezierCurve(CUSP.control_points * unit).lower()
        lengths = arc_lengths(pieces, CurveSamples.uniform(1, 9)) / unit
        assert lengths[0] == 0
        assert (np.diff(lengths) > 0).all()
        assert lengths[-1] == pytest.approx(2 * math.sqrt(2) - 1, rel=1e-11)


@given(bezier_curves(), st.sampled_from([1e-1, 1e-2, 1e-3]), st.booleans())
def test_the_curve_is_within_the_bound_of_the_polyline(
    curve: BezierCurve, tolerance: float, is_float32: bool
) -> None:
    """Compares the curve at many parameters with the stored polyline."""
    pieces = curve.lower()
    for options in (CurveOptions(tolerance=tolerance), CurveOptions(resolution=5)):
        line = trace_samples(curve, options, is_float32=is_float32)
        bound = bound_deviation(line)
        if options.tolerance is not None:
            assert bound <= tolerance
        stored = line.points.astype(np.float64) + line.origin
        curve_points = evaluate_positions(pieces, CurveSamples.uniform(1, 400))
        assert measure_distances(curve_points, stored).max() <= bound


def test_the_bound_is_near_the_true_deviation() -> None:
    """The bound exceeds the deviation of an arc by at most 1%."""
    line = trace_samples(QUARTER, CurveOptions(resolution=16))
    curve_points = evaluate_positions(QUARTER.lower(), CurveSamples.uniform(1, 4096))
    true_deviation = measure_distances(curve_points, line.points.astype(np.float64)).max()
    assert true_deviation <= bound_deviation(line) <= 1.01 * true_deviation


@pytest.mark.parametrize("shares", [[0.0, 0.9, 0.95, 1.0], [0.0, 0.7, 0.1, 1.0]])
def test_the_deviation_of_a_straight_line_is_zero(shares: list[float]) -> None:
    """The second control polygon turns back, but its curve does not."""
    curve = BezierCurve(np.outer(shares, [3.0, 4.0]))
    assert bound_deviation(trace_samples(curve, CurveOptions(resolution=3))) < 1e-13
    assert trace_samples(curve, CurveOptions(tolerance=1e-9)).report.points == 2


def test_a_tolerance_below_the_rounding_is_refused() -> None:
    for is_float32, tolerance in ((False, 1e-16), (True, 1e-9)):
        with pytest.raises(InvalidRequest) as caught:
            trace_samples(QUARTER, CurveOptions(tolerance=tolerance), is_float32=is_float32)
        assert caught.value.issues[0].code == "tolerance_too_small"


def test_a_tolerance_that_needs_too_many_points_is_refused() -> None:
    with pytest.raises(TooLarge):
        choose_samples(QUARTER.lower(), CurveOptions(tolerance=1e-8), 100)


def test_every_accepted_tolerance_is_reached() -> None:
    """Requests 1.1 times the least tolerance that the error names; weights differ by 1e8.

    No curve may have a larger ratio of weights.
    """
    points = np.array([[0.0, 0, 0], [1, 3, 0], [2, -3, 1], [3, 0, 0]])
    curve = BezierCurve(points, np.array([1, 1e8, 1, 1e8]))
    with pytest.raises(InvalidRequest) as caught:
        trace_samples(curve, CurveOptions(tolerance=1e-300))
    # The third word of the error is the least tolerance.
    min_tolerance = float(caught.value.issues[0].needed.split()[2])
    line = trace_samples(curve, CurveOptions(tolerance=1.1 * min_tolerance))
    assert bound_deviation(line) <= 1.1 * min_tolerance


def test_the_last_point_of_a_closed_curve_repeats_the_first() -> None:
    rng = np.random.default_rng(5)
    curve = BsplineCurve(rng.normal(size=(7, 3)) / 3, 3, "periodic")
    line = trace_samples(curve, CurveOptions(resolution=4))
    assert line.report.closed
    assert np.array_equal(line.points[0], line.points[-1])
    assert line.tangents is not None
    assert line.tangents[0] == pytest.approx(line.tangents[-1], abs=1e-12)
    # The seven pieces have four divisions each, and the first point is repeated.
    assert (line.report.points, line.report.pieces) == (7 * 4 + 1, 7)


def test_a_curve_far_from_zero_is_stored_about_a_local_origin() -> None:
    curve = BezierCurve(CUSP.control_points + 1e6)
    line = trace_samples(curve, CurveOptions(resolution=8), is_float32=True)
    assert line.origin.any()
    assert bound_deviation(line) < 0.05
    assert np.abs(line.points).max() <= 1
