"""The file of a curve: points, tangents and lengths as JSON, or lines in another format."""

from dataclasses import dataclass

from service.encoders.curves.format import CurveFormat, CurveSize
from service.engine.curves.options import CurveOptions
from service.engine.curves.trace import choose_samples, trace_curve
from service.errors import Issue
from service.measuring import Measured
from service.pipeline.cost import POINT, SCRATCH, SHARE, Cost, curve_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.surface.curve import Curve

EASY_DEGREE = 8
"""Beyond this degree, the certificate costs each sample the third power of the degree."""

POINT_EFFORT, SQUARE = 3_000, 50
"""Multiplications that measure a curve between two samples: `POINT_EFFORT`, plus `SQUARE` times the
square of the degree."""


@dataclass(frozen=True, eq=False, slots=True)
class CurveWork:
    """The work of a file of a curve with at most `most` points, within the limits."""

    curve: Curve
    options: CurveOptions
    fmt: CurveFormat
    limits: Limits
    max_points: int
    cost: Cost

    def run(self) -> bytes:
        """The file.

        Raises
        ------
        InvalidRequest, TooLarge
            If the tolerance cannot be met, or needs more points than are allowed.
        """
        pieces, single = self.curve.lower(), self.fmt.single
        with Measured("curve"):
            at = choose_samples(pieces, self.options, self.max_points, single=single)
        _check_curve(self, len(at))
        with Measured("curve"):
            polyline = trace_curve(pieces, at, self.options, single=single)
        return self.fmt.encode(polyline)


def plan_curve(
    curve: Curve, options: CurveOptions, fmt: CurveFormat, limits: Limits = DEFAULT_LIMITS
) -> CurveWork:
    """Plans a file of a curve; checks limits by the shapes of the curve.

    Raises
    ------
    TooLarge
    """
    pieces = curve.lower()  # cached since the curve was built
    degree, numbers = pieces.degree, pieces.points.size
    hard = max(1.0, (degree / EASY_DEGREE) ** 3)
    effort = POINT_EFFORT + SQUARE * degree**2
    most = max(2, min(int(limits.max_vertices / hard), limits.max_multiplications // effort))
    points = pieces.count * options.resolution + 1
    if options.tolerance is not None:
        # Their number is not known: take the most points that a part of the memory holds.
        each = POINT + 2 * (_file(curve, fmt, 1001) - _file(curve, fmt, 1)) // 1000
        room = limits.max_memory // SHARE - 8 * numbers - SCRATCH
        points = most = max(2, min(most, room // each))
    file = min(_file(curve, fmt, points), limits.max_bytes)
    cost = curve_cost(points, degree, numbers, file)
    work = CurveWork(curve, options, fmt, limits, most, cost)
    if options.tolerance is None:
        _check_curve(work, points)
        less = "a lower resolution takes less"
        limits.check_memory(cost.memory, "The curve", "/resolution", less)
    return work


def _check_curve(work: CurveWork, points: int) -> None:
    """Refuses more points or more bytes than are allowed."""
    where = "/resolution" if work.options.tolerance is None else "/tolerance"
    issue = Issue("too_many_vertices", "The polyline would have too many points.", where)
    check_count(points, work.max_points, "points", issue)
    most = _file(work.curve, work.fmt, points)
    message = f"The response as {work.fmt.name} could become too large."
    work.limits.check_bytes(most, message, where)


def _file(curve: Curve, fmt: CurveFormat, points: int) -> int:
    """Most bytes of the file of a polyline of `points` points."""
    return fmt.byte_bound(CurveSize(points, len(curve.name.encode())))
