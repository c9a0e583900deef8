"""Converts colours of vertices to the forms that formats need: to bytes, or with an opacity."""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import RealArray


def to_bytes(colors: RealArray) -> NDArray[np.uint8]:
    """Colours, with or without opacity, as bytes from 0 to 255; halves are rounded to even."""
    return np.rint(colors.astype(np.float64) * 255).astype(np.uint8)


def add_opacity(colors: RealArray) -> NDArray[np.float32]:
    """Colours as red, green, blue and opacity, as OOGL and OFF need them: shape (V, 4).

    Colours without an opacity get the opacity 1.
    """
    rgba = np.ones((len(colors), 4), dtype=np.float32)
    rgba[:, : colors.shape[1]] = colors
    return rgba


def is_translucent(colors: RealArray) -> bool:
    """Whether any vertex has an opacity below 1."""
    return colors.shape[1] == 4 and bool((colors[:, 3] < 1).any())
