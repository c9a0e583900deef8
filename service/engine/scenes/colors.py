"""Converts colours between sRGB, the encoding in requests, and linear light, for arithmetic.

References
----------
IEC 61966-2-1:1999, section 5.2.
"""

import numpy as np

from service.bases.arrays import FloatArray, RealArray


def to_linear(colors: RealArray) -> FloatArray:
    """Linear light from sRGB; an opacity stays the same.

        c / 12.92                    for c ≤ 0.04045
        ((c + 0.055) / 1.055)^2.4    above

    Parameters
    ----------
    colors : ndarray, shape (V, 3) or (V, 4)
        From 0 to 1.
    """
    light = colors.astype(np.float64)
    srgb = light[:, :3]
    light[:, :3] = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return light


def to_srgb(light: RealArray) -> FloatArray:
    """The inverse of `to_linear`.

    12.92 c                      for c ≤ 0.0031308
    1.055 c^(1/2.4) − 0.055      above
    """
    colors = light.astype(np.float64)
    linear = colors[:, :3]
    colors[:, :3] = np.where(
        linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055
    )
    return colors


def tint(colors: RealArray | None, base: RealArray, count: int) -> RealArray:
    """Colours of vertices times a base colour: sRGB colours, multiplied in linear light.

    Parameters
    ----------
    colors : ndarray, shape (V, 3) or (V, 4), or None
        None stands for white.
    base : ndarray of float64, shape (4,)
    count : int
        The number V of vertices.

    Returns
    -------
    ndarray, shape (V, 3) if all colours are opaque, else (V, 4)
    """
    columns = 3 if base[3] == 1 and (colors is None or colors.shape[1] == 3) else 4
    if colors is None:
        return np.tile(base[:columns], (count, 1))
    light = np.ones((count, columns))
    light[:, : colors.shape[1]] = to_linear(colors)
    light *= to_linear(base[None])[:, :columns]
    return to_srgb(light).clip(0, 1).astype(colors.dtype)
