"""The order of the control points and samples of a triangle.

A triangle is a run of rows. Row m of a net of degree n holds the n+1−m control points with k = m,
i falling and j rising, so the first row is the side t = 0 and the last one a corner; the samples
at R divisions stand in the same order, as if R were a degree.
"""

from functools import lru_cache
from math import isqrt

import numpy as np

from service.bases.arrays import FloatArray, Ints


def size(degree: int) -> int:
    """Control points of a net of degree n, samples at n divisions: (n+1)(n+2)/2."""
    return (degree + 1) * (degree + 2) // 2


def degree_or_none(count: int) -> int | None:
    """The degree of a net of so many control points; None if no triangle has as many."""
    degree = (isqrt(8 * count + 1) - 3) // 2
    return degree if degree >= 0 and size(degree) == count else None


def degree_of(count: int) -> int:
    """The degree of a net of so many control points, which must be those of a triangle."""
    degree = degree_or_none(count)
    if degree is None:
        raise ValueError(f"{count} control points make no triangle")
    return degree


@lru_cache(maxsize=256)
def row_starts(degree: int) -> Ints:
    """Index at which each row begins, and where the last one ends: shape (n+2,); read-only."""
    lengths = np.arange(degree + 1, -1, -1)
    starts = np.concatenate([[0], np.cumsum(lengths[:-1])]).astype(np.intp)
    starts.flags.writeable = False
    return starts


@lru_cache(maxsize=256)
def side_rows(degree: int) -> Ints:
    """Indices along the sides s = 0, r = 0 and t = 0, each upwards: shape (3, n+1); read-only."""
    first = row_starts(degree)[:-1]
    along = np.arange(degree + 1)
    rows = np.stack([first, first + degree - along, along])
    rows.flags.writeable = False
    return rows


def barycentric(divisions: int, first: int = 0, last: int | None = None) -> FloatArray:
    """(r, s, t) of samples [first, last) at R divisions, each correctly rounded: shape (m, 3)."""
    starts = row_starts(divisions)
    index = np.arange(first, starts[-1] if last is None else last)
    row = np.searchsorted(starts, index, side="right") - 1
    place = index - starts[row]
    return np.stack([divisions - row - place, place, row], axis=1) / divisions
