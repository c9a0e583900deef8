"""Curves: one Bézier curve of any degree, polynomial or rational, in the plane or in space."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue
from service.surface.checks import MAX_DEGREE, check_up, checked_points, checked_weights
from service.surface.curve_pieces import CurvePieces
from service.surface.lowered import Up


@dataclass(frozen=True, eq=False, slots=True)
class BezierCurve:
    """C(t) = Σ_i B_i^n(t) P_i over t ∈ [0, 1]; rational if weights are given.

    Attributes
    ----------
    control_points : ndarray of float64, shape (n+1, d)
        The control polygon, d = 2 or 3. Model units.
    weights : ndarray of float64, shape (n+1,), or None
        Positive weights.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the glTF node.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the curve.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., sections 1.3 and 1.4.
    """

    control_points: FloatArray
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "curve"

    def __post_init__(self) -> None:
        points = checked_points(self.control_points, "control_points", axes=2, dimensions=(2, 3))
        _check_count(len(points))
        object.__setattr__(self, "control_points", points)
        if self.weights is not None:
            object.__setattr__(self, "weights", checked_weights(self.weights, (len(points),)))
        check_up(self.up)
        self.lower()  # refuses what is one point

    @property
    def degree(self) -> int:
        """Degree n."""
        return len(self.control_points) - 1

    def lower(self) -> CurvePieces:
        """The curve as the one piece it is."""
        weights = None if self.weights is None else self.weights[np.newaxis]
        points = self.control_points
        breaks = np.array([0.0, 1.0])
        return CurvePieces(points[np.newaxis], weights, breaks, points, self.name, self.up)


Curve: TypeAlias = BezierCurve
"""Every kind of curve there is."""


def _check_count(count: int) -> None:
    """Refuses too few points for a curve, and so many that no point shapes it any more."""
    if count < 2:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "A curve needs at least two control points (degree 1).",
                "/control_points",
                f"{count} control points",
                "at least 2",
            )
        )
    if count - 1 > MAX_DEGREE:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "n + 1 control points are one Bézier curve of degree n. So high a degree lets no "
                "control point shape the curve; use a B-spline.",
                "/control_points",
                f"degree {count - 1}",
                f"degrees up to {MAX_DEGREE}",
            )
        )
