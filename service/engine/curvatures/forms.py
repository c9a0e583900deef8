"""Curvatures of many samples at once, from arrays of the coordinates of their partials.

With N = S_u × S_v, the first form E, F, G = S_u · S_u, S_u · S_v, S_v · S_v and the second form,
times |N|, L, M, P = S_uu · N, S_uv · N, S_vv · N:

    K = (L P − M²) / |N|⁴,  H = (L G − 2 M F + P E) / (2 |N|³)

Signs are those of `service.engine.points.curvatures`: H is positive where the surface bends towards
its normal.

References
----------
do Carmo, Differential Geometry of Curves and Surfaces, section 3.3.
"""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.nets.partials import project_partials
from service.engine.vectors import cross, dot

Coordinates: TypeAlias = FloatArray
"""Coordinates before samples, (3, r, n) or, homogeneous, (4, r, n): r patches, n samples each."""

PRECISE_NEAR_POLE = 2.0**-13
"""If |N| is larger than this share of its typical value, the formulas are precise enough even near
a pole: their relative error is at most about 2^-52 ÷ PRECISE_NEAR_POLE² = 1e-8."""

MAYBE_ZERO = 2.0**-36
"""If |N| is smaller than this share of its typical value, N may be zero."""

MIN_SQUARE = 2.0**-480
"""If |N|² is smaller than this, |N|⁴ loses digits to underflow."""


def find_squared_norm(along_u: FloatArray, along_v: FloatArray) -> FloatArray:
    """The square of a typical |N| on each patch, (r,), from the nets (r, d, …) of S_u and S_v.

    It is the product of the mean squares of both nets.
    """
    squares = [np.square(net[:, :3]).sum(axis=1) for net in (along_u, along_v)]
    means = [square.reshape(len(square), -1).mean(axis=1) for square in squares]
    typical_square: FloatArray = means[0] * means[1]
    return typical_square


def compute_curvatures(
    partials: list[Coordinates], squared_norm: FloatArray
) -> tuple[FloatArray, Bools, Bools]:
    """Gaussian curvature K and mean curvature H from the partials S, S_u, S_v, S_uu, S_uv, S_vv.

    Parameters
    ----------
    partials : list of ndarray
        The first, S, is used only if the partials are homogeneous.
    squared_norm : ndarray of float64, shape (r,)
        The result of `find_squared_norm`, a typical |N|² of each patch.

    Returns
    -------
    curvatures : ndarray of float64, shape (2, r, n)
    is_doubtful_near_pole : ndarray of bool, shape (r, n)
        Whether the curvatures are too imprecise if the sample is near a pole.
    is_doubtful : ndarray of bool, shape (r, n)
        Whether the curvatures are too imprecise, wherever the sample is.
    """
    weight: FloatArray | float = 1.0
    if len(partials[0]) > 3:
        weight = partials[0][3]
        partials = project_partials(partials)
    _, su, sv, suu, suv, svv = partials
    with np.errstate(all="ignore"):
        n = cross(su, sv, -3)
        e, f, g = dot(su, su, -3), dot(su, sv, -3), dot(sv, sv, -3)
        ell, em, pe = dot(suu, n, -3), dot(suv, n, -3), dot(svv, n, -3)
        square = dot(n, n, -3)
        curvatures = np.empty((2, *square.shape))
        np.divide(ell * pe - em * em, square * square, out=curvatures[0])
        mean = curvatures[1]
        np.divide(ell * g - 2.0 * em * f + pe * e, 2.0 * square * np.sqrt(square), out=mean)
        # The nets of a rational patch are those of w S_u and w S_v.
        squared_share = square * weight**4 / squared_norm[:, np.newaxis]
        is_precise = (squared_share > MAYBE_ZERO**2) & (square > MIN_SQUARE)
        is_precise &= np.isfinite(curvatures[0]) & np.isfinite(curvatures[1])
    return curvatures, ~(squared_share > PRECISE_NEAR_POLE**2), ~is_precise
