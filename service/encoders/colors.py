"""Colours of vertices in the forms of the formats: as bytes, and with an opacity."""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import RealArray


def to_bytes(colors: RealArray) -> NDArray[np.uint8]:
    """Colours, and opacity if present, from 0 to 255; halves are rounded to even."""
    return np.rint(colors.astype(np.float64) * 255).astype(np.uint8)


def add_opacity(colors: RealArray) -> NDArray[np.float32]:
    """Colours with opacity, as OOGL and OFF need them; without an opacity, opaque."""
    four = np.ones((len(colors), 4), dtype=np.float32)
    four[:, : colors.shape[1]] = colors
    return four


def is_translucent(colors: RealArray) -> bool:
    """Whether any vertex is not opaque."""
    return colors.shape[1] == 4 and bool((colors[:, 3] < 1).any())
