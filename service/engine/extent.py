"""Least and greatest of many points, at the speed of memory."""

import numpy as np

from service.bases.arrays import RealArray

FOLD = 128


def extent(points: RealArray) -> tuple[RealArray, RealArray]:
    """Least and greatest coordinates of points (N, 3), N ≥ 1, in their own precision.

    A reduction over rows of three numbers runs row by row; folded to rows of 128 points it runs
    over whole vectors, some ten times faster.
    """
    whole = len(points) // FOLD * FOLD
    if whole < 4 * FOLD or not points.flags.c_contiguous:
        return points.min(axis=0), points.max(axis=0)
    rows = points[:whole].reshape(-1, 3 * FOLD)
    low = np.concatenate([rows.min(axis=0).reshape(FOLD, 3), points[whole:]]).min(axis=0)
    high = np.concatenate([rows.max(axis=0).reshape(FOLD, 3), points[whole:]]).max(axis=0)
    return low, high
