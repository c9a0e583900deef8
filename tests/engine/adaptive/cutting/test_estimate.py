"""Quadratic forms of cells, of one span and of several spans."""

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.adaptive.cutting.cells import build_whole_cells
from service.engine.adaptive.cutting.estimate import build_forms
from service.engine.adaptive.cutting.heights import find_planes, measure_heights
from service.engine.adaptive.cutting.span_estimate import estimate_span_cells
from service.engine.adaptive.cutting.span_pieces import NinePoints
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.surface.bspline import BsplineSurface
from tests.engine.adaptive.cutting.test_subdivision import build_task


@pytest.mark.parametrize("bend", [1.0, -1.0])
def test_form_is_height_of_chords_over_a_quadratic_surface(bend: float) -> None:
    def evaluate(u: float, v: float) -> FloatArray:
        return np.array([u, v, bend * (u * u + 0.5 * v * v) + 0.3 * u * v])

    nine_points = np.array([evaluate(u, v) for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)])
    at = nine_points[..., np.newaxis]
    planes, normal, steps, _ = find_planes(at)
    _, signed, _ = measure_heights(at, planes, normal, two_sided=False)
    # Rows 4 and 5 of `signed` are heights of the surface over chords along u and v; forms have
    # heights of chords over the surface, so the sign changes. Rows 3 to 5 of forms are a, b and c.
    a, b, c = build_forms(steps, normal, -signed[4:], np.ones(1))[3:6, 0]
    for begin, end in (((0, 0), (1, 1)), ((1, 0), (0, 1)), ((0, 0), (1, 0.5))):
        du, dv = end[0] - begin[0], end[1] - begin[1]
        middle = evaluate(begin[0] + du / 2, begin[1] + dv / 2)
        height = ((evaluate(*begin) + evaluate(*end)) / 2 - middle) @ normal[:, 0]
        assert height == pytest.approx(a * du**2 + 2 * b * du * dv + c * dv**2)


@pytest.mark.parametrize("bend", [1.0, -1.0])
def test_form_of_several_spans_is_that_of_one_span(bend: float) -> None:
    """The surface z = bend (u² + v²/2) + 0.3 u v as a spline of 3 × 3 spans, by blossoming."""
    knots = np.array([0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1])
    means, products = (knots[1:-2] + knots[2:-1]) / 2, knots[1:-2] * knots[2:-1]
    x, y = np.meshgrid(means, means, indexing="ij")
    z = bend * (products[:, np.newaxis] + products / 2) + 0.3 * x * y
    net = np.stack([x, y, z], axis=-1)
    task = build_task(BsplineSurface(net, (2, 2), (knots, knots)).lower(), Goal(1.0))
    cells = build_whole_cells(task.faces)
    assert cells.rectangle.ravel().tolist() == [0, 3 * SPAN, 0, 3 * SPAN]
    _, leaves = estimate_span_cells(task, cells, NinePoints(task))
    # The normal of the cell is orthogonal to both diagonals, (1, 1, 1.5 bend + 0.3) and
    # (−1, 1, −bend / 2); its last coordinate is n.
    normal = np.cross([1, 1, 1.5 * bend + 0.3], [-1, 1, -bend / 2])
    n = normal[2] / np.linalg.norm(normal)
    expected = np.array([bend / 4, 0.3 / 8, bend / 8]) * n
    np.testing.assert_allclose(leaves.form[3:6, 0], expected, rtol=1e-12)
