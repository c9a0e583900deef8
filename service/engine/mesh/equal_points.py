"""Which points count as one: those that are equal bit for bit, and how far apart others may be.

Connectivity knows equal points only; near ones are made equal before (`service.engine.joining`).
The distance is a share of the diagonal of a model, its `weld_tolerance`, unless numbers are less
precise: far from zero, rounding moves points by more. A coordinate x has an error of some
2^-53 |x|. A knot t does, too, and along the range of its knots, of length r, a point moves by some
diagonals D: so the error of the knot moves it by some 2^-53 |t| D / r. But no more than the largest
`weld_tolerance` counts.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.unique_rows import unique_rows
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

FEW_POINTS = 40
"""Up to here points are looked up one by one sooner than sorted."""

DIRECTION = (0.5411961001461969, 0.7653668647301796, 0.3477591)
"""On which few points of a model have one projection, as they would on an axis."""


def find_equal_points(points: FloatArray) -> Ints:
    """For each point (N, 3) the first one that is equal to it: one decision for the whole engine.

    Points are equal if their coordinates are, bit for bit.
    """
    if len(points) <= FEW_POINTS:
        return np.array(find_first_equals(points), np.intp)
    leaders, number = unique_rows(points)
    return leaders[number]


def find_first_equals(points: FloatArray) -> tuple[int, ...]:
    """The first equal point of each of a few points, looked up one by one."""
    first: dict[tuple[float, ...], int] = {}
    return tuple([first.setdefault(tuple(p), k) for k, p in enumerate(points.tolist())])


@dataclass(frozen=True, eq=False, slots=True)
class EqualPoints:
    """A result of `find_equal_points`, to be compared with other points.

    `number` (N,) is the result, `leaders` (L,) the points that are equal to none before them.
    """

    number: Ints
    leaders: Ints

    @staticmethod
    def from_number(number: Ints) -> "EqualPoints":
        """The result with its leaders."""
        return EqualPoints(number, np.flatnonzero(number == np.arange(len(number))))

    def is_right_for(self, points: FloatArray, reach: float) -> bool:
        """Whether this is the result for `points` (N, 3), too, and others are further apart.

        False where that is not certain. All leaders are further apart than `reach` if their
        projections on one direction are: equal points have equal ones.
        """
        equal = points.take(self.number, axis=0) == points
        if np.count_nonzero(equal) < equal.size:
            return False
        place = _project(points.take(self.leaders, axis=0))
        place.sort()
        return not np.count_nonzero(place[1:] - place[:-1] <= reach)


def has_near_points(points: FloatArray, reach: float) -> bool:
    """Whether two points (N, 3) that differ may be at most `reach` apart, told by projections."""
    place = _project(points)
    order = place.argsort()
    rows, place = points.take(order, axis=0), place.take(order)
    differ = np.logical_or.reduce(rows[1:] != rows[:-1], axis=1)
    return bool((differ & (place[1:] - place[:-1] <= reach)).any())


def _project(points: FloatArray) -> FloatArray:
    """Places of points (N, 3) along one direction, (N,)."""
    x, y, z = points.T
    place: FloatArray = x * DIRECTION[0]
    place += y * DIRECTION[1]
    place += z * DIRECTION[2]
    return place


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
    largest = find_largest_coordinate(model)
    distance = weld_distance(model.diagonal, largest, find_knot_ratio(model), tolerance)
    return distance + PROJECTION_ROUNDING * largest


def find_weight_tolerance(model: PatchModel, tolerance: float) -> float:
    """How far apart the logarithms of weights may be that count as one; 0 if the tolerance is 0.

    A change by h moves no point of a patch further than h / 2 times the diagonal of its box: in the
    largest patch, by `COARSER` / 2 times the distance of points that count as one.
    """
    if not tolerance:
        return 0.0
    extent = model.largest_patch
    return COARSER * find_weld_distance(model, tolerance) / extent if extent else tolerance


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
