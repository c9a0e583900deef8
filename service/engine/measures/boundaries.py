"""Joins open sides to the borders of a surface; its patches are on their left."""

from dataclasses import dataclass

import numpy as np

from service.engine.connectivity.orientation import LEFT, OrientedSides
from service.engine.connectivity.seams import Seams
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, slots=True)
class Border:
    """Open sides, each of which begins where the side before ends.

    `sides` are numbers patch · 4 + side. `is_closed` says whether the last side ends where the
    first begins.
    """

    sides: tuple[int, ...]
    is_closed: bool


def join_open_sides(seams: Seams, oriented: OrientedSides) -> list[Border]:
    """The open sides as borders with the patches on their left, in the order of their first sides.

    If several open sides begin at a corner, a border continues with the unused side of the least
    number.
    """
    sides = np.flatnonzero(oriented.is_open.ravel())
    begins, ends = (seams.corner[:, corners].ravel()[sides] for corners in (BEGINS, ENDS))
    # A side that has its patch on the right is passed from its end to its beginning.
    is_reversed = np.tile(LEFT < 0, len(seams.edge))[sides]
    begins, ends = np.where(is_reversed, ends, begins), np.where(is_reversed, begins, ends)
    # The positions in `sides` of the sides that begin at each corner, the least number last.
    after: dict[int, list[int]] = {}
    for k in range(len(sides) - 1, -1, -1):
        after.setdefault(int(begins[k]), []).append(k)
    end_corners = set(ends.tolist())
    is_unused = np.ones(len(sides), dtype=bool)
    borders = []
    # Begin first at sides that follow no other side: a beginning in the middle of a border would
    # divide it.
    starts = [k for k, corner in enumerate(begins.tolist()) if corner not in end_corners]
    for start in (*starts, *range(len(sides))):
        if not is_unused[start]:
            continue
        numbers, k = [], start
        while True:
            is_unused[k] = False
            numbers.append(int(sides[k]))
            if ends[k] == begins[start]:
                break
            following = after.get(int(ends[k]), [])
            while following and not is_unused[following[-1]]:
                following.pop()
            if not following:
                break
            k = following[-1]
        borders.append(Border(tuple(numbers), bool(ends[k] == begins[start])))
    return sorted(borders, key=lambda border: border.sides[0])
