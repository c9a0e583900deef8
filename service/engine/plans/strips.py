"""Strips of triangles between the border of a patch and the next line of its grid.

If a neighbour divides a shared edge more finely than the grid, the patch gets four strips. They
join the samples of its four edges to the grid inside.
"""

from itertools import pairwise
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Ints

Divisions: TypeAlias = tuple[int, int, int, int]
"""Numbers of divisions of the four sides."""


def build_strips(number: Ints, sides: Divisions) -> list[Ints]:
    """Triangles (T, 3) beside each of the sides u = 0, u = 1, v = 0, v = 1, as local indices.

    Parameters
    ----------
    number : ndarray of int, shape (Ru+1, Rv+1)
        The indices of the samples of the grid; Ru, Rv ≥ 2. The samples between the ends of the
        sides whose divisions differ from the grid have the next indices, one side after another.
    sides : tuple of int
        Divisions of the sides.
    """
    # For each side: its samples in the grid, the samples beside them inside, and whether triangles
    # must be reversed to have the orientation of the other strips.
    lines = (
        (number[0], number[1, 1:-1], False),
        (number[-1], number[-2, 1:-1], True),
        (number[:, 0], number[1:-1, 1], True),
        (number[:, -1], number[1:-1, -2], False),
    )
    first = number.size
    strips = []
    for (border, inner, is_reversed), divisions in zip(lines, sides, strict=True):
        if divisions == len(border) - 1:
            outer = border
        else:
            samples_between_ends = np.arange(first, first + divisions - 1)
            outer = np.concatenate([border[:1], samples_between_ends, border[-1:]])
            first += divisions - 1
        strips.append(_build_strip(outer.tolist(), inner.tolist(), len(border) - 1, is_reversed))
    return strips


def _build_strip(outer: list[int], inner: list[int], divisions: int, is_reversed: bool) -> Ints:
    """Triangles (T, 3) between a side, `outer`, and the shorter line of samples beside it, `inner`.

    The samples of `outer` are at equal distances from parameter 0 to 1, the samples of `inner` from
    1/R to 1 − 1/R, where R is `divisions`. Each triangle advances by one sample, on the line whose
    next sample has the smaller parameter.
    """
    last = len(outer) - 1
    triangles = []
    j = 0
    for i, (begin, end) in enumerate(pairwise(outer)):
        # Integers compare (i+1)/last with (j+2)/R exactly.
        while j < len(inner) - 1 and (j + 2) * last < (i + 1) * divisions:
            triangles.append((begin, inner[j], inner[j + 1]))
            j += 1
        triangles.append((begin, inner[j], end))
    while j < len(inner) - 1:
        triangles.append((outer[-1], inner[j], inner[j + 1]))
        j += 1
    strip = np.array(triangles, dtype=np.intp)
    return strip[:, ::-1] if is_reversed else strip
