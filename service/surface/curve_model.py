"""Lowered curves, which are Bézier pieces, and lowered sweeps: a profile that follows a curve."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import dist
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray
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
    def is_single(self) -> Bools:
        """Whether each piece is a single point, (S,), as where control points repeat."""
        is_single: Bools = (self.points == self.points[:, :1]).all(axis=(1, 2))
        return is_single

    def drop_single(self) -> "CurvePieces":
        """The curve without pieces that are single points; its domain then is a shorter one."""
        if not self.is_single.any():
            return self
        kept = ~self.is_single
        weights = None if self.weights is None else self.weights[kept]
        breaks = self.breaks[: int(kept.sum()) + 1]
        return replace(self, points=self.points[kept], weights=weights, breaks=breaks)

    @cached_property
    def bounds(self) -> Box:
        """Least and greatest coordinates of the Bézier points: a box that contains the curve."""
        return find_box(self.points)

    @cached_property
    def middle(self) -> FloatArray:
        """The middle of the box `bounds`, shape (d,)."""
        low, high = self.bounds
        return low + (high - low) / 2


def to_space(points: FloatArray) -> FloatArray:
    """Points (…, 2) or (…, 3) as points (…, 3): points with two coordinates get z = 0."""
    if points.shape[-1] == 3:
        return points
    return np.pad(points, [(0, 0)] * (points.ndim - 1) + [(0, 1)])


MAX_WIDENING = 2**0.5
"""At a mitred corner of the curve, the profile is at most this factor wider than on a straight
curve: 1 / cos(45°), because only corners of at most 90° are mitred."""


@dataclass(frozen=True, eq=False, slots=True)
class Tube:
    """A round tube.

    `spread` has the Bernstein coefficients of the radius over the domain of the curve, shape
    (k+1,). `sides` is the number of sides of the polygon that approximates the circle; `caps` says
    whether discs close the ends of an open tube.
    """

    spread: FloatArray
    sides: int
    caps: bool

    @property
    def reach(self) -> float:
        """Upper bound of the distance of the surface from the curve."""
        return float(self.spread.max()) * MAX_WIDENING


@dataclass(frozen=True, eq=False, slots=True)
class Ribbon:
    """A flat stripe that faces a direction `facing` or a point `camera`.

    `spread` has the Bernstein coefficients of the width over the domain of the curve, shape (k+1,).
    """

    spread: FloatArray
    facing: FloatArray | None
    camera: FloatArray | None

    @property
    def reach(self) -> float:
        """Upper bound of the distance of the surface from the curve."""
        return float(self.spread.max()) / 2 * MAX_WIDENING


Profile: TypeAlias = Tube | Ribbon


@dataclass(frozen=True, eq=False)
class SweepModel:
    """A profile along a curve: the lowered form of tubes and ribbons, without Bézier patches.

    A closed curve gives a closed surface, unless the profiles at both ends differ.
    """

    name: str
    pieces: CurvePieces
    profile: Profile
    up: Up = "y"

    @property
    def patch_count(self) -> int:
        """The number of Bézier patches, 0."""
        return 0

    @property
    def closed(self) -> bool:
        """Whether the last profile of the sweep is joined to the first."""
        spread = self.profile.spread
        return self.pieces.closed and bool(spread[0] == spread[-1])

    @property
    def polygon(self) -> FloatArray:
        """The curve's control polygon in space, shape (K, 3)."""
        return to_space(self.pieces.polygon)

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates that enclose the surface."""
        low, high = (to_space(bound[np.newaxis])[0] for bound in self.pieces.bounds)
        return low - self.profile.reach, high + self.profile.reach

    @property
    def diagonal(self) -> float:
        """Diagonal of the box `bounds`."""
        return dist(*(bound.tolist() for bound in self.bounds))
