"""How far apart points and weights may be that count as one.

A share of the diagonal of a model, its `weld_tolerance`, unless numbers are less precise: far from
zero, rounding moves points by more. A coordinate x has an error of some 2^-53 |x|. A knot t does,
too, and along the range of its knots, of length r, a point moves by some diagonals D: so the error
of the knot moves it by some 2^-53 |t| D / r. But no more than the largest `weld_tolerance` counts.
"""

from service.engine.options import MAX_WELD_TOLERANCE
from service.surface.lowered import PatchModel

COORDINATE_ROUNDING = 2.0**-50
"""Eight roundings of a coordinate at most: what turning and moving it in float64 costs."""

KNOT_ROUNDING = 2.0**-48
"""A few roundings of a knot, of which some diagonals come."""

PROJECTION_ROUNDING = 2.0**-49
"""Rounding of projections of two points on one direction, in units of the largest coordinate."""

COARSER = 4.0
"""Factor from the tolerance of points to that of weights: both change across a narrow patch, the
weights in places faster, and its long sides are one edge only if both are equal on them."""


def find_weld_distance(model: PatchModel, tolerance: float) -> float:
    """The largest distance of points that count as one, in model units; 0 if the tolerance is 0."""
    largest = find_largest_coordinate(model)
    return weld_distance(model.diagonal, largest, find_knot_ratio(model), tolerance)


def weld_distance(
    diagonal: float, largest_coordinate: float, knot_ratio: float, tolerance: float
) -> float:
    """The value of `find_weld_distance` for points with this diagonal and largest coordinate.

    `knot_ratio` as of `find_knot_ratio`.
    """
    if not tolerance:
        return 0.0
    rounding = max(COORDINATE_ROUNDING * largest_coordinate, KNOT_ROUNDING * knot_ratio * diagonal)
    return max(tolerance * diagonal, min(rounding, MAX_WELD_TOLERANCE * diagonal))


def find_projected_distance(model: PatchModel, tolerance: float) -> float:
    """How far apart projections of points that count as one may be; 0 if the tolerance is 0."""
    if not tolerance:
        return 0.0
    rounding = PROJECTION_ROUNDING * find_largest_coordinate(model)
    return find_weld_distance(model, tolerance) + rounding


def find_weight_tolerance(model: PatchModel, tolerance: float) -> float:
    """How far apart the logarithms of weights may be that count as one; 0 if the tolerance is 0.

    A change by h moves no point of a patch further than h / 2 times the diagonal of its box: in the
    largest patch, by `COARSER` / 2 times the distance of points that count as one.
    """
    if not tolerance:
        return 0.0
    share = max(tolerance, min(KNOT_ROUNDING * find_knot_ratio(model), MAX_WELD_TOLERANCE))
    extent = model.largest_patch
    return COARSER * share * model.diagonal / extent if extent else share


def find_knot_ratio(model: PatchModel) -> float:
    """The largest knot in units of the range of its knots, of all surfaces; at least 1."""
    ratio = 1.0
    for domain in model.domains:
        for knots in (domain.u, domain.v):
            low, high = knots.item(0), knots.item(-1)
            if max(-low, high) > ratio * (high - low):
                ratio = max(-low, high) / (high - low)
    return ratio


def find_largest_coordinate(model: PatchModel) -> float:
    """The largest coordinate of all control points."""
    return max([max(-min(low), *high) for low, high in (b.box for b in model.batches)])
