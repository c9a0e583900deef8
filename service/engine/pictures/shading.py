"""The light of pictures: a glazed surface in a room with lamps, as the editor shows it.

All directions are in the frame turned y-up. Colours are linear until `to_srgb`.

References
----------
Schlick, An inexpensive BRDF model for physically-based rendering, Computer Graphics Forum 13
(1994).
Khronos, PBR Neutral tone mapper, specification (2024).
IEC 61966-2-1, sRGB.
"""

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray
from service.engine.vectors import Vectors, dot, normalize

ROUGHNESS, REFLECTANCE = 0.32, 0.04
"""The glaze blurs reflections by the first, and reflects the second of light from above."""

SKY, GROUND = np.array([1.32, 1.40, 1.54]), np.array([0.77, 0.61, 0.42])
"""Light from above and from below."""


class _Lamp(NamedTuple):
    """A lamp far away: its direction, not normalised, and its light."""

    direction: tuple[float, float, float]
    light: tuple[float, float, float]


LAMPS = (
    _Lamp((-0.6, 1.1, 0.8), (2.3, 2.07, 1.78)),
    _Lamp((0.7, 0.5, -0.9), (0.52, 0.57, 0.70)),
)


class _Panel(NamedTuple):
    """A bright rectangle far away: its middle, the direction of its width, half sizes, light."""

    to: tuple[float, float, float]
    across: tuple[float, float, float]
    size: tuple[float, float]
    light: tuple[float, float, float]


PANELS = (
    _Panel((-0.80, 0.42, 0.55), (0.55, 0.0, 0.80), (0.34, 0.62), (3.4, 3.26, 3.06)),
    _Panel((0.92, 0.30, 0.16), (-0.16, 0.0, 0.92), (0.16, 0.72), (1.63, 1.77, 1.9)),
    _Panel((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.7, 0.5), (1.3, 1.3, 1.3)),
    _Panel((0.25, 0.35, -0.90), (0.90, 0.0, 0.25), (0.8, 0.4), (1.08, 1.14, 1.2)),
)


def shade(albedo: Vectors, normals: Vectors, rays: Vectors) -> Vectors:
    """The light (3, m) of points with colours (3, m), unit normals (3, m), seen along rays (3, m).

    Both sides of a surface look alike: normals are turned to the eye.
    """
    facing = -dot(normals, rays)
    normals = np.where(facing < 0, -normals, normals)
    facing = np.abs(facing)
    light = _column(GROUND) + _column(SKY - GROUND) * (0.5 + 0.5 * normals[1])
    for lamp in LAMPS:
        direction = normalize(np.array(lamp.direction), -1)
        light += _column(lamp.light) * np.maximum(direction @ normals, 0.0)
    grazing = (1.0 - np.minimum(facing, 1.0)) ** 5
    mirrored = REFLECTANCE + (1.0 - ROUGHNESS - REFLECTANCE) * grazing
    seen: Vectors = light * albedo / pi
    seen += mirrored * _reflect_room(rays + 2.0 * facing * normals)
    return seen


def _column(color: ArrayLike) -> Vectors:
    """A colour (3,) for products with the values (m,) of points."""
    return np.reshape(np.asarray(color, np.float64), (3, 1))


def _reflect_room(r: Vectors) -> Vectors:
    """The light (3, m) of the room from unit directions (3, m), blurred as by the glaze."""
    blur = 0.04 + 0.45 * ROUGHNESS
    low, high = np.array([0.20, 0.17, 0.14]), np.array([0.55, 0.60, 0.66])
    light: Vectors = _column(low) + _column(high - low) * _smooth_step(-0.4, 0.9, r[1])
    for panel in PANELS:
        to = normalize(np.array(panel.to), -1)
        across = normalize(np.array(panel.across), -1)
        depth = to @ r
        inside = np.where(depth > 0, 1.0, 0.0)
        depth = np.maximum(depth, 1e-3)
        for axis, half in zip((across, np.cross(to, across)), panel.size, strict=True):
            inside *= 1.0 - _smooth_step(half - blur, half + blur, np.abs(axis @ r) / depth)
        light += _column(panel.light) * inside
    return light


def _smooth_step(low: float, high: float, x: FloatArray) -> FloatArray:
    """A smooth step from 0 at `low` to 1 at `high`."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    result: FloatArray = t * t * (3.0 - 2.0 * t)
    return result


def compress(light: Vectors) -> Vectors:
    """Light (3, m) as linear colours below 1: bright light loses its colour."""
    darkest = light.min(axis=0)
    light = light - np.where(darkest < 0.08, darkest - 6.25 * darkest * darkest, 0.04)
    peak = light.max(axis=0)
    start, desaturation = 0.8 - 0.04, 0.15
    rest = 1.0 - start
    bright = np.maximum(peak, start)
    new_peak = 1.0 - rest * rest / (bright + rest - start)
    white = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0)
    compressed = light * (new_peak / bright) * (1.0 - white) + new_peak * white
    return np.where(peak < start, light, compressed)


def to_linear(srgb: FloatArray) -> FloatArray:
    """Linear components of sRGB components from 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: FloatArray) -> FloatArray:
    """SRGB components of linear components from 0 to 1."""
    curved = 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)
