"""A closer look at parts of the surface that are not proved to be near their own triangles.

Where parameters run wild, the surface over a triangle of places is near the mesh, but beside the
triangle that has those corners. So such a part is cut into four, and four again, at the middles of
its edges, and each piece is certified against the triangle that it is nearest to, of those around.
As the pieces shrink, what is proved of them comes down to their distances from those triangles.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.faces import SPAN
from service.engine.adaptive.polygons.outlines import Outline
from service.engine.adaptive.polygons.triangles import Triangles
from service.engine.adaptive.proof.certificate import Parts, certify
from service.engine.adaptive.vectors import Vectors, cross, dot

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

NEAREST = 1.0 + 2.0**-30
"""A triangle is no nearer than another if it is not so by this factor: the first one is taken."""


def looked_closer(
    task: Task, outline: Outline, triangles: Triangles, positions: FloatArray, rows: Ints
) -> tuple[FloatArray, Bools]:
    """Bounds of parts, and whether they are near enough, looked at closely.

    Parameters
    ----------
    positions : ndarray of float64, shape (V, 3)
        Of the vertices, as they are stored.
    rows : ndarray of int, shape (m,)
        The triangles of places whose surface is meant.
    """
    deviation, fails = np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)
    corners = triangles.corners[rows]
    places = np.stack([outline.u[corners], outline.v[corners]], axis=2)
    face, host = outline.face[corners[:, 0]], triangles.host[rows]
    base = triangles.base[rows]
    part = np.arange(len(rows))
    for _ in range(LEVELS):
        # Whole pieces of one patch, whose middles are places: nothing is lost between them.
        first = places.min(axis=1) // SPAN
        whole = (places.max(axis=1) <= (first + 1) * SPAN).all(axis=1)
        even = (QUARTERS.reshape(12, 3) @ places % 2 == 0).all(axis=(1, 2))
        fails[part[~(whole & even)]] = True
        places, face, host, base, part = _those(~fails[part], places, face, host, base, part)
        places = (QUARTERS[np.newaxis] @ places[:, np.newaxis] // 2).reshape(-1, 3, 2)
        face, host, base, part = (np.repeat(values, 4) for values in (face, host, base, part))
        host, away = _nearest(task, triangles, outline, positions, (face, places, host, base))
        # What is too far away already, at some point, needs no proof.
        fails[part[away > task.goal.tolerance]] = True
        places, face, host, base, part = _those(~fails[part], places, face, host, base, part)
        parts = Parts(
            face,
            places,
            outline.vertex[triangles.corners[host]],
            triangles.across[host],
            np.zeros(len(face), dtype=bool),
        )
        task.budget.spend(task.certifying(face, places))
        found = certify(task.ground, task.faces, parts, positions, task.goal)
        passed = found.deviation <= found.allowed
        np.maximum.at(deviation, part[passed], found.deviation[passed])
        places, face, host, base, part = _those(~passed, places, face, host, base, part)
        if not len(part):
            break
    fails[part] = True
    return deviation, ~fails


def _those(here: Bools, *columns: Ints) -> Iterator[Ints]:
    return (column[here] for column in columns)


def _nearest(
    task: Task,
    triangles: Triangles,
    outline: Outline,
    positions: FloatArray,
    pieces: tuple[Ints, Ints, Ints, Ints],
) -> tuple[Ints, FloatArray]:
    """The triangle to which pieces are nearest: the hosts, what is around them, and the bases.

    Judged by four points of each piece, and how far the farthest of them is.
    """
    face, places, host, base = pieces
    around = triangles.beside[host]
    beyond = np.where(around[:, :, np.newaxis] >= 0, triangles.beside[around], -1)
    others = np.concatenate([around, base[:, np.newaxis], beyond.reshape(-1, 9)], axis=1)
    # What is not there is replaced by what is.
    mine = np.where(others >= 0, others, host[:, np.newaxis]).T
    # In quarters of a unit the middle of a piece is a place, or as near to one as matters here.
    middle = places.sum(axis=1, keepdims=True) // 3
    at = np.concatenate([places, middle], axis=1)
    count, many = at.shape[:2]
    points = task.positions(np.repeat(face, many), at[..., 0].ravel(), at[..., 1].ravel())
    points = np.ascontiguousarray(points.reshape(count, many, 3).transpose(2, 1, 0))
    best = host
    least = _farthest(points, _corners(triangles, outline, positions, host))
    for other in mine:
        away = _farthest(points, _corners(triangles, outline, positions, other))
        nearer = away * NEAREST < least
        best, least = np.where(nearer, other, best), np.where(nearer, away, least)
    return best, least


def _corners(
    triangles: Triangles, outline: Outline, positions: FloatArray, rows: Ints
) -> FloatArray:
    """Corners of triangles: (3, 3, m), the second axis x, y, z."""
    found: FloatArray = positions[outline.vertex[triangles.corners[rows]]].transpose(1, 2, 0)
    return found


def _farthest(points: FloatArray, corners: FloatArray) -> FloatArray:
    """The greatest distance of points (3, k, m) from triangles (3, 3, m): (m,)."""
    a, b, c = (corner[:, np.newaxis] for corner in corners)
    normal = cross(b - a, c - a)
    squares = np.minimum(
        np.minimum(_beside(points, a, b), _beside(points, b, c)), _beside(points, c, a)
    )
    inside = np.ones(points.shape[1:], dtype=bool)
    for begin, end in ((a, b), (b, c), (c, a)):
        inside &= dot(cross(normal, end - begin), points - begin) > 0.0
    size = dot(normal, normal)
    height = dot(points - a, normal)
    above = height * height / np.where(size > 0.0, size, 1.0)
    farthest: FloatArray = np.sqrt(np.where(inside, above, squares).max(axis=0))
    return farthest


def _beside(points: Vectors, begin: Vectors, end: Vectors) -> FloatArray:
    """Squared distances of points from segments."""
    along, away = end - begin, points - begin
    size = dot(along, along)
    share = np.clip(dot(away, along) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    rest = away - share * along
    return dot(rest, rest)
