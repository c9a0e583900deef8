"""How a format stores positions, so that the certificate can use the stored ones."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.extent import choose_origin
from service.engine.grid import CORNER, round_to_grid
from service.engine.scenes.placing import EPS, single_error
from service.engine.scratch import Real


@dataclass(frozen=True, slots=True)
class Storage:
    """Precision and origin of the positions in a file.

    Attributes
    ----------
    single : bool
        Whether positions are float32 instead of float64.
    local : bool
        Whether the format can store positions about an origin, which models far from zero need.
    step : float
        Positions and origin are multiples of it (`service.engine.grid`); 0 without a grid.
    """

    single: bool = False
    local: bool = False
    step: float = 0.0

    @property
    def dtype(self) -> Real:
        """The type of the numbers."""
        return np.float32 if self.single else np.float64

    def choose_origin(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The origin of positions between these bounds."""
        origin = choose_origin(low, high) if self.single and self.local else np.zeros(3)
        return round_to_grid(origin, self.step) if self.step else origin

    def bound_storage_rounding(
        self, origin: FloatArray, low: FloatArray, high: FloatArray
    ) -> float:
        """Bound of the distance that storing moves a vertex between these bounds."""
        moved = CORNER * self.step
        return moved + single_error(low, high, origin) if self.single else moved

    def store_positions(self, positions: FloatArray, origin: FloatArray) -> RealArray:
        """Positions (N, 3) as the file stores them, about the origin, from model coordinates."""
        if self.step:
            positions = round_to_grid(positions, self.step)
        if self.single:
            return (positions - origin).astype(np.float32)
        # People read these numbers: adding 0.0 turns -0.0 into 0.0.
        return positions + 0.0

    def restore_positions(self, positions: FloatArray, origin: FloatArray) -> FloatArray:
        """Positions in model coordinates after storing, float64, right to `bound_origin_error`."""
        if not (self.single or self.step):
            return positions
        read: FloatArray = self.store_positions(positions, origin).astype(np.float64) + origin
        return read


def bound_origin_error(origin: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Rounding of adding the origin: half a unit in the last place of each coordinate."""
    if not origin.any():
        return 0.0
    return EPS * hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())
