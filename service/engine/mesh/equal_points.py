"""Finds points that are equal bit for bit, and the distance within which points count as one.

Connectivity compares points bit for bit; `service.engine.joining` makes near points equal before.
The distance is a share of the diagonal of a model, its `weld_tolerance`, unless numbers are less
precise: far from zero, rounding moves points by more. A coordinate x has an error of some 2^-53
|x|. A knot t does, too, and along the range of its knots, of length r, a point moves by some
diagonals D: so the error of the knot moves it by some 2^-53 |t| D / r. The distance is at most the
largest `weld_tolerance`.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.unique_rows import unique_rows
from service.engine.options import MAX_WELD_TOLERANCE
from service.surface.lowered import PatchModel

COORDINATE_ROUNDING = 2.0**-50
"""At most eight roundings of a coordinate, as a rotation and a translation in float64 need."""

KNOT_ROUNDING = 2.0**-48
"""A few roundings of a knot, times some diagonals."""

PROJECTION_ROUNDING = 2.0**-49
"""Rounding of the projections of two points to a direction, in units of the largest coordinate."""

COARSER = 4.0
"""Factor from the tolerance of points to the tolerance of weights. Both change across a narrow
patch, weights sometimes faster, and its long sides are one edge only if points and weights are
equal on them."""

FEW_POINTS = 40
"""Up to this number of points, looking them up one by one is faster than sorting."""

DIRECTION = (0.5411961001461969, 0.7653668647301796, 0.3477591)
"""A direction to which few points of a model have equal projections, unlike an axis."""


def find_equal_points(points: FloatArray) -> Ints:
    """For each point (N, 3) the first point that is equal to it, bit for bit.

    Every part of the engine uses this function.
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
    """A result of `find_equal_points`, for comparison with other points.

    `number` (N,) is the result, `leaders` (L,) the points that differ from all points before them.
    """

    number: Ints
    leaders: Ints

    @staticmethod
    def from_number(number: Ints) -> "EqualPoints":
        """The value for a result of `find_equal_points`."""
        return EqualPoints(number, np.flatnonzero(number == np.arange(len(number))))

    def is_right_for(self, points: FloatArray, reach: float) -> bool:
        """Whether this result holds for `points` (N, 3), and unequal points are not within `reach`.

        False if that is not certain. Leaders are further apart than `reach` if their projections to
        one direction are.
        """
        equal = points.take(self.number, axis=0) == points
        if np.count_nonzero(equal) < equal.size:
            return False
        place = _project(points.take(self.leaders, axis=0))
        place.sort()
        return not np.count_nonzero(place[1:] - place[:-1] <= reach)


def has_near_points(points: FloatArray, reach: float) -> bool:
    """Whether two unequal points (N, 3) may be at most `reach` apart, judged by projections."""
    place = _project(points)
    order = place.argsort()
    rows, place = points.take(order, axis=0), place.take(order)
    differ = np.logical_or.reduce(rows[1:] != rows[:-1], axis=1)
    return bool((differ & (place[1:] - place[:-1] <= reach)).any())


def find_possible_neighbours(points: FloatArray, reach: float) -> Ints:
    """Rows (n,) of points (N, 3) that may be within `reach` of another point, by projections.

    All other points are certainly further than `reach` from every other point.
    """
    place = _project(points)
    order = place.argsort()
    place = place.take(order)
    largest = float(np.abs(points).max(initial=0.0))
    near = place[1:] - place[:-1] <= reach + PROJECTION_ROUNDING * largest
    rows: Ints = order[np.append(near, False) | np.append(False, near)]
    return rows


def _project(points: FloatArray) -> FloatArray:
    """Projections of points (N, 3) to one direction, (N,)."""
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

    `knot_ratio` is the value of `find_knot_ratio`.
    """
    if not tolerance:
        return 0.0
    rounding = max(COORDINATE_ROUNDING * largest_coordinate, KNOT_ROUNDING * knot_ratio * diagonal)
    return max(tolerance * diagonal, min(rounding, MAX_WELD_TOLERANCE * diagonal))


def find_projected_distance(model: PatchModel, tolerance: float) -> float:
    """The largest distance of projections of points that count as one; 0 if the tolerance is 0."""
    if not tolerance:
        return 0.0
    largest = find_largest_coordinate(model)
    distance = weld_distance(model.diagonal, largest, find_knot_ratio(model), tolerance)
    return distance + PROJECTION_ROUNDING * largest


def find_weight_tolerance(model: PatchModel, tolerance: float) -> float:
    """The largest difference of logarithms of weights that count as one; 0 if the tolerance is 0.

    A change by h moves no point of a patch further than h / 2 times the diagonal of its box: in the
    largest patch, by `COARSER` / 2 times the distance of points that count as one.
    """
    if not tolerance:
        return 0.0
    extent = model.largest_patch
    return COARSER * find_weld_distance(model, tolerance) / extent if extent else tolerance


def find_knot_ratio(model: PatchModel) -> float:
    """The largest knot of all surfaces in units of the range of its knot vector; at least 1."""
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
