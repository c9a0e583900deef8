"""The options of a curve; polylines, and the result of the engine for a curve with its report."""

from dataclasses import dataclass
from math import inf

from service.bases.arrays import FloatArray, RealArray
from service.engine.curves.derivatives import Columns
from service.engine.mesh.mesh import ENGINE
from service.engine.options import MAX_RESOLUTION
from service.errors import InvalidRequest, Issue
from service.surface.checks import Up


@dataclass(frozen=True, eq=False, slots=True)
class CurveOptions:
    """The options that choose the samples of a curve, and the data computed for each sample.

    Attributes
    ----------
    resolution : int
        Divisions of every piece. Not used if there is a tolerance.
    tolerance : float or None
        Model units. The curve stays within this distance of the polyline of its samples.
    parameters : ndarray of float64, shape (N,), or None
        The samples, in any order, in place of `resolution` and `tolerance`.
    order : 0, 1, 2 or 3
        The order of the derivatives that samples carry.
    tangents, arc_lengths : bool
        Whether samples carry unit tangents, and the length of the curve up to them.
    """

    resolution: int = 16
    tolerance: float | None = None
    tangents: bool = True
    arc_lengths: bool = True
    parameters: FloatArray | None = None
    order: int = 0

    @property
    def field(self) -> str:
        """The name of the request's field that chooses the samples."""
        if self.parameters is not None:
            return "parameters"
        return "resolution" if self.tolerance is None else "tolerance"

    def __post_init__(self) -> None:
        if not 1 <= self.resolution <= MAX_RESOLUTION:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The resolution is the number of divisions of each piece of the curve.",
                    "/resolution",
                    str(self.resolution),
                    f"1 to {MAX_RESOLUTION}",
                )
            )
        if self.tolerance is not None and not 0 < self.tolerance < inf:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The tolerance is a distance.",
                    "/tolerance",
                    f"{self.tolerance:.6g}",
                    "a number above 0",
                )
            )


@dataclass(frozen=True, eq=False, slots=True)
class Polyline:
    """Points (k, 3) in model units; a closed polyline ends in its first point."""

    points: FloatArray
    closed: bool

    @property
    def distinct_points(self) -> FloatArray:
        """The points, without the repeated first point at the end of a closed polyline."""
        return self.points[:-1] if self.closed else self.points


@dataclass(frozen=True, slots=True)
class CurveReport:
    """The report on a sampled curve.

    `length` is that of the curve, not of the polyline. The last point of a `closed` curve repeats
    the first. `deviation_bound` bounds the distance of every point of the curve from the polyline
    through the stored points; it is None for points at chosen parameters, which are no polyline.
    `bounds_min` and `bounds_max` are the bounds of the stored points, in model coordinates.
    `engine` is the version of the engine (`ENGINE`).
    """

    points: int
    pieces: int
    length: float
    closed: bool
    deviation_bound: float | None
    bounds_min: tuple[float, ...]
    bounds_max: tuple[float, ...]
    engine: int = ENGINE


@dataclass(frozen=True, eq=False, slots=True)
class SampledCurve:
    """Samples of a curve: in order, from its beginning to its end, or at chosen parameters.

    Attributes
    ----------
    points : ndarray, shape (N, d), d = 2 or 3
        float64 in model coordinates; or float32 relative to `origin`.
    tangents : ndarray of float64, shape (N, d), or None
        Unit length; at a corner the direction of the piece that follows.
    parameters : ndarray of float64, shape (N,)
        In the curve's own domain.
    arc_lengths : ndarray of float64, shape (N,), or None
        Length of the curve up to each sample.
    derivatives : Columns
        The columns of `evaluate_derivatives`.
    origin : ndarray of float64, shape (d,)
        Model coordinates of the zero of `points`.
    """

    name: str
    points: RealArray
    tangents: FloatArray | None
    parameters: FloatArray
    arc_lengths: FloatArray | None
    derivatives: Columns
    origin: FloatArray
    up: Up
    report: CurveReport
