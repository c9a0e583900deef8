"""Rounds positions to a grid: its points are multiples of a step, numbered by integers of 16 bits.

The step is a power of two, and the grid contains the zero of model coordinates. So a position that
was moved to the grid is not rounded again: products, sums and float32 represent multiples of the
step exactly. Two meshes with equal steps still meet wherever they met before, in one file or in
two, although each mesh numbers the points from its own lowest corner. A step that is a power of two
wastes at most 1 of the 16 bits. The step is equal in all directions, because unequal steps would
change the directions of normals.
"""

from math import frexp, ldexp, sqrt

import numpy as np

from service.bases.arrays import FloatArray

MAX_NUMBER = 65535
"""The largest number of 16 bits."""

MAX_STEPS = MAX_NUMBER - 2
"""The most steps along a model. Two numbers are reserved, one for each end: rounding to the grid
moves an end by up to half a step, and the end may have been rounded to float32 before."""

MIN_STEP = 2.0**-126
"""The least step: below it float32 loses digits, and graphics cards treat numbers as zero."""

MIN_STEP_SHARE = 2.0**-52
"""The least step as a share of the largest coordinate: float64 then represents all multiples of the
step in the model exactly."""

MAX_ROUNDING = sqrt(3) / 2
"""The largest distance, in steps, of a position from the nearest point of the grid: half of the
diagonal of a cube with sides of one step."""

FLOAT32_MAX = float(np.finfo(np.float32).max)


def find_step(low: FloatArray, high: FloatArray) -> float:
    """The least power of two that is the step of a grid over these bounds, (3,) each."""
    largest_coordinate = max(-float(low.min()), float(high.max()))
    min_step = max(
        float((high - low).max()) / MAX_STEPS, largest_coordinate * MIN_STEP_SHARE, MIN_STEP
    )
    mantissa, exponent = frexp(min_step)
    # A mantissa of 0.5 is an exact power of two, 2^(exponent - 1).
    return ldexp(1.0, exponent - (mantissa == 0.5))


def round_to_grid(positions: FloatArray, step: float) -> FloatArray:
    """The multiples of the step that are nearest to the coordinates, in an array of equal shape."""
    # A multiple beyond the largest float32 would become infinite.
    max_multiple = FLOAT32_MAX // step
    nearest: FloatArray = np.clip(np.rint(positions / step), -max_multiple, max_multiple) * step
    return nearest + 0.0  # turns -0.0 into 0.0
