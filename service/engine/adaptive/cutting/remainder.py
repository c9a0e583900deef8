"""Heights that cells have beyond their biquadratic parts, and sag of their nets along u and v."""

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.adaptive.cutting.halving import build_quadratic_matrix
from service.engine.bounds.vectors import dot


def measure_remainder(
    net: FloatArray, at: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool
) -> FloatArray:
    """The largest height (m,) of a control point of a net less its biquadratic part.

    Parameters
    ----------
    net : ndarray of float64, shape (p+1, q+1, 3, m)
    at : ndarray of float64, shape (3, 3, 3, m)
        Nine points of each.
    normals : ndarray of float64, shape (2, 3, m)
        Normals of both triangles.
    flat : ndarray of bool, shape (m,)
        Cells without normals, of which lengths count instead of heights.
    two_sided : bool
        Whether half of each length counts, too.
    """
    normals = normals[:, np.newaxis, np.newaxis]
    heights: FloatArray
    heights = np.maximum.reduce(
        np.abs(_subtract_biquadratic(dot(net, normals), dot(at, normals))), axis=(0, 1, 2)
    )
    if flat.any() or two_sided:
        left = _subtract_biquadratic(
            net.swapaxes(0, 2).swapaxes(1, 2), at.swapaxes(0, 2).swapaxes(1, 2)
        )
        stray = np.sqrt(np.add.reduce(left * left, axis=0).max(axis=(0, 1)))
        heights = np.where(flat, stray, np.maximum(heights, stray * (0.5 if two_sided else 0.0)))
    return heights


def measure_sag(net: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool) -> FloatArray:
    """Heights of nets over chords along u, and along v, by second differences: (2, m).

    The arguments are those of `measure_remainder`.
    """
    sag = np.empty((2, net.shape[3]))
    for axis in (0, 1):
        degree = net.shape[axis] - 1
        step = net.swapaxes(0, axis)
        step = step[1:] - step[:-1]
        bend = step[1:] - step[:-1]
        size = np.abs(dot(bend, normals[:, np.newaxis, np.newaxis])).max(axis=(0, 1, 2))
        if flat.any() or two_sided:
            stray = np.sqrt(dot(bend, bend).max(axis=(0, 1)))
            size = np.where(flat, stray, np.maximum(size, stray * (0.5 if two_sided else 0.0)))
        sag[axis] = size * (degree * (degree - 1) / 8)
    return sag


def _subtract_biquadratic(values: FloatArray, at: FloatArray) -> FloatArray:
    """Nets (k, p+1, q+1, m) less those of biquadratic functions with values (k, 3, 3, m)."""
    along_u, along_v = (build_quadratic_matrix(n - 1)[..., np.newaxis] for n in values.shape[1:3])
    row = along_u[:, 0, np.newaxis] * at[:, np.newaxis, 0]
    row += along_u[:, 1, np.newaxis] * at[:, np.newaxis, 1]
    row += along_u[:, 2, np.newaxis] * at[:, np.newaxis, 2]
    left = values - along_v[:, 0] * row[:, :, np.newaxis, 0]
    left -= along_v[:, 1] * row[:, :, np.newaxis, 1]
    left -= along_v[:, 2] * row[:, :, np.newaxis, 2]
    return left
