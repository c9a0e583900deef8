"""The four sides and four corners of a patch: the numbers by which all modules call them.

Sides 0, 1, 2, 3 are u = 0, u = 1, v = 0, v = 1. Sides 0 and 1 run in the direction of increasing v,
sides 2 and 3 in the direction of increasing u. Corners 0, 1, 2, 3 are (u, v) = (0, 0), (0, 1),
(1, 0), (1, 1).
"""

from typing import TypeVar

import numpy as np

from service.bases.arrays import AnyArray

Grid = TypeVar("Grid", bound=AnyArray)
Value = TypeVar("Value")

BEGINS = np.array([0, 2, 0, 1])
"""The number of the corner at which each side begins."""

ENDS = np.array([1, 3, 2, 3])
"""The number of the corner at which each side ends."""


def take_side(grids: Grid, side: int, inwards: int = 0) -> Grid:
    """One side of every grid, as a view.

    Parameters
    ----------
    grids : ndarray, shape (P, m, n, …)
        P grids, for example of control points.
    side : int
        The number of the side, 0 to 3.
    inwards : int
        0 for the side itself, 1 for the line of points next to the side, and so on.

    Returns
    -------
    ndarray, shape (P, n, …) for the sides 0 and 1, (P, m, …) for the sides 2 and 3
    """
    line = -1 - inwards if side % 2 else inwards
    return grids[:, line] if side < 2 else grids[:, :, line]  # type: ignore[return-value]


def take_corners(grids: Grid) -> Grid:
    """The four corners of every grid: shape (P, 4, …) for grids of shape (P, m, n, …)."""
    return grids[:, [0, 0, -1, -1], [0, -1, 0, -1]]  # type: ignore[return-value]


def along_sides(u: Value, v: Value) -> tuple[Value, Value, Value, Value]:
    """The value of each side (for example its degree), from the values along u and along v."""
    return v, v, u, u
