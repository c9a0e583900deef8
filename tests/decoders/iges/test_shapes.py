"""Ends, sizes and samples of curves."""

import numpy as np

from service.decoders.cad.splines import build_curve
from service.decoders.iges.shapes import find_all_ends, is_line, measure_size, sample_all

LINE = build_curve(1, [0.0, 0, 1, 1], [[1.0, 2.0, 3.0], [4.0, 6.0, 3.0]])
ARC = build_curve(
    2, [0.0, 0, 0, 1, 1, 1], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], [1, 0.5**0.5, 1]
)
UNEVEN = build_curve(1, [0.0, 0, 1, 1], [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]], [1.0, 0.5])


def test_lines_have_even_parameters() -> None:
    assert [is_line(curve) for curve in (LINE, ARC, UNEVEN)] == [True, False, False]


def test_ends_and_sizes() -> None:
    ends = find_all_ends([LINE, ARC, UNEVEN])
    np.testing.assert_allclose(ends[0], [[1, 2, 3], [4, 6, 3]])
    np.testing.assert_allclose(ends[1], [[1, 0, 0], [0, 1, 0]])
    np.testing.assert_allclose(ends[2], [[0, 0, 0], [3, 0, 0]])
    assert [measure_size(curve) for curve in (LINE, ARC, UNEVEN)] == [4, 1, 3]


def test_samples_are_at_equal_steps_of_the_parameter() -> None:
    points = sample_all([LINE, ARC, UNEVEN], 3)
    half = 0.5**0.5
    np.testing.assert_allclose(points[0, 1], [2.5, 4, 3])
    np.testing.assert_allclose(points[1, 1], [half, half, 0])
    # The weight of the second end is half that of the first: (0 + 3/2) / (1 + 1/2).
    np.testing.assert_allclose(points[2, 1], [1, 0, 0])
