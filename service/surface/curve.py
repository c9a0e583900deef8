"""Bézier and B-spline curves, polynomial or rational, in the plane or in space."""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.bases.extraction import extract_bezier_points
from service.errors import InvalidRequest, Issue, count_nouns
from service.surface.checks import MAX_DEGREE, Up, check_up, validate_points, validate_weights
from service.surface.curve_model import CurvePieces
from service.surface.knots import (
    Knots,
    build_knot_vector,
    check_bezier_points,
    check_degree,
    validate_knots,
)


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
        On creation, with pointers relative to the curve.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., sections 1.3 and 1.4.
    """

    control_points: FloatArray
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "curve"
    _pieces: CurvePieces = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = validate_points(self.control_points, "control_points", axes=2, dimensions=(2, 3))
        _check_count(len(points))
        object.__setattr__(self, "control_points", points)
        object.__setattr__(self, "weights", validate_weights(self.weights, (len(points),)))
        check_up(self.up)
        weights = None if self.weights is None else self.weights[np.newaxis]
        breaks = np.array([0.0, 1.0])
        pieces = CurvePieces(points[np.newaxis], weights, breaks, points, self.name, self.up)
        object.__setattr__(self, "_pieces", pieces)  # refuses curves that are one point

    @property
    def degree(self) -> int:
        """Degree n."""
        return len(self.control_points) - 1

    def lower(self) -> CurvePieces:
        """The curve as one piece."""
        return self._pieces


@dataclass(frozen=True, eq=False, slots=True)
class BsplineCurve:
    """C(t) = Σ_i N_i^p(t) P_i over [U_p, U_{n+1}]; rational (NURBS) if weights are given.

    Attributes
    ----------
    control_points : ndarray of float64, shape (n+1, d)
        The control polygon, d = 2 or 3. Model units.
    degree : int
        p, 1 to 64.
    knots : ndarray of float64, shape (n+p+2,), or a name
        Numbers that never decrease. Multiplicities inside the domain are at most p; at a knot of
        multiplicity p the curve has a corner. The first and the last knot may both be omitted. Or
        a name. With "clamped" the curve reaches its first and last control points, with "uniform"
        it does not. With "periodic" the curve closes with continuity C^{p−1}; its control points
        are not repeated.
    weights : ndarray of float64, shape (n+1,), or None
        Positive weights.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the glTF node.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the curve.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., chapters 3 and 4.
    """

    control_points: FloatArray
    degree: int = 3
    knots: Knots = "clamped"
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "curve"
    _pieces: CurvePieces = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = validate_points(self.control_points, "control_points", axes=2, dimensions=(2, 3))
        object.__setattr__(self, "control_points", points)
        check_degree(self.degree, "/degree")
        knots = validate_knots(self.knots, len(points), self.degree, "/knots", "/control_points")
        object.__setattr__(self, "knots", knots)
        _check_continuous(self.knots, len(points), self.degree)
        check_bezier_points((self.knot_vector,), (self.degree,), "/control_points")
        object.__setattr__(self, "weights", validate_weights(self.weights, (len(points),)))
        check_up(self.up)
        object.__setattr__(self, "_pieces", self._lower())  # refuses curves that are one point

    @property
    def periodic(self) -> bool:
        """Whether the curve closes periodically."""
        return isinstance(self.knots, str) and self.knots == "periodic"

    @property
    def knot_vector(self) -> FloatArray:
        """The knots as numbers.

        Those of a periodic curve fit its control points with the first p repeated at the end.
        """
        return build_knot_vector(self.knots, len(self.control_points), self.degree)

    def lower(self) -> CurvePieces:
        """The curve as one Bézier piece for each span."""
        return self._pieces

    def _lower(self) -> CurvePieces:
        """Compute the result of `lower`, once, on creation."""
        points = polygon = self.control_points
        weights = self.weights
        if weights is not None and weights.min() == weights.max():
            weights = None  # equal weights cancel: the curve is polynomial
        if self.periodic:
            points = knot.wrap_points(points, self.degree)
            weights = None if weights is None else knot.wrap_points(weights, self.degree)
            polygon = knot.wrap_points(polygon, 1)
        knots = self.knot_vector
        pieces, piece_weights = extract_bezier_points(points, knots, self.degree, weights)
        breaks = knot.breaks(knots, self.degree)
        return CurvePieces(pieces, piece_weights, breaks, polygon, self.name, self.up)


Curve: TypeAlias = BezierCurve | BsplineCurve
"""A curve of any kind."""


def _check_count(count: int) -> None:
    """Refuse a Bézier curve with fewer than two control points, or with too high a degree."""
    if count < 2:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "A curve needs at least two control points (degree 1).",
                "/control_points",
                count_nouns(count, "control points"),
                "at least 2",
            )
        )
    if count - 1 > MAX_DEGREE:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "n + 1 control points are one Bézier curve of degree n. With such a high degree, "
                "no control point shapes the curve; use a B-spline.",
                "/control_points",
                f"degree {count - 1}",
                f"degrees up to {MAX_DEGREE}",
            )
        )


def _check_continuous(knots: Knots, count: int, degree: int) -> None:
    """Refuse the knots of a curve with `count` control points if it would be discontinuous.

    Knots that have a name always pass.
    """
    vector = build_knot_vector(knots, count, degree)
    low, high = knot.domain(vector, degree)
    distinct, counts = np.unique(vector, return_counts=True)
    jumps = distinct[(counts > degree) & (distinct > low) & (distinct < high)]
    if len(jumps):
        # The pointer counts the knots of the request, which may have omitted the first.
        omitted = int(len(knots) < len(vector))
        last_equal = int(np.searchsorted(vector, jumps[0])) + degree - omitted
        raise InvalidRequest(
            Issue(
                "knot_multiplicity",
                "At degree + 1 equal knots inside its domain the curve would be discontinuous; "
                "make two curves.",
                f"/knots/{last_equal}",
                f"{degree + 1} equal knots",
                f"at most {degree} inside the domain",
            )
        )
