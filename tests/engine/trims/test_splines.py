"""Many curves at once, against rational arithmetic and each other."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.trims.splines import Splines
from tests.engine.trims.tables import build_curves, find_curve_point, seeds


def draw_parameters(
    splines: Splines, rng: np.random.Generator, count: int
) -> tuple[Ints, FloatArray]:
    """Curves and parameters, some of them at ends."""
    curve = rng.integers(0, len(splines), count)
    share = rng.choice([0.0, 0.25, 0.7, 1.0], count)
    return curve, splines.start[curve] + share * (splines.end - splines.start)[curve]


@given(seeds, st.sampled_from([2, 3]))
def test_points_are_those_of_the_splines(seed: int, dimension: int) -> None:
    rng = np.random.default_rng(seed)
    table = build_curves(rng, 4, dimension)
    splines = Splines.of(table)
    curve, t = draw_parameters(splines, rng, 6)
    points = splines.evaluate(curve, t)
    for k in range(len(curve)):
        exact = [float(x) for x in find_curve_point(table, curve[k], t[k])]
        np.testing.assert_allclose(points[k], exact, rtol=0, atol=1e-12)


@given(seeds)
def test_derivatives_are_limits_of_quotients(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = build_curves(rng, 3, 3)
    splines = Splines.of(table)
    curve, t = draw_parameters(splines, rng, 4)
    t = np.where(t == splines.end[curve], splines.start[curve], t)
    derivatives = splines.evaluate_derivatives(curve, t, 2)
    step = Fraction(1, 2**40)
    for k in range(len(curve)):
        p0, p1, p2 = (
            np.array(find_curve_point(table, curve[k], Fraction(t[k]) + i * step)) for i in range(3)
        )
        exact = np.array([p0, (p1 - p0) / step, (p2 - 2 * p1 + p0) / step**2], float)
        errors = np.abs(derivatives[:, k] - exact).max(axis=1)
        assert (errors <= 1e-7 * np.abs(exact).max(axis=1) + 1e-9).all()


@given(seeds)
def test_intervals_are_cut_at_breaks_and_their_nets_are_the_curve(seed: int) -> None:
    rng = np.random.default_rng(seed)
    splines = Splines.of(build_curves(rng, 4, 2))
    curve = rng.integers(0, 4, 5)
    shares = np.sort(rng.random((2, 5)), axis=0)
    low, high = splines.start[curve] + shares * (splines.end - splines.start)[curve]
    pieces = splines.cut(curve, low, high)
    joined = np.diff(pieces.source) == 0
    np.testing.assert_array_equal(pieces.low[1:][joined], pieces.high[:-1][joined])
    first = np.flatnonzero(np.diff(pieces.source, prepend=-1))
    np.testing.assert_array_equal(pieces.low[first], low)
    np.testing.assert_array_equal(pieces.high[np.append(first[1:], len(pieces.low)) - 1], high)
    seen = 0
    for rows, nets in splines.restrict(pieces):
        seen += len(rows)
        for s in (0.0, 0.3, 1.0):
            x = np.einsum("j,mjd->md", bernstein(nets.shape[1] - 1, [s])[0], nets)
            x = x[:, :2] / x[:, 2:] if nets.shape[2] == 3 else x
            t = pieces.low[rows] + s * (pieces.high - pieces.low)[rows]
            np.testing.assert_allclose(x, splines.evaluate(pieces.curve[rows], t), atol=1e-9)
    assert seen == len(pieces.low)


@given(seeds)
def test_chosen_joined_moved_and_mapped_curves_keep_their_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, two = (Splines.of(build_curves(rng, n, 2)) for n in (3, 4))
    joined = Splines.join([one, two])
    chosen = joined.take(np.array([5, 0, 5, 3]))
    curve, t = draw_parameters(chosen, rng, 6)
    original = np.array([5, 0, 5, 3])[curve]
    expected = np.where(
        (original < 3)[:, None],
        one.evaluate(np.minimum(original, 2), t),
        two.evaluate(np.maximum(original - 3, 0), t),
    )
    np.testing.assert_allclose(chosen.evaluate(curve, t), expected, rtol=0, atol=1e-12)
    start, end = rng.random(4), 2 + rng.random(4)
    moved = chosen.move_ranges(start, end)
    share = (t - chosen.start[curve]) / (chosen.end - chosen.start)[curve]
    at = np.minimum(start[curve] + share * (end - start)[curve], end[curve])
    np.testing.assert_allclose(moved.evaluate(curve, at), expected, atol=1e-9)
    np.testing.assert_array_equal(moved.start, start)
    np.testing.assert_array_equal(moved.end, end)
    origin, scale = rng.random((4, 2)), 1 + rng.random((4, 2))
    mapped = chosen.map_points(origin, scale)
    np.testing.assert_allclose(
        mapped.evaluate(curve, t), (expected - origin[curve]) * scale[curve], atol=1e-9
    )


def test_spans_of_many_curves_are_found_exactly() -> None:
    """Keys of many curves have few digits, but parameters next to breaks have all of theirs."""
    rng = np.random.default_rng(1)
    splines = Splines.of(build_curves(rng, 3, 2))
    splines = splines.take(np.tile(np.arange(3), 30_000))
    curve = 90_000 - 1 - np.arange(30)
    for k in range(3):
        at = splines.first_break[curve] + np.minimum(k, splines.span_count[curve] - 1)
        t = np.nextafter(splines.breaks[at + 1], -np.inf)
        np.testing.assert_array_equal(splines.find_spans(curve, t), at - splines.first_break[curve])
        after = splines.find_spans(curve, splines.breaks[at])
        np.testing.assert_array_equal(after, at - splines.first_break[curve])


@pytest.mark.parametrize("side", [False, True])
def test_a_break_belongs_to_the_span_after_it_or_before_it(side: bool) -> None:
    splines = Splines.of(build_curves(np.random.default_rng(3), 9, 3))
    curve = np.flatnonzero(splines.span_count > 1)
    t = splines.breaks[splines.first_break[curve] + 1]
    np.testing.assert_array_equal(splines.find_spans(curve, t, before=side), int(not side))
