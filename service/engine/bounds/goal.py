"""The goal of a mesh: tolerance, angle and view, in the units of the model."""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """The eye that sees the mesh: the allowed deviation grows with the distance from it.

    Attributes
    ----------
    eye : ndarray of float64, shape (3,)
        Model coordinates.
    rate : float
        Allowed deviation per unit of distance from the eye.
    near : float
        Points nearer to the eye than this are treated as being at this distance.
    """

    eye: FloatArray
    rate: float
    near: float


@dataclass(frozen=True, eq=False, slots=True)
class Goal:
    """The largest deviation of triangles, and the largest angle between normals at their vertices.

    Attributes
    ----------
    tolerance : float
        Model units. If the request gives only an angle or a pixel tolerance, it is larger than the
        deviation of any mesh of the model.
    angle : float
        Radians between normals of neighbouring vertices; infinite if the request has no angle.
    two_sided : bool
        Whether the distance from the mesh to the surface is bounded too, by twice the tolerance.
    view : View or None
    """

    tolerance: float
    angle: float = inf
    two_sided: bool = False
    view: View | None = None

    def find_allowed(self, distance: FloatArray) -> FloatArray:
        """The deviations (m,) that the goal allows at these distances (m,) from the eye."""
        if self.view is None:
            return np.full(distance.shape, self.tolerance)
        allowed_by_view = self.view.rate * np.maximum(distance, self.view.near)
        return np.minimum(allowed_by_view, self.tolerance)

    def measure_distances_to_eye(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Distances (m,) from the eye to boxes; 0 without a view.

        `low` and `high`, (m, 3) each, are the least and the greatest corners of the boxes.
        """
        if self.view is None:
            return np.zeros(len(low))
        outside = np.maximum(np.maximum(low - self.view.eye, self.view.eye - high), 0.0)
        distances: FloatArray = np.sqrt(np.square(outside).sum(axis=1))
        return distances

    def find_nearest_distance(self, low: FloatArray, high: FloatArray) -> float:
        """Distance from the eye to a box; 0 without a view."""
        return float(self.measure_distances_to_eye(low[np.newaxis], high[np.newaxis])[0])


def build_tolerance_error(got: str, needed: str) -> InvalidRequest:
    """The error `tolerance_too_small`; its pointer is set by those who know the option."""
    message = "The tolerance is below the precision of the numbers in the response."
    return InvalidRequest(Issue("tolerance_too_small", message, "", got, needed))
