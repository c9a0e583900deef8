"""What a mesh must meet, in the units of the model it is made of."""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """Where the mesh is looked at from: the allowed deviation grows with the distance.

    Attributes
    ----------
    eye : ndarray of float64, shape (3,)
        Model coordinates.
    rate : float
        Allowed deviation per unit of distance from the eye.
    near : float
        Least distance that counts: nothing is asked to be nearer than this.
    """

    eye: FloatArray
    rate: float
    near: float


@dataclass(frozen=True, eq=False, slots=True)
class Goal:
    """What is asked of every triangle.

    Attributes
    ----------
    tolerance : float
        Model units; where only angles or pixels count, more than any mesh of the model strays.
    angle : float
        Radians between normals of neighbouring vertices; infinite where none was stated.
    two_sided : bool
    view : View or None
    """

    tolerance: float
    angle: float = inf
    two_sided: bool = False
    view: View | None = None

    def allowed(self, distance: FloatArray) -> FloatArray:
        """Deviation allowed to what is at least so far from the eye, shape (m,)."""
        if self.view is None:
            return np.full(distance.shape, self.tolerance)
        seen = self.view.rate * np.maximum(distance, self.view.near)
        return np.minimum(seen, self.tolerance)
