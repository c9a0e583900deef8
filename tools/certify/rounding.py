"""Decides whether triangles have no area only because corners were rounded to float32.

The service computes a mesh in float64, from points of the surface at the parameters in the file. If
all three corners are within the rounding error of these points, then rounding made the area zero.
If a corner is further away, or if the points themselves are collinear, the triangle has another
fault.

A sheet is a surface as the oracles sample it (`oracles.sheets`): `at` returns points relative
to its `origin`.
"""

import numpy as np

from oracles.exact import is_flat
from oracles.sheets import Sheet
from tools.certify.written import Array

NOISE = 2.0**-46
"""An upper bound of the relative error of a point of the surface that this program computes."""


def is_flattened_by_rounding(sheet: Sheet, corners: Array, places: Array, steps: Array) -> bool:
    """Whether a triangle without area had an area before its corners were rounded.

    Parameters
    ----------
    sheet : Sheet
    corners : ndarray, shape (3, 3)
        The corners in the file.
    places : ndarray, shape (3, 2)
        The parameters of the corners in the file, float32.
    steps : ndarray, shape (3, 3)
        Half the distance of neighbouring float32 numbers at each coordinate.
    """
    points = sheet.at(sheet.clip_to_domain(places)) + sheet.origin
    if is_flat(points):
        return False
    allowed = steps + NOISE * (np.abs(points) + np.abs(sheet.origin))
    return bool((np.abs(corners - points) <= allowed + _measure_rounding(sheet, places)).all())


def _measure_rounding(sheet: Sheet, places: Array) -> Array:
    """Distances (3, 3) by which coordinates may change if both parameters of a corner change by
    rounding."""
    points = sheet.at(sheet.clip_to_domain(places))
    distances = np.zeros_like(points)
    for axis in range(2):
        step = np.zeros_like(places)
        step[:, axis] = np.spacing(np.abs(places[:, axis]).astype(np.float32))
        for neighbours in (places - step, places + step):
            distances = np.maximum(
                distances, np.abs(sheet.at(sheet.clip_to_domain(neighbours)) - points)
            )
    return 2 * distances  # one change along u, and one along v
