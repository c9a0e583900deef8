"""Ends, sizes and samples of curves, many of which are lines between two points.

Files have more lines than other curves, and for a line each of these takes one array operation.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.splines import evaluate, find_domain, project_points


def is_line(curve: Curve) -> bool:
    """Whether a curve is a line between two points, with even parameters."""
    points = curve.points
    return len(points) == 2 and bool(points[0, -1] == points[1, -1])


def find_all_ends(curves: Sequence[Curve]) -> FloatArray:
    """The first and the last point of each curve, (n, 2, D)."""
    return project_points(np.array([curve.points[[0, -1]] for curve in curves]))


def measure_size(curve: Curve) -> float:
    """The longest side of the box around the control points of a curve."""
    points = project_points(curve.points)
    return float((points.max(axis=0) - points.min(axis=0)).max())


def sample(curve: Curve, count: int) -> FloatArray:
    """Points (count, D) at equal steps of the parameter, both ends included."""
    return evaluate(curve, np.linspace(*find_domain(curve), count))


def sample_all(curves: Sequence[Curve], count: int) -> FloatArray:
    """Points (n, count, D) of each curve at equal steps of its parameter, both ends included."""
    ends = find_all_ends(curves)
    shares = np.linspace(0.0, 1.0, count)[:, np.newaxis]
    points: FloatArray = (1.0 - shares) * ends[:, :1] + shares * ends[:, 1:]
    for row, curve in enumerate(curves):
        if not is_line(curve):
            points[row] = sample(curve, count)
    return points
