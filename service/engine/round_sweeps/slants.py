"""Planes of frames, as vectors by which rings and crossbars lean along the path."""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.sweeps.paths import Paths
from service.engine.vectors import dot, length


def find_slants(paths: Paths) -> FloatArray:
    """Vectors g, (m, 3), of offsets e − (e · g) T in the planes of the frames of one path.

    For a plane with the normal M, g = M / (T · M) − T.
    """
    if paths.mitres is None:
        return np.zeros(paths.points.shape[1:])
    planes, tangents = paths.mitres[0], paths.tangents[0]
    slants: FloatArray = planes / dot(tangents, planes, -1)[:, None] - tangents
    return slants


def find_widths(slants: FloatArray) -> FloatArray:
    """The factors √(1 + |g|²), (m,), by which rings in planes are wider than circles."""
    return np.hypot(1.0, length(slants, -1))
