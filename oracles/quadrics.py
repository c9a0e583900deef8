"""Closed forms of the built-in quadrics and the torus: residuals and outward unit normals.

All have the z axis as their axis; the cone extends from −height/2 to height/2. Each function takes
points of shape (N, 3). It returns a residual (N,) for each point, which is zero on the surface and
positive outside, and the unit normals (N, 3).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _measure_axis_distance(points: Array) -> Array:
    return np.hypot(points[:, 0], points[:, 1])


def _build_unit_vectors(points: Array, radial: Array | float, axial: Array | float) -> Array:
    """Unit vectors with the given components away from the axis and along it."""
    rho = _measure_axis_distance(points)
    outward = points[:, :2] / rho[:, None]
    return np.column_stack(
        [outward * np.broadcast_to(radial, rho.shape)[:, None], np.broadcast_to(axial, rho.shape)]
    )


def sphere(points: Array, radius: float = 1.0) -> tuple[Array, Array]:
    """|P| − radius, and P/radius."""
    return np.linalg.norm(points, axis=1) - radius, points / radius


def cylinder(points: Array, radius: float = 1.0) -> tuple[Array, Array]:
    """Distance from the axis minus the radius, and unit vectors away from the axis."""
    return _measure_axis_distance(points) - radius, _build_unit_vectors(points, 1.0, 0.0)


def cone(points: Array, radius: float = 1.0, height: float = 2.0) -> tuple[Array, Array]:
    """ρ − radius (½ − z/height), ρ the distance from the axis; the normal is NaN at the apex."""
    residual = _measure_axis_distance(points) - radius * (0.5 - points[:, 2] / height)
    slant = np.hypot(radius, height)
    with np.errstate(invalid="ignore"):
        return residual, _build_unit_vectors(points, height / slant, radius / slant)


def torus(points: Array, radius: float = 1.0, tube: float = 0.4) -> tuple[Array, Array]:
    """Distance from the centre circle minus `tube`; normals point away from the centre circle."""
    from_circle = _measure_axis_distance(points) - radius
    residual = np.hypot(from_circle, points[:, 2]) - tube
    return residual, _build_unit_vectors(points, from_circle / tube, points[:, 2] / tube)
