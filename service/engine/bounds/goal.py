"""The goal of a mesh: tolerance, angle and view, in the units of the model; the least tolerance.

The least tolerance follows from the rounding in the bounds of the certificate. The coordinates of a
piece are relative to the middle of the patch. Their unit is such that no coordinate of a control
point, or of a vertex of a reference triangle, exceeds 1. So the rounding is a number of units u =
2^-53 that follows from the degrees alone, plus that of stored vertices.

Proofs in docs/proofs.md: "Sums of products" and "Rounding of the certificate".
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.bounds.degree_reduction import DIRECT, SHIFT
from service.engine.nets.patch_nets import PatchNets
from service.engine.vectors import UNIT
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


def count_roundings(p: int, q: int) -> int:
    """All rounding of a bound of the certificate, in units u, for patches of degree (p, q)."""
    path = 2 + 3 * max(p, q) + 13 + 3 * (p + q) + 2 + 2 + (p + 1) * (q + 1)
    return 16 * path + 16 * (16 + p + q) + 64


def bound_storage_error(far: FloatArray) -> FloatArray:
    """Bounds (m,) of the errors of stored vertices whose coordinates are up to `far`, (m,).

    An error of u |X| in each of three coordinates is at most √3 u |X| < 4 u |X| in space.
    """
    return 4 * UNIT * far


LEAST = 2.0**-1000
"""The least tolerance of any surface, in model units: much smaller numbers are subnormal, and the
rounding of their products is not relative to their size."""


def find_least_tolerance(
    patch_nets: PatchNets, step: float = 0.0, used: Bools | None = None
) -> float:
    """The least tolerance for which a mesh is attempted, in model units.

    The bounds of every mesh, however fine, contain the rounding of the certificate, with that of
    lowering (`PatchNets.lowering`), and the distance of its vertices from the surface. This
    distance comes from evaluation, which rounds less than the certificate does, and from storing,
    with an error of at most `step`. The sum of the three errors, evaluation counted like the
    certificate, is doubled to leave room for the bending of the surface. The result is at least
    `LEAST`, also if all points are 0. Only patches that are `used` (P,) count; by default all.
    """
    least = 0.0
    for nets in patch_nets.groups:
        patches = nets.patches if used is None else nets.patches[used[nets.patches]]
        if not len(patches):
            continue
        sizes = patch_nets.sizes[patches]
        far = sizes + np.abs(patch_nets.middles[:, patches]).max(axis=0)
        # The error of the certificate in local units, with a factor 2 as a margin.
        error = 2 * UNIT * count_roundings(*nets.degree)
        if sum(nets.degree) > DIRECT:
            error += SHIFT
        # A local unit is a power of two, up to twice the size.
        slack = 2 * error * sizes + bound_storage_error(far)
        least = max(least, float(slack.max()))
    return max(4 * (least + patch_nets.lowering) + 2 * step, LEAST)


def check_goal(goal: Goal, least: float, nearest: float) -> None:
    """Refuses a goal that allows less than `least` at the distance `nearest` from the eye.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`.
    """
    allowed = float(goal.find_allowed(np.array([nearest]))[0])
    if allowed < least:
        raise build_tolerance_error(
            f"{allowed:.6g}", f"at least {least:.3g} for this surface in this format"
        )
