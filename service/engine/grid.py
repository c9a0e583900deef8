"""Positions on a grid: multiples of a step, so few of them that 16 bits number them.

The step is a power of two, and the grid goes through the zero of the model's own coordinates. So
nothing is rounded but when a position is put on the grid: products, sums and float32 hold multiples
of the step exactly. And what matters for seams is the step alone: two meshes of equal steps meet
wherever they met before, each with a corner of its own to count from, in one file or in two. The
price is at most one of the 16 bits. A grid is as wide in all directions, or normals would lean.
"""

from math import frexp, ldexp, sqrt

import numpy as np

from service.bases.arrays import FloatArray

MOST = 65535
"""The largest number of 16 bits."""

LONGEST = MOST - 2
"""Steps that a model is long at most: its ends are rounded, and may have been before."""

SMALLEST = 2.0**-126
"""The least step: below, float32 loses digits, and graphics cards take it for zero."""

FINEST = 2.0**-52
"""A step is no smaller part of the largest coordinate: float64 holds its multiples."""

CORNER = sqrt(3) / 2
"""How far, in steps, a position may be from the next one on the grid."""

FLOAT32_MAX = float(np.finfo(np.float32).max)


def find_step(low: FloatArray, high: FloatArray) -> float:
    """The least step of a grid that covers these bounds."""
    furthest = max(-float(low.min()), float(high.max()))
    least = max(float((high - low).max()) / LONGEST, furthest * FINEST, SMALLEST)
    mantissa, exponent = frexp(least)
    return ldexp(1.0, exponent - (mantissa == 0.5))


def round_to_grid(positions: FloatArray, step: float) -> FloatArray:
    """The multiples of a step that are next to some coordinates."""
    # The next one beyond the largest float32 would be none.
    most = FLOAT32_MAX // step
    nearest: FloatArray = np.clip(np.rint(positions / step), -most, most) * step
    return nearest + 0.0
