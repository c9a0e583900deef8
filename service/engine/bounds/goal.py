"""What a mesh must meet, in the units of the model it is made of."""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue


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

    def distances_to_eye(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Distances from the eye to boxes, corners (m, 3): shape (m,); 0 without a view."""
        if self.view is None:
            return np.zeros(len(low))
        outside = np.maximum(np.maximum(low - self.view.eye, self.view.eye - high), 0.0)
        distances: FloatArray = np.sqrt(np.square(outside).sum(axis=1))
        return distances

    def nearest(self, low: FloatArray, high: FloatArray) -> float:
        """Distance from the eye to a box; 0 without a view."""
        return float(self.distances_to_eye(low[np.newaxis], high[np.newaxis])[0])


def too_small(got: str, least: float, pointer: str = "") -> InvalidRequest:
    """The refusal of a goal that rounding leaves no room for."""
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The numbers of the answer are not so precise.",
            pointer,
            got,
            f"at least {least:.3g} for this surface in this format",
        )
    )
