"""Triangles that lost their area when their corners were rounded to float32, and to nothing else.

The mesh was made in float64, of points of the surface at parameters that the file tells. If all
three corners are where rounding alone may have put these points, then so is every line through
them: the triangle was not wider than rounding can undo. If they are not, or if the points
themselves are in line, something else has flattened it.
"""

import numpy as np

from tests.oracles.exact import flat
from tests.oracles.sheets import Sheet
from tools.certify.written import Array

NOISE = 2.0**-46
"""Part of its coordinates by which a point of the surface may be computed wrong here."""


def flattened_by_rounding(sheet: Sheet, corners: Array, places: Array, steps: Array) -> bool:
    """Whether a triangle without area has had one before its corners were rounded.

    Parameters
    ----------
    sheet : Sheet
    corners : ndarray, shape (3, 3)
        As they are written.
    places : ndarray, shape (3, 2)
        Their parameters: float32.
    steps : ndarray, shape (3, 3)
        Half the distance of neighbouring numbers at each coordinate.
    """
    points = sheet.at(sheet.inside(places)) + sheet.origin
    if flat(points):
        return False
    allowed = steps + NOISE * (np.abs(points) + np.abs(sheet.origin))
    return bool((np.abs(corners - points) <= allowed + _doubt(sheet, places)).all())


def _doubt(sheet: Sheet, places: Array) -> Array:
    """How far the points (3, 3) may move because their parameters are rounded as well."""
    at = sheet.at(sheet.inside(places))
    moved = np.zeros_like(at)
    for axis in range(2):
        step = np.zeros_like(places)
        step[:, axis] = np.spacing(np.abs(places[:, axis]).astype(np.float32))
        for neighbours in (places - step, places + step):
            moved = np.maximum(moved, np.abs(sheet.at(sheet.inside(neighbours)) - at))
    return 2 * moved
