"""The file of a curve: its points, tangents and arc lengths as JSON, or lines in another format."""

from service.encoders.polylines.format import CurveFormat, PolylineSize
from service.engine.curves.options import CurveOptions
from service.engine.curves.trace import choose_samples, trace_curve
from service.errors import Issue
from service.measuring import Measured
from service.pipeline.checks import check_bytes
from service.pipeline.cost import MAX_SCRATCH_BYTES, MEMORY_SHARE, POINT_BYTES, Work, curve_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.surface.curve import Curve

EASY_DEGREE = 8
"""Above this degree, the time of each sample grows with the third power of the degree."""

POINT_EFFORT, SQUARE_EFFORT = 3_000, 50
"""The multiplications that measure a curve between two samples are `POINT_EFFORT`, plus
`SQUARE_EFFORT` times the square of the degree."""


def plan_curve(
    curve: Curve, options: CurveOptions, fmt: CurveFormat, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
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

    def check(points: int) -> None:
        """Refuse a polyline with more points, or a file with more bytes, than allowed."""
        where = "/resolution" if options.tolerance is None else "/tolerance"
        issue = Issue("too_many_vertices", "The polyline would have too many points.", where)
        check_count(points, max_points, "points", issue)
        check_bytes(_count_bytes(curve, fmt, points), fmt, limits, where)

    if options.tolerance is None:
        check(points)
        instead = "a lower resolution takes less"
        limits.check_memory(cost.memory, "The curve", "/resolution", instead)

    def run() -> bytes:
        """Sample the curve, and write the file; refuses a tolerance below the rounding."""
        with Measured("curve"):
            parameters = choose_samples(pieces, options, max_points, is_float32=fmt.is_float32)
        check(len(parameters))
        with Measured("curve"):
            polyline = trace_curve(pieces, parameters, options, is_float32=fmt.is_float32)
        return fmt.encode(polyline)

    return Work(cost, run)


def _count_bytes(curve: Curve, fmt: CurveFormat, points: int) -> int:
    """The most bytes of a file with a polyline of `points` points."""
    return fmt.byte_bound(PolylineSize(points, len(curve.name.encode())))
