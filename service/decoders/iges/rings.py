"""Closed curves that agree as a whole, but begin at different points.

A ring is a closed side. If it is alone in its loop, it may begin anywhere, so the loop can take the
curve of another face in its place.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.iges.distances import bound_distance
from service.decoders.iges.points import find_clusters
from service.decoders.iges.shapes import sample

SAMPLES = 65
"""Points on a ring."""

NEAR = 1e-4
"""Centers of one ring, from other samples of it, differ by less than this share of the largest
ring's size."""

MOST_TRIED = 16
"""The most rings about one center with which a ring is compared."""


@dataclass(frozen=True, slots=True)
class Match:
    """Two rings that are one: the one that is left out, and the one that stays."""

    moved: int
    kept: int
    is_opposite: bool
    distance: float


def match_rings(
    curves: Sequence[Curve], is_movable: Sequence[bool], tolerance: float
) -> list[Match]:
    """Pairs of rings that are nowhere further apart than the tolerance; one of each is movable."""
    if len(curves) < 2:
        return []
    points = np.array([sample(curve, SAMPLES) for curve in curves])
    centers = _find_centers(points)
    size = float(np.ptp(points, axis=1).max())
    clusters = find_clusters(centers, max(tolerance, NEAR * size)).tolist()
    waiting: dict[int, list[int]] = defaultdict(list)
    matches = []
    for number, cluster in enumerate(clusters):
        tried = waiting[cluster][-MOST_TRIED:]
        for place, other in enumerate(tried):
            if not (is_movable[number] or is_movable[other]):
                continue
            distance = bound_distance(curves[other], curves[number], False, tolerance)
            if distance <= tolerance:
                del waiting[cluster][place - len(tried)]
                pair = (number, other) if is_movable[number] else (other, number)
                is_opposite = _find_area(points[other]) @ _find_area(points[number]) < 0
                matches.append(Match(*pair, bool(is_opposite), distance))
                break
        else:
            waiting[cluster].append(number)
    return matches


def _find_centers(points: FloatArray) -> FloatArray:
    """Centers of gravity (n, 3) of closed polygons (n, k, 3)."""
    lengths = np.sqrt(np.square(np.diff(points, axis=1)).sum(axis=2))[..., np.newaxis]
    middles = (points[:, 1:] + points[:, :-1]) / 2
    centers: FloatArray = (middles * lengths).sum(axis=1) / lengths.sum(axis=1)
    return centers


def _find_area(points: FloatArray) -> FloatArray:
    """The vector of the area of a closed polygon (k, 3); it has the direction of a normal."""
    rest = points - points[0]
    area: FloatArray = np.cross(rest[:-1], rest[1:]).sum(axis=0) / 2
    return area
