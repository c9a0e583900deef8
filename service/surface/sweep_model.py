"""Lowered sweeps: a curve and the profile that is swept along it."""

from dataclasses import dataclass
from functools import cached_property
from math import dist
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.checks import Up
from service.surface.curve_pieces import CurvePieces, to_space

MAX_WIDENING = 2**0.5
"""At a mitred corner of the curve, the profile is at most this factor wider than on a straight
curve: 1 / cos(45°), because only corners of at most 90° are mitred."""


@dataclass(frozen=True, eq=False, slots=True)
class Tube:
    """A round tube.

    `radii` are Bernstein coefficients over the domain of the curve, shape (k+1,). `sides` is the
    number of sides of the polygon that approximates the circle; `caps` says whether discs close the
    ends of an open tube.
    """

    radii: FloatArray
    sides: int
    caps: bool

    @property
    def spread(self) -> FloatArray:
        """The Bernstein coefficients of the radius."""
        return self.radii

    @property
    def reach(self) -> float:
        """Upper bound of the distance of the surface from the curve."""
        return float(self.radii.max()) * MAX_WIDENING


@dataclass(frozen=True, eq=False, slots=True)
class Ribbon:
    """A flat stripe that faces a direction `facing` or a point `camera`.

    `widths` are Bernstein coefficients over the domain of the curve, shape (k+1,).
    """

    widths: FloatArray
    facing: FloatArray | None
    camera: FloatArray | None

    @property
    def spread(self) -> FloatArray:
        """The Bernstein coefficients of the width."""
        return self.widths

    @property
    def reach(self) -> float:
        """Upper bound of the distance of the surface from the curve."""
        return float(self.widths.max()) / 2 * MAX_WIDENING


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
