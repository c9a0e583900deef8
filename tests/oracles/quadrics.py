"""Closed forms of the exact examples: the distance of a point, and the outward normal there.

The z axis is the axis of all; the cylinder and the cone extend from −height/2 to height/2. Points
are arrays of shape (N, 3); residuals are lengths in model units, signed.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _axis_distance(points: Array) -> Array:
    return np.hypot(points[:, 0], points[:, 1])


def _build_unit_vectors(points: Array, radial: Array | float, axial: Array | float) -> Array:
    """Unit vectors with the given components away from the axis and along it."""
    rho = _axis_distance(points)
    away = points[:, :2] / rho[:, None]
    return np.column_stack(
        [away * np.broadcast_to(radial, rho.shape)[:, None], np.broadcast_to(axial, rho.shape)]
    )


def sphere(points: Array, radius: float = 1.0) -> tuple[Array, Array]:
    """|P| − r, and P/r."""
    return np.linalg.norm(points, axis=1) - radius, points / radius


def cylinder(points: Array, radius: float = 1.0) -> tuple[Array, Array]:
    """Distance from the axis − r, and straight away from the axis."""
    return _axis_distance(points) - radius, _build_unit_vectors(points, 1.0, 0.0)


def cone(points: Array, radius: float = 1.0, height: float = 2.0) -> tuple[Array, Array]:
    """ρ − r (½ − z/h), and the normal of the slant; the normal is NaN at the apex."""
    off = _axis_distance(points) - radius * (0.5 - points[:, 2] / height)
    slant = np.hypot(radius, height)
    with np.errstate(invalid="ignore"):
        return off, _build_unit_vectors(points, height / slant, radius / slant)


def torus(points: Array, radius: float = 1.0, tube: float = 0.4) -> tuple[Array, Array]:
    """Distance from the centre circle − tube radius, and away from that circle."""
    from_circle = _axis_distance(points) - radius
    off = np.hypot(from_circle, points[:, 2]) - tube
    return off, _build_unit_vectors(points, from_circle / tube, points[:, 2] / tube)
