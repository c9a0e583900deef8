"""Quadratic forms of cells."""

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.adaptive.cutting.estimate import build_forms
from service.engine.adaptive.cutting.planes import find_planes, measure_heights


@pytest.mark.parametrize("bend", [1.0, -1.0])
def test_form_is_height_of_chords_over_a_quadratic_surface(bend: float) -> None:
    def evaluate(u: float, v: float) -> FloatArray:
        return np.array([u, v, bend * (u * u + 0.5 * v * v) + 0.3 * u * v])

    nine_points = np.array([evaluate(u, v) for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)])
    at = nine_points[..., np.newaxis]
    planes, normal, steps, _ = find_planes(at)
    _, signed, _ = measure_heights(at, planes, normal, two_sided=False)
    a, b, c = build_forms(steps, normal, -signed[4:], np.ones(1))[3:6, 0]
    for begin, end in (((0, 0), (1, 1)), ((1, 0), (0, 1)), ((0, 0), (1, 0.5))):
        du, dv = end[0] - begin[0], end[1] - begin[1]
        middle = evaluate(begin[0] + du / 2, begin[1] + dv / 2)
        height = ((evaluate(*begin) + evaluate(*end)) / 2 - middle) @ normal[:, 0]
        assert height == pytest.approx(a * du**2 + 2 * b * du * dv + c * dv**2)
