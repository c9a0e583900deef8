"""Strips of triangles between the border of a patch and the next line of its grid.

If a neighbour divides a shared edge more finely, all four sides of the patch follow the edges: a
strip joins the samples of each side to the grid inside.
"""

from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Divisions: TypeAlias = tuple[int, int, int, int]
"""Numbers of divisions of the four sides."""


def build_strips(number: NDArray[np.intp], sides: Divisions) -> list[NDArray[np.intp]]:
    """Triangles (T, 3) beside each of the sides u = 0, u = 1, v = 0, v = 1, as local indices.

    Parameters
    ----------
    number : ndarray of int, shape (Ru+1, Rv+1)
        The indices of the grid; the indices of the extra samples of the sides follow, side by side.
    sides : tuple of int
        Divisions of the sides.
    """
    lines = (
        (number[0], number[1, 1:-1], False),
        (number[-1], number[-2, 1:-1], True),
        (number[:, 0], number[1:-1, 1], True),
        (number[:, -1], number[1:-1, -2], False),
    )
    first = number.size
    strips = []
    for (border, inner, turn), divisions in zip(lines, sides, strict=True):
        if divisions == len(border) - 1:
            outer = border
        else:
            between = np.arange(first, first + divisions - 1)
            outer = np.concatenate([border[:1], between, border[-1:]])
            first += divisions - 1
        strips.append(_strip(outer.tolist(), inner.tolist(), len(border) - 1, turn))
    return strips


def _strip(outer: list[int], inner: list[int], divisions: int, turn: bool) -> NDArray[np.intp]:
    """Triangles between a side and the shorter line of samples beside it.

    Both run over the parameter of the side: `outer` in equal divisions from 0 to 1, `inner` from
    1/R to 1 − 1/R. Each triangle advances by one sample on one of the lines: on the line whose next
    sample has the smaller parameter.
    """
    last = len(outer) - 1
    triangles = []
    b = 0
    for a, (begin, end) in enumerate(pairwise(outer)):
        # An exact comparison of (a+1)/last with (b+2)/R, in integers.
        while b < len(inner) - 1 and (b + 2) * last < (a + 1) * divisions:
            triangles.append((begin, inner[b], inner[b + 1]))
            b += 1
        triangles.append((begin, inner[b], end))
    while b < len(inner) - 1:
        triangles.append((outer[-1], inner[b], inner[b + 1]))
        b += 1
    strip = np.array(triangles, dtype=np.intp)
    return strip[:, ::-1] if turn else strip
