"""A prepared brep with its placement in a part, and the numbers of its faces there."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.prepared import PreparedBrep
from service.engine.scenes.placing import scalings


@dataclass(frozen=True, eq=False)
class PlacedBrep:
    """A brep in a part.

    Attributes
    ----------
    prepared : PreparedBrep
    matrix : ndarray of float64, shape (4, 4), or None
        Affine placement; None stands for the identity.
    first_face : int
        The number in the request of the first face.
    """

    prepared: PreparedBrep
    matrix: FloatArray | None = None
    first_face: int = 0

    def place(self, points: FloatArray) -> FloatArray:
        """Points (…, 3) after the placement."""
        if self.matrix is None:
            return points
        # One term after another, so that equal points stay equal, bit for bit.
        rows = [
            points[..., 0] * a + points[..., 1] * b + points[..., 2] * c + d
            for a, b, c, d in self.matrix[:3].tolist()
        ]
        return np.stack(rows, axis=-1)

    @property
    def stretch(self) -> float:
        """No distance becomes larger than by this factor."""
        return scalings(self.matrix)[1]
