"""Edges of thin failing triangles are exchanged for the other diagonal.

Two triangles at an edge are a quadrangle. The longest edge of a thin triangle is replaced by the
other diagonal of its quadrangle if both new triangles are thicker. Triangles within few units of
places are exchanged always, because their longest edge cannot be cut.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import unique_values
from service.engine.brep.borders.predicates import orient
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.triangles import Mates, Triangles, join_ends
from service.engine.vectors import NEXT, cross, dot, length

LOW = 4.0
"""Triangles lower than this many tolerances are thin."""

BETTER = 1.2
"""The lower one of the new triangles must be higher by this factor."""

UNITS = 4
"""A triangle this many units of places high cannot be cut well."""


def flip_edges(
    corners: FaceCorners, triangles: Triangles, mates: Mates, rows: Ints, tolerance: float
) -> tuple[Triangles, Ints]:
    """The triangles after flips, and those that were flipped.

    `rows` (m,) are failing triangles; the worst have precedence. A triangle takes part in one flip.
    """
    none = triangles, np.empty(0, np.intp)
    rows = rows[np.argsort(-triangles.bounds[rows], kind="stable")]
    own = triangles.corners.take(rows, axis=1)
    vertices = corners.positions[corners.points[own]]
    along = vertices[NEXT] - vertices
    edge = dot(along, along, -1).argmax(axis=0)
    fixed = corners.find_fixed(own)[edge, np.arange(len(rows))]
    mate = mates.edges[edge * len(triangles) + rows]
    chosen = ((mate >= 0) & ~fixed).nonzero()[0]
    if not len(chosen):
        return none
    rows, edge, mate = rows[chosen], edge[chosen], mate[chosen]
    other = mate % len(triangles)
    a, b = triangles.corners[edge, rows], triangles.corners[NEXT[edge], rows]
    c = triangles.corners[NEXT[NEXT[edge]], rows]
    d = triangles.corners[:, other].sum(axis=0) - a - b
    is_better = _is_better(corners, (a, b, c, d), tolerance)
    # No second edge between two corners, and none between two corners at one point.
    is_better &= (corners.points[c] != corners.points[d]) & ~mates.has_edges(join_ends(c, d))
    best = is_better.nonzero()[0]
    best = best[_choose_apart(rows[best], other[best], len(triangles))]
    best = best[unique_values(join_ends(c[best], d[best]))[0]]
    if not len(best):
        return none
    flipped = triangles.corners.copy()
    flipped[:, rows[best]] = np.array([a, d, c])[:, best]
    flipped[:, other[best]] = np.array([d, b, c])[:, best]
    is_changed, is_wide = triangles.is_changed.copy(), triangles.is_wide.copy()
    both = np.concatenate([rows[best], other[best]])
    is_changed[both], is_wide[both] = True, False
    return (
        replace(triangles, corners=flipped, is_changed=is_changed, is_wide=is_wide),
        both,
    )


def _is_better(
    corners: FaceCorners, ends: tuple[Ints, Ints, Ints, Ints], tolerance: float
) -> Bools:
    """Whether a diagonal c d is better than a b, for triangles a b c and b a d."""
    a, b, c, d = (corners.places[each] for each in ends)
    long = np.maximum(np.abs(b - a), np.abs(d - c)).max(axis=1)
    is_convex = (orient(a, d, c) > UNITS * long) & (orient(d, b, c) > UNITS * long)
    is_cap = orient(a, b, c) <= UNITS * np.abs(b - a).max(axis=1)
    p, q, r, s = (corners.positions[corners.points[each]] for each in ends)
    height = _measure_heights(p, q, r)
    before = np.minimum(height, _measure_heights(q, p, s))
    after = np.minimum(_measure_heights(p, s, r), _measure_heights(s, q, r))
    better: Bools = is_convex & (is_cap | ((height < LOW * tolerance) & (after > BETTER * before)))
    return better


def _measure_heights(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Heights (m,) of triangles of points (m, 3) over their longest edges."""
    edges = np.array([b - a, c - b, a - c])
    areas = length(cross(edges[0], edges[1], -1), -1)
    longest = np.sqrt(dot(edges, edges, -1).max(axis=0))
    heights: FloatArray = areas / np.where(longest > 0, longest, 1.0)
    return heights


def _choose_apart(one: Ints, other: Ints, count: int) -> Bools:
    """Which pairs of triangles share none with an earlier pair that they share one with."""
    order = np.arange(len(one))
    first = np.full(count, len(one))
    np.minimum.at(first, one, order)
    np.minimum.at(first, other, order)
    chosen: Bools = (first[one] == order) & (first[other] == order)
    return chosen
