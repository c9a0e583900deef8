"""How the loops of a face run around its material, by polygons in the parameters of its surface.

Material is on the left of a loop: an outer loop runs counter-clockwise, others clockwise. On a
closed surface a loop may also run around the surface.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import project_points
from service.decoders.iges.feet import find_feet, find_periods
from service.decoders.iges.shapes import sample
from service.decoders.iges.sides import Side

SAMPLES = 17
"""Points on a side."""


def draw_polygon(surface: Surface, sides: Sequence[Side]) -> tuple[FloatArray, float]:
    """A polygon of parameters along a loop, without jumps at the seams of a closed surface.

    Returns
    -------
    polygon : ndarray of float64, shape (k, 2)
        The last point is the first one, or on a closed surface away from it by whole periods.
    gap : float
        The largest distance of the sides from the surface that was found.
    """
    known = [_sample_corners(side.pcurve) for side in sides if side.pcurve is not None]
    if len(known) == len(sides):
        polygon = np.concatenate([*(points[:-1] for points in known), known[-1][-1:]])
        return polygon, max(side.gap for side in sides)
    points = [sample(side.curve, SAMPLES) for side in sides if side.curve is not None]
    feet, distances = find_feet(
        surface, np.concatenate([*(each[:-1] for each in points), points[-1][-1:]])
    )
    return _unwrap(feet, find_periods(surface)), float(distances.max())


def find_turned_loops(
    surface: Surface, polygons: Sequence[FloatArray], has_outer: bool
) -> list[bool]:
    """For each loop whether it runs the wrong way.

    If no loop runs around the surface, the one with the largest area is the outer loop: it
    surrounds the others, whatever the file says.

    Parameters
    ----------
    has_outer : bool
        Whether there is an outer loop; a surface without borders may have none.
    """
    windings = _count_all_turns(surface, polygons)
    areas = [measure_area(polygon) for polygon in polygons]
    outer = None
    if has_outer and polygons and not any(map(any, windings)):
        outer = max(range(len(areas)), key=lambda number: abs(areas[number]))
    turned = [(area > 0) != (number == outer) for number, area in enumerate(areas)]
    for axis in range(2):
        around = [number for number, winding in enumerate(windings) if winding[axis]]
        if around:
            flags = _find_turned_rings(surface, polygons, windings, around, axis)
            for number, is_wrong in zip(around, flags, strict=True):
                turned[number] = is_wrong
    return turned


def close_polygons(surface: Surface, polygons: Sequence[FloatArray]) -> list[FloatArray]:
    """Closed polygons of a face from those of its loops, all of which run the right way.

    Two loops that run around a closed surface become one polygon with the seam between them; a
    single one ends at the pole on its left. A face without an outer loop gets the whole domain.
    """
    windings = _count_all_turns(surface, polygons)
    closed = [
        polygon for polygon, winding in zip(polygons, windings, strict=True) if not any(winding)
    ]
    rings = [polygon for polygon, winding in zip(polygons, windings, strict=True) if any(winding)]
    low, high = (np.array([knots[end] for knots in surface.knots]) for end in (0, -1))
    if len(rings) == 2:
        first, second = rings
        # The second ring runs back; it begins where the first one ends, but for whole periods.
        axis = int(np.abs(first[-1] - first[0]).argmax())
        shift = np.zeros(2)
        shift[axis] = first[-1, axis] - second[0, axis]
        return [np.concatenate([first, second + shift]), *closed]
    if len(rings) == 1:
        (ring,) = rings
        step = ring[-1] - ring[0]
        axis = int(np.abs(step).argmax())
        is_up = (step[axis] > 0) == (axis == 0)
        ends = ring[[-1, 0]].copy()
        ends[:, 1 - axis] = (high if is_up else low)[1 - axis]
        return [np.concatenate([ring, ends]), *closed]
    if not rings and not any(measure_area(polygon) > 0 for polygon in closed):
        u, v = np.stack([low, high]).T
        corners = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])]
        return [np.array(corners), *closed]
    return closed


def measure_area(polygon: FloatArray) -> float:
    """The signed area of a polygon (k, 2), positive if it runs counter-clockwise.

    The side from the last point to the first one, which are equal as a rule, adds nothing.
    """
    x, y = (polygon - polygon[0]).T
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum()) / 2


def _find_turned_rings(
    surface: Surface,
    polygons: Sequence[FloatArray],
    windings: Sequence[tuple[int, int]],
    around: Sequence[int],
    axis: int,
) -> list[bool]:
    """Which of the loops that run around a closed surface along an axis run the wrong way.

    Of two such loops the one at the lower values of the other parameter runs along u, or against v,
    and the other one the other way. A single one runs so that its material is on the side where
    the surface ends in a pole.
    """
    other = 1 - axis
    left = 1 if axis == 0 else -1  # the other parameter grows towards the left of +u, not of +v
    heights = [float(polygons[number][:, other].mean()) for number in around]
    if len(around) == 1:
        net = project_points(surface.points)
        size = float(np.ptp(net.reshape(-1, 3), axis=0).max())
        is_pole = [
            bool(np.ptp(net.take(end, axis=other), axis=0).max() <= 1e-9 * size) for end in (0, -1)
        ]
        if is_pole[0] == is_pole[1]:
            return [False]
        wanted = left if is_pole[1] else -left
        return [windings[around[0]][axis] != wanted]
    lowest = heights.index(min(heights))
    return [
        windings[number][axis] != (left if position == lowest else -left)
        for position, number in enumerate(around)
    ]


def _sample_corners(curve: Curve) -> FloatArray:
    """The corners of a curve of degree 1, or points along another curve."""
    return project_points(curve.points) if curve.degree == 1 else sample(curve, SAMPLES)


def _unwrap(points: FloatArray, periods: tuple[float, float]) -> FloatArray:
    """Parameters of points that follow each other, moved by whole periods so that none jumps."""
    result = points.copy()
    for axis, period in enumerate(periods):
        if period:
            result[:, axis] = np.unwrap(points[:, axis], period=period)
    return result


def _count_all_turns(surface: Surface, polygons: Sequence[FloatArray]) -> list[tuple[int, int]]:
    """How often each loop runs around a closed surface along each parameter."""
    periods = find_periods(surface)
    turns = []
    for polygon in polygons:
        step = polygon[-1] - polygon[0]
        u, v = (
            round(float(step[axis]) / period) if period else 0
            for axis, period in enumerate(periods)
        )
        turns.append((u, v))
    return turns
