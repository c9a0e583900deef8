"""Nets of high degree by cubic ones, and how far these are from them.

The triangular net of a tensor net of degree (p, q) has (p+q+1)(p+q+2)/2 points, each a sum of many.
Above a certain degree it is cheaper to go by a net V of degree at most (3, 3) that is near the net
W over the box about the triangle. With E V for V raised to the degree of W, the hull property of
the difference gives, polynomial or homogeneous,

    |S − S'| ≤ max_i ‖W_i − (E V)_i‖,
    |S − S'| = |(X − X') − (w − w') S'| / w
             ≤ (max_i ‖X_i − (E X')_i‖ + max_i |w_i − (E w')_i| max ‖S'‖) / min_i w_i.

V is what least squares give in the Bernstein basis, keeping the ends of every line, hence the
corners. It need not be the best; only the difference has to be right.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein, elevation
from service.bases.cache import PLANS

LOW = 3
"""Degree to which nets are reduced."""

SHIFT = 2.0**-42
"""How far the surface of a reduced net goes while a parameter changes by a rounding, 2^-53, where
no coordinate is above 4 and no weight more than another; in proportion to what they are else."""


def near(boxes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nets of degree at most 3 near nets (p+1, q+1, D, m), and how near they are.

    Returns
    -------
    low : ndarray of float64, shape (min(p, 3)+1, min(q, 3)+1, D, m)
    points, weights : ndarray of float64, shape (m,)
        The two maxima of differences above, the first infinite where a weight is not positive, the
        second 0 where there are none.
    """
    low = boxes
    for axis in (0, 1):
        degree = boxes.shape[axis] - 1
        if degree > LOW:
            low = _applied(_reduction(degree), low, axis)
    raised = low
    for axis in (0, 1):
        degree = boxes.shape[axis] - 1
        if degree > LOW:
            raised = _applied(elevation(LOW, degree), raised, axis)
    gap = boxes - raised
    gap *= gap
    away = gap[:, :, 0] + gap[:, :, 1] + gap[:, :, 2]
    # The corners of a triangle within a box are rounded where they are no corners of the box.
    points = np.sqrt(away.max(axis=(0, 1))) + SHIFT
    weights = np.zeros_like(points)
    if boxes.shape[2] == 4:
        weights = np.sqrt(gap[:, :, 3].max(axis=(0, 1)))
        least, most = (choose(low[:, :, 3], axis=(0, 1)) for choose in (np.min, np.max))
        positive = least > 0
        points = np.where(positive, points + SHIFT * most / np.where(positive, least, 1.0), np.inf)
        low[:, :, 3] = np.where(positive, low[:, :, 3], 1.0)
    return low, points, weights


def _applied(matrix: FloatArray, nets: FloatArray, axis: int) -> FloatArray:
    """A matrix times the lines of nets, term after term."""
    lines = nets.swapaxes(0, axis)
    made = np.zeros((len(matrix), *lines.shape[1:]))
    for number, row in enumerate(matrix):
        for factor, line in zip(row, lines, strict=True):
            if factor:
                made[number] += factor * line
    return made.swapaxes(0, axis)


def _reduction(degree: int) -> FloatArray:
    """The net of degree 3 nearest to one of degree n with the same ends: shape (4, n+1)."""

    def build() -> FloatArray:
        t = np.arange(4 * degree + 1) / (4 * degree)
        fine, coarse = bernstein(degree, t), bernstein(LOW, t)
        ends = np.zeros((2, degree + 1))
        ends[0, 0] = ends[1, -1] = 1.0
        wanted = fine - coarse[:, [0, -1]] @ ends
        inner = np.linalg.lstsq(coarse[:, 1:-1], wanted, rcond=None)[0]
        return np.concatenate([ends[:1], inner, ends[1:]])

    return PLANS.get(("reduction", degree), build)
