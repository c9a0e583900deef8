"""The order of the control points and samples of a triangle.

A triangle is stored row after row. Row m of a net of degree n has the n + 1 − m control points
b_ijk with k = m, in the order of ascending j. In barycentric coordinates (r, s, t), the first row
is the side t = 0; the last row is the corner t = 1. Samples at R divisions have the order of the
control points of a net of degree R.
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

    With s = u (1 − v) and t = v, these are the sides u = 0, u = 1 and v = 0, in the order of the
    four sides of a patch. Shape (3, n+1); read-only.
    """
    row_firsts = row_starts(degree)[:-1]
    j = np.arange(degree + 1)
    rows = np.stack([row_firsts, row_firsts + degree - j, j])
    rows.flags.writeable = False
    return rows


def barycentric(divisions: int, begin: int = 0, end: int | None = None) -> FloatArray:
    """The barycentric coordinates (r, s, t) of the samples `begin` … `end` − 1 at R divisions.

    The default is all samples. Each number is a correctly rounded quotient; shape (m, 3).
    """
    starts = row_starts(divisions)
    index = np.arange(begin, starts[-1] if end is None else end)
    row = np.searchsorted(starts, index, side="right") - 1
    j = index - starts[row]
    return np.stack([divisions - row - j, j, row], axis=1) / divisions
