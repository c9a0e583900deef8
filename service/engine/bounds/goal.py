"""The goal of a mesh: tolerance, angle and view, in the units of the model; the least tolerance.

The least tolerance follows from the rounding in the bounds of the certificate.

The relative error of one operation is at most u = 2^-53. The coordinates of a piece are relative to
the middle of the patch. Their unit is such that no coordinate of a control point, or of a vertex of
a reference triangle, exceeds 1. So no difference of two points is longer than 2√3 < 4.

**Nets.** From the control points of the request to a net over a triangle, a number is rounded r
times, in these steps (P a control point, M the middle of its patch, w its weight, a the origin of
the frame of the reference triangle):

    P − M, times w                                         2
    a triangular patch as tensor patch: 3 an elevation     3 max(p, q)
    w a, subtracted; three products added in the frame     5; the frame itself is right to 8 u
    rows of blossoms, two a level, (1 − t) b + t b         2 (p + q); 1 − t is exact
    their products with lines of the net                   p + q + 2
    its share in means, adding (p+1)(q+1) terms at most    2 + (p+1)(q+1); where degrees are
                                                           reduced, p + q + 4 are enough

Points are only combined with factors that are not negative. So the error of a coordinate (of a
homogeneous point: relative to its weight) is at most 4 r u, and the relative error of a weight at
most r u; dividing by the weight doubles this. The error of a point is at most √3 · 2 r · 4 u <
16 r u.

The error of a sum of k products is at most k u times the sum of their sizes, in any order of
addition, with fused operations or without (Higham, Accuracy and stability of numerical algorithms,
section 3.1). NumPy chooses the order of these sums; it is the same for every item of stacked
matrices.

**Distances.** `bound_distances` and `bound_heights` do a few more operations with these
coordinates: at most 16 in a row, and p + q + 1 more for the value half-way along an edge, one for
each point of the edge. From these values comes Q, the quadratic part of the heights (`distance`).
The greatest value of Q has at most 4/3 of their error, because 4 Σ λ_k λ_{k+1} ≤ 4/3; the net of Q
that is subtracted for the remainder has at most 8/3 of it, because 4 Σ i_k i_{k+1} / (n (n − 1)) ≤
4 n / (3 (n − 1)) ≤ 8/3 for n = p + q ≥ 2. Together these are (4/3 + 8/3) · 4 (n + 1) u and less
than 60 u more, which is below 16 (16 + p + q) u. Errors of wedges are at most 8 u times the length
of an edge (`reference_triangles`), so less than 64 u.

**Vertices.** For a vertex X, X − M is rounded, by at most u in the unit above. A position that is
stored relative to an origin is here the sum of both, which may be off by u |X| in each coordinate.
Adding the middle of the patch to a point also rounds, but the surface is defined by the control
points, which do not change.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import FloatArray
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
    """The sum of the roundings above, in units u, for patches of degree (p, q)."""
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


def find_least_tolerance(patch_nets: PatchNets, step: float = 0.0) -> float:
    """The least tolerance for which a mesh is attempted, in model units.

    The bounds of every mesh, however fine, contain the rounding above, with that of lowering
    (`PatchNets.lowering`), and the distance of its vertices from the surface. This distance comes
    from evaluation, which rounds less than the certificate does, and from storing, with an error of
    at most `step`. The sum of the three errors, evaluation counted like the certificate, is doubled
    to leave room for the bending of the surface. The result is at least `LEAST`, also if all points
    are 0.
    """
    least = 0.0
    for nets in patch_nets.groups:
        sizes = patch_nets.sizes[nets.patches]
        far = sizes + np.abs(patch_nets.middles[:, nets.patches]).max(axis=0)
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
        needed = f"at least {least:.3g} for this surface in this format"
        raise build_tolerance_error(f"{allowed:.6g}", needed)
