"""The lowered form of all kinds of curve: a sequence of Bézier pieces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue
from service.surface.checks import Up
from service.surface.placement import Box, find_box


@dataclass(frozen=True, eq=False)
class CurvePieces:
    """A curve as S Bézier pieces of one degree n; each piece begins where the one before ends.

        C(u) = Σ_i B_i^n(t) w_i P_i / Σ_i B_i^n(t) w_i,  t = (u − u_k) / (u_{k+1} − u_k)

    Attributes
    ----------
    points : ndarray of float64, shape (S, n+1, d)
        Bézier points, d = 2 or 3.
    weights : ndarray of float64, shape (S, n+1), or None
        Positive weights.
    breaks : ndarray of float64, shape (S+1,)
        Strictly increasing; piece k covers the parameters [u_k, u_{k+1}].
    polygon : ndarray of float64, shape (K, d)
        The control polygon of the request, for drawing. For a periodic curve the first point is
        repeated at the end.
    name : str
    up : "y" or "z"

    Raises
    ------
    InvalidRequest
        `degenerate_curve` if all points are equal.
    """

    points: FloatArray
    weights: FloatArray | None
    breaks: FloatArray
    polygon: FloatArray
    name: str = "curve"
    up: Up = "y"

    def __post_init__(self) -> None:
        for array in (self.points, self.weights, self.breaks, self.polygon):
            if array is not None:
                array.flags.writeable = False
        if (self.points == self.points[0, 0]).all():
            raise InvalidRequest(
                Issue(
                    "degenerate_curve",
                    "All control points are one point: such a curve has neither length nor "
                    "direction.",
                    "/control_points",
                    "equal points only",
                    "at least two different points",
                )
            )

    @property
    def count(self) -> int:
        """Number of pieces S."""
        return len(self.points)

    @property
    def degree(self) -> int:
        """Degree n of every piece."""
        return int(self.points.shape[1]) - 1

    @property
    def dimension(self) -> int:
        """Number of coordinates of a point, 2 or 3."""
        return int(self.points.shape[2])

    @cached_property
    def closed(self) -> bool:
        """Whether the last point of the curve equals the first."""
        return bool((self.points[0, 0] == self.points[-1, -1]).all())

    @cached_property
    def bounds(self) -> Box:
        """Least and greatest coordinates of the Bézier points: a box that contains the curve."""
        return find_box(self.points)

    @cached_property
    def middle(self) -> FloatArray:
        """The middle of the box `bounds`, shape (d,)."""
        low, high = self.bounds
        return low + (high - low) / 2

    @cached_property
    def space_points(self) -> FloatArray:
        """The Bézier points in space, shape (S, n+1, 3); points of a plane curve get z = 0."""
        return to_space(self.points)


def to_space(points: FloatArray) -> FloatArray:
    """Points (…, 2) or (…, 3) as points (…, 3): points with two coordinates get z = 0."""
    if points.shape[-1] == 3:
        return points
    widths = [(0, 0)] * (points.ndim - 1) + [(0, 1)]
    return np.pad(points, widths)
