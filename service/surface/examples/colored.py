"""Example surfaces with channels: one has colours by its height, one has a temperature.

If the colours of the control points of a polynomial surface are an affine function of their
positions, then the colour of every point of the surface is the same function of its position,
because the basis functions add up to one. So the colours by height are exact, not sampled.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bezier import BezierSurface
from service.surface.channels import Channels

COLD, HOT = (0.08, 0.25, 0.55), (1.0, 0.82, 0.35)
"""The colours of the least and the greatest value: blue and yellow, sRGB."""


def color_ramp(values: FloatArray) -> FloatArray:
    """Colours (…, 3) of values (…), linear from `COLD` at the least to `HOT` at the greatest."""
    fraction = ((values - values.min()) / np.ptp(values))[..., np.newaxis]
    colors: FloatArray = (1.0 - fraction) * COLD + fraction * HOT
    return colors


def color_by_height(surface: BezierSurface, name: str) -> BezierSurface:
    """The surface with a new name, and with colours that are a linear function of z."""
    colors = color_ramp(surface.control_net[..., 2])
    return replace(surface, name=name, channels=Channels(colors))


def heated_panel() -> BezierSurface:
    """A vaulted panel of 4 × 3 metres, heated on one spot.

    Degree (2, 2), with an attribute `temperature` (°C) and colours of degree (4, 3) that follow it,
    and texture coordinates of degree (1, 1) in metres.
    """
    x, y = np.meshgrid(np.linspace(0, 4, 3), np.linspace(0, 3, 3), indexing="ij")
    z = np.array([[0.0, 0.5, 0.0], [0.5, 1.5, 0.5], [0.0, 0.5, 0.0]])
    temperature = np.full((5, 4), 20.0)
    temperature[1:4, 1:3] = [[60.0, 40.0], [140.0, 70.0], [50.0, 30.0]]
    uvs = np.array([[[0.0, 0.0], [0.0, 3.0]], [[4.0, 0.0], [4.0, 3.0]]])
    channels = Channels(
        color_ramp(temperature), uvs, (("temperature", temperature[..., np.newaxis]),)
    )
    return BezierSurface(
        np.stack([x, y, z], axis=-1), up="z", name="heated-panel", channels=channels
    )
