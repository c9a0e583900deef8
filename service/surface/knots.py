"""Checks the degrees and knot vectors of a request, and builds the knot vectors that have names."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray, Ints
from service.bases.cache import BASES
from service.errors import MAX_ISSUES, InvalidRequest, Issue, count_nouns
from service.surface.checks import MAX_COORDINATE, MAX_DEGREE

KnotName: TypeAlias = Literal["uniform", "clamped", "periodic"]
Knots: TypeAlias = KnotName | FloatArray
"""A knot vector, or the name of one."""

NAMED: Mapping[str, Callable[[int, int], FloatArray]] = MappingProxyType(
    {"uniform": knot.uniform_knots, "clamped": knot.clamped_knots, "periodic": knot.periodic_knots}
)
"""For each name, the function that builds the knots from the number of control points and the
degree."""

MIN_PERIODIC = 3
"""The fewest control points of a periodic spline: two points cannot form a loop."""

MIN_SPAN, MIN_RATIO = 2.0**-40, 2.0**-49
"""Least length of a span as a fraction of the domain's length, and as a fraction of the larger
absolute value of the domain's ends. Knots that are closer differ by rounding alone, and are made
equal."""

MIN_LENGTH = float(np.finfo(np.float32).tiny)
"""Least length of any span. Programs in single precision may round shorter spans to 0, and
derivatives over shorter spans may exceed the range of float64."""

MAX_BEZIER_POINTS = 16_000_000
"""The most control points of all Bézier patches together, enough for a net of 1000 × 1000 control
points of degree 3. They take about 400 MB."""

MAX_ENTRIES = 4_000_000
"""The most entries of the extraction operators along one direction, which take about 100 MB."""

MAX_PIECES = 1_000_000
"""The most Bézier patches of a surface, or pieces of a curve. Patches of low degree have few
control points, but each patch takes time, too."""


def check_degree(degree: int, where: str) -> None:
    """Refuse a degree below 1 or above `MAX_DEGREE`."""
    if not 1 <= degree <= MAX_DEGREE:
        code = "degree_too_high" if degree > MAX_DEGREE else "out_of_range"
        needed = f"1 to {MAX_DEGREE}"
        raise InvalidRequest(
            Issue(code, "The degree of a B-spline is limited.", where, f"degree {degree}", needed)
        )


def validate_knots(knots: Knots, count: int, degree: int, where: str, points_pointer: str) -> Knots:
    """Check knots: returns the name of a knot vector, or the knots as a read-only array.

    Parameters
    ----------
    knots : name or array_like of float64
    count : int
        Control points in this direction, n + 1.
    degree : int
        p; the caller has checked it.
    where, points_pointer : str
        JSON pointers to the knots and to the control points.

    Raises
    ------
    InvalidRequest
        `too_few_points`, `wrong_value`, `wrong_length`, `not_finite`, `knot_too_large`,
        `knots_decrease`, `knot_multiplicity`, `empty_domain` or `knots_too_close`.
    """
    name = knots if isinstance(knots, str) else ""
    min_count = MIN_PERIODIC if name == "periodic" else degree + 1
    if count < min_count:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "A B-spline has at least one control point more than its degree; a periodic one "
                "has three.",
                points_pointer,
                f"{count_nouns(count, 'control points')} for degree {degree}",
                f"at least {min_count}",
            )
        )
    if isinstance(knots, str):
        if knots not in NAMED:
            raise InvalidRequest(
                Issue(
                    "wrong_value",
                    "Knots are a list of numbers or the name of a knot vector.",
                    where,
                    "another text",
                    "one of " + ", ".join(NAMED),
                )
            )
        return knots
    vector = np.array(knots, dtype=np.float64, order="C")
    full_length = count + degree + 1
    if vector.shape not in ((full_length,), (full_length - 2,)):
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "A knot vector has as many knots as there are control points, and degree + 1 more; "
                "its first and its last one may both be left out.",
                where,
                count_nouns(vector.size, "knots"),
                f"{full_length} = {count} + {degree} + 1, or {full_length - 2}",
            )
        )
    _refuse(
        np.flatnonzero(~np.isfinite(vector)),
        where,
        lambda _: Issue(
            "not_finite",
            "Every number must be finite.",
            got="not a finite number",
            needed="a finite number",
        ),
    )
    _refuse(
        np.flatnonzero(np.abs(vector) > MAX_COORDINATE),
        where,
        lambda k: Issue(
            "knot_too_large",
            "Parameters are stored in single precision.",
            got=f"{vector[k]:.6g}",
            needed=f"between -{MAX_COORDINATE:.7g} and {MAX_COORDINATE:.7g}",
        ),
    )
    _check_order(vector, degree, full_length, where)
    vector += 0.0  # −0 becomes 0, so that equal surfaces have equal bytes
    vector.flags.writeable = False
    return vector


def build_knot_vector(knots: Knots, count: int, degree: int) -> FloatArray:
    """The n + p + 2 knots with which a spline is computed.

    The knots of "periodic" fit the control points with the first p repeated at the end. If a
    request omits the first and the last knot, they become equal to their neighbours, because they
    have no effect inside the domain. Knots that differ by rounding alone are made equal.
    """
    if not isinstance(knots, str):
        knots = _complete(knots, count + degree + 1)
        return knot.merge_knots(knots, degree, find_least_span(*knot.domain(knots, degree)))
    return BASES.array(("knots", knots, count, degree), lambda: NAMED[knots](count, degree))


def count_merged(knots: Knots, count: int, degree: int) -> int:
    """Number of knots that `build_knot_vector` makes equal to others."""
    if isinstance(knots, str):
        return 0
    vector = build_knot_vector(knots, count, degree)
    completed = _complete(knots, len(vector))
    return int(np.count_nonzero((np.diff(vector) == 0) & (np.diff(completed) > 0)))


def _complete(knots: FloatArray, length: int) -> FloatArray:
    """The knots with the first and the last repeated, unless they already have this length."""
    return knots if len(knots) == length else np.pad(knots, 1, mode="edge")


def check_bezier_points(
    vectors: tuple[FloatArray, ...], degree: tuple[int, ...], points_pointer: str
) -> None:
    """Refuse knot vectors with too many spans, whose Bézier patches would take too much memory."""
    pieces = [len(knot.spans(u, p)) for u, p in zip(vectors, degree, strict=True)]
    point_count = math.prod(n * (p + 1) for n, p in zip(pieces, degree, strict=True))
    entries = max(n * (p + 1) ** 2 for n, p in zip(pieces, degree, strict=True))
    if point_count > MAX_BEZIER_POINTS or entries > MAX_ENTRIES:
        raise InvalidRequest(
            Issue(
                "too_many_bezier_points",
                "Every span becomes a Bézier patch, or piece of a curve, with its own control "
                "points. These, or the entries of the extraction operators, would be too many.",
                points_pointer,
                " × ".join(f"{n} spans of degree {p}" for n, p in zip(pieces, degree, strict=True)),
                f"at most {MAX_BEZIER_POINTS} Bézier control points, and at most {MAX_ENTRIES} "
                "entries, spans × (degree + 1)², along one direction",
            )
        )
    if math.prod(pieces) > MAX_PIECES:
        raise InvalidRequest(
            Issue(
                "too_many_spans",
                "Every span becomes a Bézier patch, or piece of a curve: these would be too many.",
                points_pointer,
                " × ".join(str(n) for n in pieces) + " spans",
                f"at most {MAX_PIECES} in all",
            )
        )


def find_least_span(low: float, high: float) -> float:
    """Least length of a span if the domain of the knots is from `low` to `high`."""
    return max(MIN_SPAN * (high - low), MIN_RATIO * max(abs(low), abs(high)), MIN_LENGTH)


def _check_order(vector: FloatArray, degree: int, full_length: int, where: str) -> None:
    """Refuse knots that decrease, too high multiplicities, and a domain without length.

    If `vector` has two knots fewer than `full_length`, the first and the last were omitted.
    """
    _refuse(
        np.flatnonzero(vector[1:] < vector[:-1]) + 1,
        where,
        lambda k: Issue(
            "knots_decrease",
            "Knots never decrease.",
            got=f"{vector.item(k)!r} after {vector.item(k - 1)!r}",
            needed="at least the knot before",
        ),
    )
    # The pointers of issues count the knots of the request, without the omitted first knot.
    omitted = int(len(vector) < full_length)
    knots = _complete(vector, full_length)
    # Refuse each knot that equals the knot p + 1 positions before.
    _refuse(
        np.flatnonzero(knots[degree + 1 :] == knots[: -degree - 1]) + degree + 1 - omitted,
        where,
        lambda _: Issue(
            "knot_multiplicity",
            "A B-spline is discontinuous at degree + 1 equal knots; more have no effect.",
            got=f"more than {degree + 1} equal knots",
            needed=f"at most {degree + 1} for degree {degree}",
        ),
    )
    knots = knot.merge_knots(knots, degree, find_least_span(*knot.domain(knots, degree)))
    low, high = knot.domain(knots, degree)
    if not low < high:
        raise InvalidRequest(
            Issue(
                "empty_domain",
                "The domain of degree p is between the knots p and m − p of the knots 0 to m.",
                where,
                f"{low:.6g} to {high:.6g}",
                "a domain of some length",
            )
        )
    # `merge_knots` does not make knots equal if this would give too high a multiplicity.
    span_numbers = knot.spans(knots, degree)
    lengths = np.diff(knots)
    _refuse(
        span_numbers[lengths[span_numbers] < MIN_LENGTH] + 1 - omitted,
        where,
        lambda k: Issue(
            "knots_too_close",
            "Knots that differ by less than the shortest span must be equal.",
            got=f"{lengths[k - 1 + omitted]:.3g} more than the knot before",
            needed=f"equal knots, or at least {MIN_LENGTH:.3g} more",
        ),
    )


def _refuse(positions: Ints, where: str, describe: Callable[[int], Issue]) -> None:
    """Raise one issue for each of the first `MAX_ISSUES` positions in the knots of the request."""
    issues = [(k, describe(k)) for k in positions[:MAX_ISSUES].tolist()]
    if issues:
        raise InvalidRequest(*(replace(issue, pointer=f"{where}/{k}") for k, issue in issues))
