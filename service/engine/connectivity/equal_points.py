"""Finds points that are equal bit for bit, and the distance within which points count as one.

Connectivity compares points bit for bit; before that, `service.engine.joining` makes near points
equal: those that are at most the weld distance apart (`MeshOptions.weld_tolerance`). This distance
allows for the rounding of

- a coordinate x, some 2^-53 |x|; and
- a knot t, some 2^-53 |t|: while the parameter runs over the knot vector, of length r, a point
  moves by a few diagonals D, so this error moves it by some 2^-53 |t| D / r.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints
from service.bases.row_batches import unique_rows
from service.engine.options import MAX_WELD_TOLERANCE
from service.surface.lowered import PatchModel

COORDINATE_ROUNDING = 2.0**-50
"""The error of a coordinate after eight roundings, relative to the largest coordinate: a rotation
and a translation in float64 round at most eight times."""

KNOT_ROUNDING = 2.0**-48
"""The error of a point after a few roundings of a knot, in diagonals, relative to the result of
`find_knot_ratio`."""

PROJECTION_ROUNDING = 2.0**-49
"""The rounding error of the projections of two points onto a direction, relative to the largest
coordinate."""

WEIGHT_FACTOR = 4.0
"""The factor from the tolerance of points to the tolerance of weights. Both points and weights
change across a narrow patch, weights sometimes faster; its long sides are one edge only if points
and weights count as equal."""

FEW_POINTS = 40
"""Up to this number of points, a dictionary finds equal points faster than sorting does."""

DIRECTION = (0.5411961001461969, 0.7653668647301796, 0.3477591)
"""A direction in which different points of a model rarely have equal projections, unlike an
axis. Its length is 0.9998: projections are never further apart than their points."""


def find_equal_points(points: FloatArray) -> Ints:
    """For each point (N, 3), the number of the first point that is equal to it bit for bit, (N,).

    All parts of the engine use this function, so that they agree on equality.
    """
    if len(points) <= FEW_POINTS:
        return np.array(find_first_equals(points), np.intp)
    leaders, number = unique_rows(points)
    return leaders[number]


def find_first_equals(points: FloatArray) -> tuple[int, ...]:
    """The result of `find_equal_points` as a tuple; it is fast for few points."""
    first: dict[tuple[float, ...], int] = {}
    return tuple([first.setdefault(tuple(p), k) for k, p in enumerate(points.tolist())])


@dataclass(frozen=True, eq=False, slots=True)
class EqualPoints:
    """A result of `find_equal_points`, for comparison with other points.

    `number` (N,) is that result. `leaders` (L,) are the points that differ from all points before
    them. Both are kept for long, so they have 32 bits.
    """

    number: IndexArray
    leaders: IndexArray

    @staticmethod
    def from_numbers(number: Ints) -> "EqualPoints":
        """The equal points of a result of `find_equal_points`."""
        leaders = np.flatnonzero(number == np.arange(len(number)))
        return EqualPoints(number.astype(np.uint32), leaders.astype(np.uint32))

    def fits(self, points: FloatArray, reach: float) -> bool:
        """Whether `points` (N, 3) have these equal points, and unequal points are not near.

        Two points are near if their distance is at most `reach`. The result is False if this is
        uncertain: two leaders are certainly not near if their projections onto `DIRECTION` are
        further apart than `reach`. The caller adds the rounding of projections to `reach`
        (`find_projected_distance`).
        """
        equal = points.take(self.number, axis=0) == points
        if np.count_nonzero(equal) < equal.size:
            return False
        projection = _project(points.take(self.leaders, axis=0))
        projection.sort()
        return not np.count_nonzero(projection[1:] - projection[:-1] <= reach)


def has_near_points(points: FloatArray, reach: float) -> bool:
    """Whether two unequal points (N, 3) may be at most `reach` apart, by comparing projections.

    The caller adds the rounding of projections to `reach` (`find_projected_distance`).
    """
    projection = _project(points)
    order = projection.argsort()
    rows, projection = points.take(order, axis=0), projection.take(order)
    is_unequal = np.logical_or.reduce(rows[1:] != rows[:-1], axis=1)
    return bool((is_unequal & (projection[1:] - projection[:-1] <= reach)).any())


def find_possible_neighbours(points: FloatArray, reach: float) -> Ints:
    """Numbers (n,) of the points (N, 3) that may be within `reach` of another point.

    All other points are certainly further than `reach` from every point, because their projections
    are further apart.
    """
    projection = _project(points)
    order = projection.argsort()
    projection = projection.take(order)
    largest = float(np.abs(points).max(initial=0.0))
    is_near = projection[1:] - projection[:-1] <= reach + PROJECTION_ROUNDING * largest
    rows: Ints = order[np.append(is_near, False) | np.append(False, is_near)]
    return rows


def _project(points: FloatArray) -> FloatArray:
    """The projections of points (N, 3) onto `DIRECTION`, (N,)."""
    x, y, z = points.T
    projection: FloatArray = x * DIRECTION[0]
    projection += y * DIRECTION[1]
    projection += z * DIRECTION[2]
    return projection


def find_weld_distance(model: PatchModel, tolerance: float) -> float:
    """The largest distance of points that count as one, in model units; 0 if the tolerance is 0."""
    largest = _find_largest_coordinate(model)
    return compute_weld_distance(model.diagonal, largest, find_knot_ratio(model), tolerance)


def compute_weld_distance(
    diagonal: float, largest_coordinate: float, knot_ratio: float, tolerance: float
) -> float:
    """The result of `find_weld_distance` for a model with this diagonal and largest coordinate.

    `knot_ratio` is the result of `find_knot_ratio`.
    """
    if not tolerance:
        return 0.0
    rounding = max(COORDINATE_ROUNDING * largest_coordinate, KNOT_ROUNDING * knot_ratio * diagonal)
    return max(tolerance * diagonal, min(rounding, MAX_WELD_TOLERANCE * diagonal))


def find_projected_distance(model: PatchModel, tolerance: float) -> float:
    """The largest distance of projections of points that count as one; 0 if the tolerance is 0."""
    if not tolerance:
        return 0.0
    largest = _find_largest_coordinate(model)
    distance = compute_weld_distance(model.diagonal, largest, find_knot_ratio(model), tolerance)
    return distance + PROJECTION_ROUNDING * largest


def find_weight_tolerance(model: PatchModel, tolerance: float) -> float:
    """The largest difference of logarithms of weights that count as one; 0 if the tolerance is 0.

    If the logarithms of weights change by at most h, no point of a patch moves further than h / 2
    times the diagonal of its box. So in the largest patch, no point moves further than
    `WEIGHT_FACTOR` / 2 times the weld distance.
    """
    if not tolerance:
        return 0.0
    largest_diagonal = model.largest_patch
    if not largest_diagonal:  # all patches are points, which do not move
        return tolerance
    return WEIGHT_FACTOR * find_weld_distance(model, tolerance) / largest_diagonal


def find_knot_ratio(model: PatchModel) -> float:
    """The largest ratio of a knot's absolute value to the length of its knot vector; at least 1."""
    ratio = 1.0
    for domain in model.domains:
        for knots in (domain.u, domain.v):
            low, high = knots.item(0), knots.item(-1)
            if max(-low, high) > ratio * (high - low):
                ratio = max(-low, high) / (high - low)
    return ratio


def _find_largest_coordinate(model: PatchModel) -> float:
    """The largest coordinate of all control points, in absolute value."""
    return max([max(-min(low), *high) for low, high in (b.box for b in model.batches)])
