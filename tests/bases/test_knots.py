"""Knot vectors and their spans."""

import numpy as np
import pytest

from service.bases import knots as knot


def test_uniform_clamped_and_periodic_knots() -> None:
    """Knots are integers, every span has length one, and the domain begins at zero."""
    np.testing.assert_array_equal(knot.uniform_knots(5, 3), [-3, -2, -1, 0, 1, 2, 3, 4, 5])
    np.testing.assert_array_equal(knot.clamped_knots(5, 3), [0, 0, 0, 0, 1, 2, 2, 2, 2])
    np.testing.assert_array_equal(knot.periodic_knots(4, 2), [-2, -1, 0, 1, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(knot.wrap_points(np.arange(4.0), 2), [0, 1, 2, 3, 0, 1])
    np.testing.assert_array_equal(knot.wrap_points(np.arange(3.0), 5), [0, 1, 2, 0, 1, 2, 0, 1])


@pytest.mark.parametrize("degree", [1, 2, 3, 7, 64])
def test_knots_of_each_name_have_length_n_plus_p_plus_1(degree: int) -> None:
    """n control points over uniform or clamped knots have n − p spans of length 1.

    The first p of n control points are repeated at the end of a periodic curve, which has n spans.
    """
    for make_knots in (knot.uniform_knots, knot.clamped_knots):
        vector = make_knots(degree + 4, degree)
        assert len(vector) == 2 * degree + 5
        np.testing.assert_array_equal(knot.breaks(vector, degree), np.arange(5))
    vector = knot.periodic_knots(7, degree)
    assert len(vector) == 7 + 2 * degree + 1
    np.testing.assert_array_equal(knot.breaks(vector, degree), np.arange(8))


def test_spans_are_right_continuous() -> None:
    """A repeated knot belongs to the span that begins there; the end belongs to the last span."""
    vector = np.array([0, 0, 0, 1, 1, 2, 4, 4, 4.0])
    np.testing.assert_array_equal(knot.spans(vector, 2), [2, 4, 5])
    np.testing.assert_array_equal(knot.breaks(vector, 2), [0, 1, 2, 4])
