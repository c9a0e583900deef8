"""Curve and options in, points, tangents and lengths or lines out."""

from dataclasses import dataclass, replace
from typing import Protocol

from service.encoders.curves.format import CurveFormat, CurveSize
from service.engine.curves.options import CurveOptions
from service.engine.curves.trace import choose_samples, trace
from service.errors import Issue, TooLarge
from service.measuring import measured
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.memory import traceable, tracing
from service.pipeline.mesh_memory import SHARE
from service.surface.curve_pieces import CurvePieces


class LowerableCurve(Protocol):
    """Whatever lowers to the Bézier pieces of one curve."""

    def lower(self) -> CurvePieces:
        """The curve piece by piece."""
        ...


EASY_DEGREE = 8
"""Beyond, what certifies a curve costs a sample as the third power of the degree."""

POINT, SQUARE = 3_000, 50
"""Multiplications that measure a curve between two samples: so many, and times the square of the
degree."""


@dataclass(frozen=True, eq=False, slots=True)
class CurveWork:
    """A file of a curve that may be computed; with a tolerance, of at most `most` points."""

    pieces: CurvePieces
    options: CurveOptions
    fmt: CurveFormat
    limits: Limits
    most: int

    def run(self) -> bytes:
        """The file.

        Raises
        ------
        InvalidRequest, TooLarge
            If the tolerance cannot be met, or not with so many points.
        """
        with measured("curve"):
            at = choose_samples(self.pieces, self.options, self.most, single=self.fmt.single)
        _check_curve(self, len(at))
        with measured("curve"):
            polyline = trace(self.pieces, at, self.options, single=self.fmt.single)
        return self.fmt.encode(polyline)

    @property
    def memory(self) -> int:
        """Bytes that the work takes at most, the curve and the file included."""
        return tracing(self.pieces.points.nbytes, self.points, self.file(self.points))

    def file(self, points: int) -> int:
        """Bytes of the file at most, if the polyline has so many points."""
        most = self.fmt.byte_bound(CurveSize(points, len(self.pieces.name.encode())))
        return most if self.options.tolerance is None else min(most, self.limits.max_bytes)

    @property
    def points(self) -> int:
        """Points of the polyline, where they are known beforehand; else as many as there may be."""
        if self.options.tolerance is not None:
            return self.most
        return self.pieces.count * self.options.resolution + 1


def plan_curve(
    curve: LowerableCurve,
    options: CurveOptions,
    fmt: CurveFormat,
    limits: Limits = DEFAULT_LIMITS,
) -> CurveWork:
    """What is to be computed of a curve, after it was found affordable from the shapes alone.

    Raises
    ------
    TooLarge
    """
    pieces = curve.lower()
    work = max(1.0, (pieces.degree / EASY_DEGREE) ** 3)
    effort = POINT + SQUARE * pieces.degree**2
    most = max(2, min(int(limits.max_vertices / work), limits.max_multiplications // effort))
    planned = CurveWork(pieces, options, fmt, limits, most)
    if options.tolerance is None:
        _check_curve(planned, planned.points)
        less = "a lower resolution takes less"
        limits.check_memory(planned.memory, "The curve", "/resolution", less)
        return planned
    # How many there will be is not known: as many as a part of the memory holds.
    room = limits.max_memory // SHARE
    affordable = traceable(pieces.points.nbytes, planned.file, room)
    return replace(planned, most=max(2, min(most, affordable)))


def render_curve(
    curve: LowerableCurve,
    options: CurveOptions,
    fmt: CurveFormat,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The curve as a file of this format; raises what `plan_curve` and the work raise."""
    return plan_curve(curve, options, fmt, limits).run()


def _check_curve(work: CurveWork, points: int) -> None:
    """Refuses more points than are allowed, or more bytes."""
    where = "/resolution" if work.options.tolerance is None else "/tolerance"
    if points > work.most:
        raise TooLarge(
            Issue(
                "too_many_vertices",
                "The polyline would have too many points.",
                where,
                f"{points} points",
                f"at most {work.most}",
            )
        )
    most = work.fmt.byte_bound(CurveSize(points, len(work.pieces.name.encode())))
    message = f"The answer as {work.fmt.name} could become too large."
    work.limits.check_bytes(most, message, where)
