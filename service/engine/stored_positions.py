"""How files store positions: their precision, their origin, and a grid to which they are rounded.

The points of a grid are multiples of a step, numbered by integers of 16 bits. The step is a power
of two, and the grid contains the zero of model coordinates. So a position that was moved to the
grid is not rounded again: products, sums and float32 represent multiples of the step exactly. Two
meshes with equal steps still meet wherever they met before, in one file or in two, although each
mesh numbers the points from its own lowest corner. A step that is a power of two wastes at most 1
of the 16 bits. The step is equal in all directions, because unequal steps would change the
directions of normals.
"""

from dataclasses import dataclass
from math import frexp, hypot, ldexp, sqrt

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.extent import choose_origin
from service.engine.scratch import Real
from service.engine.vectors import UNIT

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

FLOAT32 = np.finfo(np.float32)
FLOAT32_MAX = float(FLOAT32.max)


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


def bound_single_error(low: FloatArray, high: FloatArray, origin: FloatArray) -> float:
    """Bound of the rounding error of a point within these bounds, in float32 about an origin.

    The error is half a unit in the last place of each coordinate, |x| 2^-24. The subtraction and
    the addition of the origin are in float64, with errors of at most |x| 2^-53 each.
    """
    largest_offset = np.maximum(np.abs(low - origin), np.abs(high - origin))
    coordinate_errors = largest_offset * float(FLOAT32.eps) / 2 + float(FLOAT32.smallest_subnormal)
    if origin.any():
        coordinate_errors = (
            coordinate_errors + (np.maximum(np.abs(low), np.abs(high)) + np.abs(origin)) * 2.0**-52
        )
    return hypot(*coordinate_errors.tolist()) * (1 + 2.0**-40)


def bound_origin_error(origin: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Bound of the rounding of adding the origin: half a unit in the last place of coordinates."""
    if not origin.any():
        return 0.0
    return 2 * UNIT * hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())


@dataclass(frozen=True, slots=True)
class Storage:
    """Precision and origin of the positions in a file.

    Attributes
    ----------
    is_float32 : bool
        Whether positions are float32 instead of float64.
    has_local_origin : bool
        Whether the format can store positions relative to an origin, which keeps models far from
        zero exact in float32.
    step : float
        Positions and origin are multiples of `step`; 0 without a grid.
    """

    is_float32: bool = False
    has_local_origin: bool = False
    step: float = 0.0

    @property
    def dtype(self) -> Real:
        """The type of the numbers."""
        return np.float32 if self.is_float32 else np.float64

    def choose_origin(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The origin of positions between these bounds."""
        origin = (
            choose_origin(low, high) if self.is_float32 and self.has_local_origin else np.zeros(3)
        )
        return round_to_grid(origin, self.step) if self.step else origin

    def bound_storage_rounding(
        self, origin: FloatArray, low: FloatArray, high: FloatArray
    ) -> float:
        """Bound of the distance by which storing moves a vertex between these bounds."""
        moved = MAX_ROUNDING * self.step
        return moved + bound_single_error(low, high, origin) if self.is_float32 else moved

    def store_positions(self, positions: FloatArray, origin: FloatArray) -> RealArray:
        """Stored positions (N, 3), relative to the origin, from positions in model coordinates."""
        if self.step:
            positions = round_to_grid(positions, self.step)
        if self.is_float32:
            return (positions - origin).astype(np.float32)
        # Adding 0.0 turns -0.0 into 0.0, which is easier to read in text formats.
        return positions + 0.0

    def restore_positions(self, positions: FloatArray, origin: FloatArray) -> FloatArray:
        """Store positions (N, 3) in model coordinates, and read them back in model coordinates.

        The results are float64. Adding the origin may round them; `bound_origin_error` bounds this.
        """
        if not (self.is_float32 or self.step):
            return positions
        return self.store_positions(positions, origin).astype(np.float64) + origin
