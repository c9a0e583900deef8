"""Examples of few patches: from files, saddles, and two with channels.

If the colours of the control points of a polynomial surface are an affine function of their
positions, then the colour of every point of the surface is the same function of its position,
because the basis functions add up to one. So the colours by height are exact, not sampled.
"""

import json
from dataclasses import replace
from importlib.resources import files
from math import sqrt
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.channels import Channels
from service.surface.checks import Up
from service.surface.patches import PatchSurface

COLD, HOT = (0.08, 0.25, 0.55), (1.0, 0.82, 0.35)
"""The colours of the least and the greatest value: blue and yellow, sRGB."""


def color_ramp(values: FloatArray) -> FloatArray:
    """Colours (…, 3) of values (…), linear from `COLD` at the least to `HOT` at the greatest."""
    fraction = ((values - values.min()) / np.ptp(values))[..., np.newaxis]
    colors: FloatArray = (1.0 - fraction) * COLD + fraction * HOT
    return colors


def color_by_height(name: str, up: Up) -> BezierSurface:
    """The surface `net(name, up)`, with colours that are a linear function of z."""
    surface = net(name, up)
    colors = color_ramp(surface.control_net[..., 2])
    return replace(surface, name=f"{name}-colors", channels=Channels(colors))


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


def _data(name: str) -> dict[str, Any]:
    """The content of a file of data."""
    text = (files("service.surface.examples") / "data" / f"{name}.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def net(name: str, up: Up) -> BezierSurface:
    """The Bézier surface over the control net of a file."""
    return BezierSurface(np.array(_data(name)["control_net"]), up=up, name=name)


def teapot(name: str, z_factor: float) -> PatchSurface:
    """The teapot, whose heights are multiplied by a factor."""
    data = _data("utah-teapot")
    return PatchSurface(
        np.array(data["vertices"]) * (1.0, 1.0, z_factor),
        np.array(data["patches"]),
        parts=tuple((part, tuple(members)) for part, members in data["parts"].items()),
        up="z",
        name=name,
    )


def saddle() -> BezierSurface:
    """The hyperbolic paraboloid z = xy."""
    corners = [[[-1, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]]
    return BezierSurface(np.array(corners, dtype=np.float64), up="z", name="saddle")


def monkey_saddle() -> TriangleSurface:
    """The graph of z = Re((x + iy)³) over the triangle whose corners are the cube roots of unity.

    The control points have the heights Re(a b c), the blossom of z, where a, b, c are corners.
    """
    half = sqrt(3) / 2
    corners = np.array([1, complex(-0.5, half), complex(-0.5, -half)])
    # For each control point, the numbers of the three corners a, b, c.
    rows = ["000 001 011 111", "002 012 112", "022 122", "222"]
    arguments = np.array([[corners[int(c)] for c in word] for row in rows for word in row.split()])
    middles, products = arguments.mean(axis=1), arguments.prod(axis=1)
    # The exact heights are multiples of 1/2: cosines of multiples of 120°.
    heights = np.round(2 * products.real) / 2
    net = np.stack([middles.real, middles.imag, heights], axis=1)
    return TriangleSurface(net, up="z", name="monkey-saddle")
