"""The numbers of the four sides and four corners of a patch, in all modules.

Sides 0 … 3 are u = 0, u = 1, v = 0, v = 1; each runs along the other parameter, upwards. Corners
0 … 3 are (0, 0), (0, 1), (1, 0), (1, 1).
"""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Grid = TypeVar("Grid", bound=NDArray[Any])
Value = TypeVar("Value")

BEGINS = np.array([0, 2, 0, 1])
"""Corner at which each side begins."""

ENDS = np.array([1, 3, 2, 3])
"""Corner at which each side ends."""


def take_side(grids: Grid, side: int, inwards: int = 0) -> Grid:
    """One side of every grid (P, m, n, …): a view, (P, n, …) of sides 0 and 1, else (P, m, …).

    `inwards` counts lines from the side: 1 is the line next to it.
    """
    line = -1 - inwards if side % 2 else inwards
    return grids[:, line] if side < 2 else grids[:, :, line]  # type: ignore[return-value]


def take_corners(grids: Grid) -> Grid:
    """The four corners of every grid (P, m, n, …): (P, 4, …)."""
    return grids[:, [0, 0, -1, -1], [0, -1, 0, -1]]  # type: ignore[return-value]


def along_sides(u: Value, v: Value) -> tuple[Value, Value, Value, Value]:
    """For each side the value of its direction: u or v, for example a degree."""
    return v, v, u, u
