"""Colours of curvatures: blue below zero, orange above, and the range that they cover."""

import numpy as np

from service.bases.arrays import FloatArray

DIVERGING = np.array([
    [0.02, 0.19, 0.38], [0.10, 0.40, 0.66], [0.36, 0.65, 0.83], [0.70, 0.85, 0.93],
    [0.95, 0.95, 0.93],
    [0.98, 0.80, 0.60], [0.93, 0.57, 0.25], [0.75, 0.35, 0.05], [0.45, 0.19, 0.02],
])  # fmt: skip
"""sRGB for values from -1 to 1 in equal steps, through a light grey: readers with any kind of
colour vision can distinguish the two sides of zero."""

SHOWN_SHARE = 0.9
"""Share of the area of the picture whose curvature is inside the range of colours."""

FLAT = 1e-9
"""A surface with less curvature, in units of its size, is flat up to rounding."""


def find_range(values: FloatArray, shares: FloatArray, size: float) -> float:
    """The largest curvature of the range of colours, on both sides of zero.

    Parameters
    ----------
    values, shares : ndarray of float64, shape (m,)
        Curvatures, and the shares of pixels in which they are seen.
    size : float
        The extent of the model, to the power of the dimension of the curvature: its product with a
        curvature has no dimension. Above 0.
    """
    sizes = np.abs(np.where(np.isfinite(values), values, 0.0))
    if not len(sizes):
        return 1.0 / size
    order = np.argsort(sizes, kind="stable")
    reached = np.cumsum(shares[order])
    largest = float(sizes[order[np.searchsorted(reached, SHOWN_SHARE * reached[-1])]])
    if largest * size <= FLAT:
        largest = float(sizes.max())
    # What is flat everywhere shows zero, and not its rounding.
    return largest if largest * size > FLAT else 1.0 / size


def color_curvatures(values: FloatArray, largest: float) -> FloatArray:
    """SRGB colours (m, 3) of curvatures (m,); those that do not exist have the colour of zero."""
    values = np.where(np.isfinite(values), values, 0.0)
    place = (np.clip(values / largest, -1.0, 1.0) + 1.0) / 2 * (len(DIVERGING) - 1)
    whole = np.minimum(place.astype(np.intp), len(DIVERGING) - 2)
    rest = (place - whole)[:, np.newaxis]
    colors: FloatArray = DIVERGING[whole] * (1.0 - rest) + DIVERGING[whole + 1] * rest
    return colors
