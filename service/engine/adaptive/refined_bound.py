"""A closer look at parts of the surface that are not proved to be near their own triangles.

Where parameters run wild, the surface over a triangle of places is near the mesh, but beside the
triangle that has those corners. So such a part is cut into four, and four again, at the middles of
its edges, and each piece is certified against the triangle that it is nearest to, of those around.
As the pieces shrink, what is proved of them comes down to their distances from those triangles.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.chunks import chunks
from service.engine.adaptive.draft import Draft
from service.engine.bounds.certificate import Parts, certify
from service.engine.bounds.faces import SPAN
from service.engine.bounds.vectors import cross, dot

LEVELS = 3
"""How often parts are cut in four."""

QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
)
"""Corners of the four quarters of a triangle: shares of its own, in halves."""

CHUNK = 1 << 13
"""Triangles that pieces are compared with at a time."""

NEAREST = 1.0 + 2.0**-30
"""A triangle is no nearer than another if it is not so by this factor: the first one is taken."""


def looked_closer(draft: Draft, rows: Ints) -> tuple[FloatArray, Bools]:
    """Bounds of parts, and whether they are near enough, looked at closely.

    Parameters
    ----------
    rows : ndarray of int, shape (m,)
        The triangles of places whose surface is meant.
    """
    task = draft.task
    deviation, fails = np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)
    corners = draft.corners[rows]
    places = np.stack([draft.u[corners], draft.v[corners]], axis=2)
    face, host = draft.face[corners[:, 0]], draft.host[rows]
    base = draft.base[rows]
    part = np.arange(len(rows))
    for _ in range(LEVELS):
        # Whole pieces of one patch, whose middles are places: nothing is lost between them.
        first = places.min(axis=1) // SPAN
        whole = (places.max(axis=1) <= (first + 1) * SPAN).all(axis=1)
        even = (QUARTERS.reshape(12, 3) @ places % 2 == 0).all(axis=(1, 2))
        fails[part[~(whole & even)]] = True
        places, face, host, base, part = _those(~fails[part], places, face, host, base, part)
        if not len(part):
            break
        places = (QUARTERS[np.newaxis] @ places[:, np.newaxis] // 2).reshape(-1, 3, 2)
        face, host, base, part = (np.repeat(values, 4) for values in (face, host, base, part))
        host, away = _nearest(draft, face, places, candidates(draft, host, base))
        # What is too far away already, at some point, needs no proof.
        fails[part[away > task.goal.tolerance]] = True
        places, face, host, base, part = _those(~fails[part], places, face, host, base, part)
        if not len(part):
            break
        parts = Parts(
            face,
            places,
            draft.vertices[host],
            draft.across[host],
            np.zeros(len(face), dtype=bool),
        )
        task.budget.spend(task.certifying(face, places))
        found = certify(task.ground, task.faces, parts, draft.positions, task.goal)
        passed = found.deviation <= found.allowed
        np.maximum.at(deviation, part[passed], found.deviation[passed])
        places, face, host, base, part = _those(~passed, places, face, host, base, part)
        if not len(part):
            break
    fails[part] = True
    return deviation, ~fails


def _those(here: Bools, *columns: Ints) -> Iterator[Ints]:
    return (column[here] for column in columns)


def candidates(draft: Draft, host: Ints, base: Ints) -> Ints:
    """ReferenceTriangles, what is around them, and bases: (14, m); hosts where there is nothing."""
    around = draft.beside[host]
    beyond = np.where(around[..., np.newaxis] >= 0, draft.beside[around], -1)
    others = np.concatenate(
        [host[:, np.newaxis], around, base[:, np.newaxis], beyond.reshape(-1, 9)], axis=1
    )
    found: Ints = np.where(others >= 0, others, host[:, np.newaxis]).T
    return found


def _nearest(draft: Draft, face: Ints, places: Ints, others: Ints) -> tuple[Ints, FloatArray]:
    """The triangle to which pieces are nearest, of all candidates: the first one of equal ones.

    Judged by four points of each piece, and how far the farthest of them is.
    """
    # In quarters of a unit the middle of a piece is a place, or as near to one as matters here.
    middle = places.sum(axis=1, keepdims=True) // 3
    at = np.concatenate([places, middle], axis=1)
    count, many = at.shape[:2]
    points = draft.task.positions(np.repeat(face, many), at[..., 0].ravel(), at[..., 1].ravel())
    points = np.ascontiguousarray(points.reshape(count, many, 3).transpose(2, 1, 0))
    best, least = np.empty(count, dtype=np.intp), np.empty(count)
    for rows in chunks(count, len(others), CHUNK):
        some = others[:, rows]
        corners = draft.positions[draft.vertices[some]].transpose(2, 3, 0, 1)
        away = _farthest(points[:, :, np.newaxis, rows], np.ascontiguousarray(corners))
        nearest = away.min(axis=0)
        chosen = (away <= nearest * NEAREST).argmax(axis=0)
        best[rows] = some[chosen, np.arange(some.shape[1])]
        least[rows] = nearest
    return best, least


def _farthest(points: FloatArray, corners: FloatArray) -> FloatArray:
    """The greatest distance of points (3, k, 1, m) from triangles (3, 3, c, m): (c, m)."""
    ends = corners[[1, 2, 0]]
    sides = ends - corners
    normal = cross(sides[0], -sides[2])
    # Outwards from each edge in the plane of the triangle.
    inward = np.array([cross(normal, side) for side in sides])[:, :, np.newaxis]
    corners, sides = corners[:, :, np.newaxis], sides[:, :, np.newaxis]
    away = points - corners
    inside = (_dot(inward, away) > 0.0).all(axis=0)
    size = _dot(sides, sides)
    share = _dot(away, sides) / np.where(size > 0.0, size, 1.0)
    away -= np.clip(share, 0.0, 1.0)[:, np.newaxis] * sides
    squares = _dot(away, away).min(axis=0)
    flat = dot(normal, normal)
    height = dot(points - corners[0], normal[:, np.newaxis])
    above = height * height / np.where(flat > 0.0, flat, 1.0)
    farthest: FloatArray = np.sqrt(np.where(inside, above, squares).max(axis=0))
    return farthest


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of vectors (3, 3, …), the second axis x, y, z."""
    product: FloatArray = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
    return product
