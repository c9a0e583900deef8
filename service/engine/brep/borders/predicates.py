"""Exact tests of places: sides of lines, crossings and touchings of segments.

Coordinates are whole numbers from 0 to 2^30, so products of differences are at most 2^60 and their
differences at most 2^61: int64 holds them exactly.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.vectors import Items


def orient(a: Ints, b: Ints, c: Ints) -> Ints:
    """Twice the signed areas (m,) of triangles of places (m, 2): positive if c is left of a → b."""
    to_b, to_c = b - a, c - a
    area: Ints = to_b[..., 0] * to_c[..., 1] - to_b[..., 1] * to_c[..., 0]
    return area


@dataclass(frozen=True, eq=False, slots=True)
class Segments(Items):
    """m segments between places, with the vertices of the mesh at their ends.

    Attributes
    ----------
    begins, ends : ndarray of int, shape (2, m)
        Places.
    begin_vertices, end_vertices : ndarray of int, shape (m,)
    """

    begins: Ints
    ends: Ints
    begin_vertices: Ints
    end_vertices: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Meetings(Items):
    """How pairs of segments meet, other than at a place and vertex that is an end of both.

    Attributes
    ----------
    crosses : ndarray of bool, shape (m,)
        Whether the two cross at a point inside both.
    touches : ndarray of bool, shape (4, m)
        Whether the beginning of the first, its end, the beginning of the second, or its end touches
        the other segment: it lies inside it, or at its end though the vertices there are two. Both
        ends of the first touch the second if the two are equal, also in direction.
    """

    crosses: Bools
    touches: Bools


def classify_pairs(first: Segments, second: Segments) -> Meetings:
    """How the segments of m pairs, each of one face, meet."""
    a, b, c, d = first.begins.T, first.ends.T, second.begins.T, second.ends.T
    sides = np.array([orient(c, d, a), orient(c, d, b), orient(a, b, c), orient(a, b, d)])
    signs = np.sign(sides)
    crosses = (signs[0] * signs[1] < 0) & (signs[2] * signs[3] < 0)
    touches = np.empty((4, len(crosses)), bool)
    rows = (signs == 0).any(axis=0).nonzero()[0]
    touches[:] = False
    if len(rows):
        near_first, near_second = first.take(rows), second.take(rows)
        flat = signs[:, rows] == 0
        touches[:2, rows] = _find_touches(near_first, near_second) & flat[:2]
        touches[2:, rows] = _find_touches(near_second, near_first) & flat[2:]
        equal = ((first.begins == second.begins) & (first.ends == second.ends)).all(axis=0)
        touches[:2] |= equal & (first.begins != first.ends).any(axis=0)
    return Meetings(crosses, touches)


def _find_touches(first: Segments, second: Segments) -> Bools:
    """Whether the ends of the first segments, (2, m), touch the second ones, if on their lines."""
    low = np.minimum(second.begins, second.ends)
    high = np.maximum(second.begins, second.ends)
    touches = np.empty((2, low.shape[1]), bool)
    for row, (places, vertices) in enumerate(
        ((first.begins, first.begin_vertices), (first.ends, first.end_vertices))
    ):
        within = ((low <= places) & (places <= high)).all(axis=0)
        at_begin = (places == second.begins).all(axis=0)
        at_end = (places == second.ends).all(axis=0)
        same = at_begin & (vertices == second.begin_vertices)
        same |= at_end & (vertices == second.end_vertices)
        touches[row] = within & ~same
    return touches
