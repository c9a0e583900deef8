"""Points of a surface in a plane, by a search on two families of curves.

A surface is given as sheets (`oracles.sheets`), its tensor-product and triangular parts. If
two neighbouring samples of a curve are on different sides of the plane, bisection computes a point
between them in the plane.
"""

from collections.abc import Sequence

import numpy as np

from oracles.sheets import Array, Sheet, TriangleSheet
from service.engine.sections.values import Section

HALVINGS = 50
"""Steps of bisection: 2⁻⁵⁰ of the distance between two samples is near the rounding of a float."""


def find_crossings(sheets: Sequence[Sheet], normal: Array, offset: float, count: int = 60) -> Array:
    """Points (m, 3) of all sheets in the plane {x: normal · x = offset}.

    Each sheet is searched on `count` + 1 curves of each of two families. They are the isoparametric
    curves along v and along u; on a triangle over (s, t), they are the lines with s constant, and
    the lines through the corner (1, 0).
    """
    result = [_find_sheet_crossings(sheet, normal, offset, count) for sheet in sheets]
    return np.concatenate(result)


def _find_sheet_crossings(sheet: Sheet, normal: Array, offset: float, count: int) -> Array:
    if isinstance(sheet, TriangleSheet):
        low, high = np.zeros(2), np.ones(2)
    else:  # places far outside are moved to the corners of the rectangular domain
        low, high = sheet.clip_to_domain(np.array([[-1e9, -1e9], [1e9, 1e9]]))
    t = np.linspace(0, 1, count + 1)
    u, v = np.meshgrid(t, t, indexing="ij")
    if isinstance(sheet, TriangleSheet):
        v = (1 - u) * v
    places = np.stack([low[0] + u * (high - low)[0], low[1] + v * (high - low)[1]], axis=-1)

    def measure_height(places: Array) -> Array:
        return (sheet.at(places) + sheet.origin) @ normal - offset

    is_above = measure_height(places.reshape(-1, 2)).reshape(u.shape) >= 0
    pairs = []
    # Neighbours along u, then neighbours along v.
    for first, second in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        has_crossing = is_above[first] != is_above[second]
        begin, end = places[first][has_crossing], places[second][has_crossing]
        begins_above = is_above[first][has_crossing][:, None]
        pairs.append((np.where(begins_above, end, begin), np.where(begins_above, begin, end)))
    below, above = (np.concatenate(each) for each in zip(*pairs, strict=True))
    if not len(below):
        return np.zeros((0, 3))
    for _ in range(HALVINGS):
        middle = (below + above) / 2
        is_middle_above = (measure_height(middle) >= 0)[:, np.newaxis]
        below = np.where(is_middle_above, below, middle)
        above = np.where(is_middle_above, middle, above)
    return np.asarray(sheet.at(above) + sheet.origin)


def measure_distances(section: Section, points: Array) -> Array:
    """Distances (m,) of points to the polylines of a section; infinite if it has no polylines."""
    best = np.full(len(points), np.inf)
    for line in section.polylines:
        for a, b in zip(line.points[:-1], line.points[1:], strict=True):
            along = b - a
            t = np.clip((points - a) @ along / max(along @ along, 1e-300), 0, 1)
            np.minimum(best, np.linalg.norm(points - a - t[:, None] * along, axis=1), out=best)
    return best
