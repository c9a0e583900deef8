"""Tubes and ribbons: surfaces swept along a curve."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, count_nouns
from service.surface.checks import MAX_COORDINATE, MAX_DEGREE, Up, check_up
from service.surface.curve import Curve
from service.surface.curve_model import Profile, Ribbon, SweepModel, Tube
from service.surface.exact_tubes import ExactPatches, build_exact_tube
from service.surface.placement import check_box
from service.surface.sizes import SurfaceKind, SurfaceSize

MIN_SIDES, MAX_SIDES = 3, 1024

RINGS_AT_BEND = 8
"""The most additional rings at a bend: a bend turns by at most 180°, in steps of 22.5°."""


class SweptSurface(SurfaceKind):
    """The base of surfaces that are swept along a curve."""

    __slots__ = ()
    curve: Curve

    @property
    @abstractmethod
    def profile(self) -> Profile:
        """The profile that is swept along the curve."""

    @property
    def degree(self) -> tuple[int, int]:
        """(n, 0): the degree n of the curve. The profile across the curve counts as 0."""
        return self.curve.degree, 0

    def lower(self) -> SweepModel:
        """The curve's pieces and the profile that is swept along them."""
        return SweepModel(self.name, self.curve.lower(), self.profile, self.up)

    def count(self, row_size: int, end_rows: int) -> SurfaceSize:
        """The size of a sweep.

        Parameters
        ----------
        row_size : int
            Number of vertices at a sample of the curve.
        end_rows : int
            Number of rows at the last sample of the curve, and of caps.
        """
        pieces = self.curve.lower()
        net_points = len(pieces.polygon)
        # A curve of degree n may bend at each end of a piece, and at n − 1 cusps inside a piece.
        bends = pieces.count * pieces.degree + 1
        # The arrays of the curve and those of its pieces have about the same size.
        curve_bytes = 2 * pieces.points.nbytes + 2 * pieces.breaks.nbytes
        return SurfaceSize(
            (pieces.degree, 0),
            control_points=net_points,
            net_points=net_points,
            net_segments=net_points,
            name_bytes=2 * len(self.name.encode()),
            surface_bytes=curve_bytes + self.profile.spread.nbytes,
            curves=pieces.count,
            swept_vertices=pieces.count * row_size,
            extra_vertices=(end_rows + RINGS_AT_BEND * bends) * row_size,
        )


@dataclass(frozen=True, eq=False, slots=True)
class TubeSurface(SweptSurface):
    """A round tube about a curve.

    Attributes
    ----------
    curve : Curve
        Its name and vertical axis are ignored.
    radius : ndarray of float64, shape (k+1,)
        Bernstein coefficients of the radius over the curve's domain: one for a constant radius, two
        for a linear radius. No coefficient is negative, and not all are 0. Model units.
    sides : int
        Sides of the regular polygon that approximates the circle.
    caps : bool
        Whether the ends of an open tube are closed by flat discs. An end of radius 0 is a point and
        gets no disc.
    up : "y" or "z"
    name : str

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.
    """

    curve: Curve
    radius: FloatArray
    sides: int = 16
    caps: bool = True
    up: Up = "y"
    name: str = "tube"

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _validate_spread(self.radius, "radius"))
        if not MIN_SIDES <= self.sides <= MAX_SIDES:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The number of sides of a tube is limited.",
                    "/sides",
                    str(self.sides),
                    f"{MIN_SIDES} to {MAX_SIDES}",
                )
            )
        check_up(self.up)
        check_box(self.bounds(), "/radius", "points")

    def size(self) -> SurfaceSize:
        """The size of a tube: a ring of vertices at every sample of the curve, and its caps."""
        # A ring of s sides has s + 1 vertices: the first and the last are one point, with different
        # texture coordinates. The 5 rows: a ring at the last sample, and two at each end for a cap.
        return self.count(self.sides + 1, end_rows=5)

    def exact_patches(self) -> ExactPatches:
        """The tube as rational patches, if its curve is made of lines and circular arcs."""
        closed = self.lower().closed
        return build_exact_tube(
            self.curve.lower(), self.profile, closed=closed, up=self.up, name=self.name
        )

    @property
    def profile(self) -> Tube:
        """The circle that is swept along the curve."""
        return Tube(self.radius, self.sides, self.caps)


@dataclass(frozen=True, eq=False, slots=True)
class RibbonSurface(SweptSurface):
    """A flat stripe along a curve that faces a direction or a point.

    Attributes
    ----------
    curve : Curve
        Its name and vertical axis are ignored.
    width : ndarray of float64, shape (k+1,)
        Bernstein coefficients of the width over the curve's domain. No coefficient is negative, and
        not all are 0. Model units.
    facing : ndarray of float64, shape (3,), or None
        Direction that the ribbon faces, of any length; z if `facing` and `camera` are None.
    camera : ndarray of float64, shape (3,), or None
        Point that the ribbon faces.
    up : "y" or "z"
    name : str

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.
    """

    curve: Curve
    width: FloatArray
    facing: FloatArray | None = None
    camera: FloatArray | None = None
    up: Up = "y"
    name: str = "ribbon"

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", _validate_spread(self.width, "width"))
        if self.facing is not None and self.camera is not None:
            raise InvalidRequest(
                Issue(
                    "conflicting_options",
                    "A ribbon faces a direction or a point.",
                    "/camera",
                    "both",
                    "one of facing and camera",
                )
            )
        if self.camera is None:
            facing = (0.0, 0.0, 1.0) if self.facing is None else self.facing
            object.__setattr__(self, "facing", _validate_vector(facing, "facing"))
            if not np.any(self.facing):
                raise InvalidRequest(
                    Issue(
                        "wrong_value",
                        "The direction that a ribbon faces has a length.",
                        "/facing",
                        "a vector without length",
                        "any other",
                    )
                )
        else:
            object.__setattr__(self, "camera", _validate_vector(self.camera, "camera"))
        check_up(self.up)
        check_box(self.bounds(), "/width", "points")

    def size(self) -> SurfaceSize:
        """The size of a ribbon: a line of two vertices at every sample of the curve."""
        return self.count(2, end_rows=1)

    def exact_patches(self) -> SurfaceKind:
        """Refuses a ribbon."""
        message = "Ribbons are meshed along their curves; they are not made of Bézier patches."
        needed = "a surface of patches, such as a B-spline of degree 1 across the curve"
        raise InvalidRequest(Issue("not_parametric", message, "", "a ribbon", needed))

    @property
    def profile(self) -> Ribbon:
        """The line that is swept along the curve."""
        return Ribbon(self.width, self.facing, self.camera)


def _validate_spread(values: ArrayLike, name: str) -> FloatArray:
    """Coefficients of radii or widths as a read-only array.

    Refuses negative coefficients, and coefficients that are all 0.
    """
    spread = np.atleast_1d(np.array(values, dtype=np.float64))
    if spread.ndim != 1 or not 1 <= len(spread) <= MAX_DEGREE + 1:
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "A list holds the coefficients of a Bézier function along the curve.",
                f"/{name}",
                count_nouns(spread.size, "numbers"),
                f"1 to {MAX_DEGREE + 1}",
            )
        )
    for index, value in enumerate(spread.tolist()):
        if not 0 <= value <= MAX_COORDINATE:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "A negative coefficient could turn the surface inside out.",
                    f"/{name}/{index}" if len(spread) > 1 else f"/{name}",
                    f"{value:.6g}",
                    f"0 to {MAX_COORDINATE:.7g}",
                )
            )
    if not spread.any():
        raise InvalidRequest(
            Issue("out_of_range", "All coefficients are 0.", f"/{name}", "0", "above 0")
        )
    spread += 0.0  # −0 becomes 0, so that equal surfaces have equal bytes
    spread.flags.writeable = False
    return spread


def _validate_vector(values: ArrayLike, name: str) -> FloatArray:
    """A vector of three finite numbers as a read-only array."""
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (3,) or not (np.abs(vector) <= MAX_COORDINATE).all():
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "The value is a vector in space.",
                f"/{name}",
                "something else",
                f"three numbers between -{MAX_COORDINATE:.7g} and {MAX_COORDINATE:.7g}",
            )
        )
    vector += 0.0  # −0 becomes 0, so that equal surfaces have equal bytes
    vector.flags.writeable = False
    return vector
