"""The file of a curve: its points, tangents and arc lengths as JSON, or lines in another format."""

from dataclasses import dataclass

from service.encoders.curves.format import CurveFormat, CurveSize
from service.engine.curves.options import CurveOptions
from service.engine.curves.trace import choose_samples, trace_curve
from service.errors import Issue
from service.measuring import Measured
from service.pipeline.cost import MAX_SCRATCH_BYTES, MEMORY_SHARE, POINT_BYTES, Cost, curve_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.surface.curve import Curve

EASY_DEGREE = 8
"""Above this degree, the time of each sample grows with the third power of the degree."""

POINT_EFFORT, SQUARE_EFFORT = 3_000, 50
"""The multiplications that measure a curve between two samples are `POINT_EFFORT`, plus
`SQUARE_EFFORT` times the square of the degree."""


@dataclass(frozen=True, eq=False, slots=True)
class CurveWork:
    """The work of making the file of a curve with at most `max_points` points, and its cost."""

    curve: Curve
    options: CurveOptions
    fmt: CurveFormat
    limits: Limits
    max_points: int
    cost: Cost

    def run(self) -> bytes:
        """Sample the curve, and write the file.

        Raises
        ------
        InvalidRequest
            The tolerance is below the rounding of the points.
        TooLarge
            The tolerance needs too many points.
        """
        pieces, is_float32 = self.curve.lower(), self.fmt.is_float32
        with Measured("curve"):
            parameters = choose_samples(
                pieces, self.options, self.max_points, is_float32=is_float32
            )
        _check_curve(self, len(parameters))
        with Measured("curve"):
            polyline = trace_curve(pieces, parameters, self.options, is_float32=is_float32)
        return self.fmt.encode(polyline)


def plan_curve(
    curve: Curve, options: CurveOptions, fmt: CurveFormat, limits: Limits = DEFAULT_LIMITS
) -> CurveWork:
    """Plan the file of a curve: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The curve or the file exceeds a limit.
    """
    pieces = curve.lower()  # takes no time: the curve was lowered when it was created
    degree, numbers = pieces.degree, pieces.points.size
    slowness = max(1.0, (degree / EASY_DEGREE) ** 3)
    effort = POINT_EFFORT + SQUARE_EFFORT * degree**2
    max_points = max(
        2, min(int(limits.max_vertices / slowness), limits.max_multiplications // effort)
    )
    points = pieces.count * options.resolution + 1
    if options.tolerance is not None:
        # The number of points is known only after sampling: allow the number that fits into a share
        # of the memory. A point takes 1/1,000 of the difference between the bytes of files of
        # 1,001 points and of 1 point.
        point_memory = (
            POINT_BYTES + 2 * (_count_bytes(curve, fmt, 1001) - _count_bytes(curve, fmt, 1)) // 1000
        )
        free_memory = limits.max_memory // MEMORY_SHARE - 8 * numbers - MAX_SCRATCH_BYTES
        points = max_points = max(2, min(max_points, free_memory // point_memory))
    file_bytes = min(_count_bytes(curve, fmt, points), limits.max_bytes)
    cost = curve_cost(points, degree, numbers, file_bytes)
    work = CurveWork(curve, options, fmt, limits, max_points, cost)
    if options.tolerance is None:
        _check_curve(work, points)
        instead = "a lower resolution takes less"
        limits.check_memory(cost.memory, "The curve", "/resolution", instead)
    return work


def _check_curve(work: CurveWork, points: int) -> None:
    """Refuse a polyline with more points, or a file with more bytes, than the limits allow."""
    where = "/resolution" if work.options.tolerance is None else "/tolerance"
    issue = Issue("too_many_vertices", "The polyline would have too many points.", where)
    check_count(points, work.max_points, "points", issue)
    byte_bound = _count_bytes(work.curve, work.fmt, points)
    message = f"The response as {work.fmt.name} could become too large."
    work.limits.check_bytes(byte_bound, message, where)


def _count_bytes(curve: Curve, fmt: CurveFormat, points: int) -> int:
    """The most bytes of a file with a polyline of `points` points."""
    return fmt.byte_bound(CurveSize(points, len(curve.name.encode())))
