"""Positions on a grid: multiples of a step, which 16 bits can number.

The step is a power of two, and the grid contains the zero of model coordinates. So a position is
rounded once, when it is moved to the grid: products, sums and float32 represent multiples of the
step exactly. Two meshes with equal steps still meet wherever they met before, in one file or in
two, although each has its own corner of the grid. This costs at most 1 of the 16 bits. The step is
equal in all directions, because unequal steps would change the directions of normals.
"""

from math import frexp, ldexp, sqrt

import numpy as np

from service.bases.arrays import FloatArray

MOST = 65535
"""The largest number of 16 bits."""

LONGEST = MOST - 2
"""The most steps along a model: its ends are rounded, and may have been rounded before."""

SMALLEST = 2.0**-126
"""The least step: below it float32 loses digits, and graphics cards treat numbers as zero."""

FINEST = 2.0**-52
"""The least step as a share of the largest coordinate: float64 represents its multiples."""

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
    # The multiple beyond the largest float32 would not be finite.
    most = FLOAT32_MAX // step
    nearest: FloatArray = np.clip(np.rint(positions / step), -most, most) * step
    return nearest + 0.0
