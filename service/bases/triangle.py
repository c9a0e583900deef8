"""The order of the control points and samples of a triangle.

A triangle is stored row after row. Row m of a net of degree n has the n + 1 − m control points
b_ijk with k = m, in the order of ascending j. The first row is the side t = 0; the last row is one
corner. Samples at R divisions have the order of the control points of a net of degree R.
"""

from functools import lru_cache
from math import isqrt

import numpy as np

from service.bases.arrays import FloatArray, Ints


def count_points(degree: int) -> int:
    """(n+1)(n+2)/2: the number of control points of degree n, and of samples at n divisions."""
    return (degree + 1) * (degree + 2) // 2


def degree_or_none(count: int) -> int | None:
    """The degree of a net of `count` control points; None if no triangle has this count."""
    degree = (isqrt(8 * count + 1) - 3) // 2
    return degree if degree >= 0 and count_points(degree) == count else None


def degree_of(count: int) -> int:
    """The degree of a net of `count` control points.

    Raises
    ------
    ValueError
        No triangle has this count.
    """
    degree = degree_or_none(count)
    if degree is None:
        raise ValueError(f"{count} control points make no triangle")
    return degree


@lru_cache(maxsize=256)
def row_starts(degree: int) -> Ints:
    """The index of the first point of each row, then the number of all points.

    Shape (n+2,); read-only.
    """
    lengths = np.arange(degree + 1, -1, -1)
    starts = np.concatenate([[0], np.cumsum(lengths[:-1])]).astype(np.intp)
    starts.flags.writeable = False
    return starts


@lru_cache(maxsize=256)
def side_rows(degree: int) -> Ints:
    """The indices of the points along the sides s = 0, r = 0 and t = 0, each of them ascending.

    Shape (3, n+1); read-only.
    """
    first = row_starts(degree)[:-1]
    along = np.arange(degree + 1)
    rows = np.stack([first, first + degree - along, along])
    rows.flags.writeable = False
    return rows


def barycentric(divisions: int, first: int = 0, last: int | None = None) -> FloatArray:
    """The barycentric coordinates (r, s, t) of the samples `first` … `last` − 1 at R divisions.

    By default of all samples. Each number is the correctly rounded quotient; shape (m, 3).
    """
    starts = row_starts(divisions)
    index = np.arange(first, starts[-1] if last is None else last)
    row = np.searchsorted(starts, index, side="right") - 1
    place = index - starts[row]
    return np.stack([divisions - row - place, place, row], axis=1) / divisions
