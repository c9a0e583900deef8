"""Cameras of pictures: where they stand, and where points of a model are in the picture.

Directions are counted in the frame that is turned y-up: from a model whose vertical axis is z,
(x, y, z) is (x, z, −y) there. With the azimuth a and the elevation e the camera looks along

    −(sin a cos e, sin e, cos a cos e),

so 0 looks along −z, and 90° along −x.
"""

from dataclasses import dataclass, replace
from math import cos, hypot, radians, sin, tan

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.pictures.options import Viewpoint
from service.engine.vectors import Vectors, normalize
from service.surface.checks import Up

MARGIN = 0.94
"""The share of the picture that a model fills whose place the request leaves to the camera."""

UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Turns z-up to y-up."""


@dataclass(frozen=True, eq=False, slots=True)
class PictureCamera:
    """A camera in model coordinates.

    Attributes
    ----------
    eye : ndarray of float64, shape (3,)
    axes : ndarray of float64, shape (3, 3)
        Unit vectors to the right, up, and along the direction of the camera.
    focus : float
        Pixels of a length 1 at the depth 1; in an orthographic picture, at any depth.
    size : (width, height)
        Pixels.
    orthographic : bool
    """

    eye: FloatArray
    axes: FloatArray
    focus: float
    size: tuple[int, int]
    orthographic: bool

    def place(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Homogeneous picture coordinates (3, m) and depths (m,) of points (m, 3).

        As `service.engine.pictures.raster.find_visible` takes them.
        """
        x, y, depth = self.axes @ (points - self.eye).T
        w = np.ones_like(depth) if self.orthographic else depth
        width, height = self.size
        return np.stack(
            [self.focus * x + w * (width / 2), w * (height / 2) - self.focus * y, w]
        ), depth

    def reduce(self, most: int) -> "PictureCamera":
        """The camera with this view, and with at most this number of pixels in each direction."""
        largest = max(self.size)
        if largest <= most:
            return self
        size = (max(1, self.size[0] * most // largest), max(1, self.size[1] * most // largest))
        return replace(self, size=size, focus=self.focus * size[0] / self.size[0])

    def find_rays(self, pixels: Vectors) -> Vectors:
        """Unit vectors (3, m) from the eye through places of the picture (2, m), in pixels."""
        width, height = self.size
        if self.orthographic:
            return np.broadcast_to(self.axes[2][:, np.newaxis], (3, pixels.shape[1]))
        x, y = pixels
        rays = np.stack([x - width / 2, height / 2 - y, np.full(x.shape, self.focus)])
        return normalize(self.axes.T @ rays)


def build_camera(viewpoint: Viewpoint, points: FloatArray, up: Up) -> PictureCamera:
    """The camera of a viewpoint, for a model with these points (n, 3)."""
    turn = UPRIGHT if up == "z" else np.eye(3)
    points = points @ turn.T
    size = viewpoint.width, viewpoint.height
    slope = tan(viewpoint.field_of_view / 2)
    if viewpoint.position is not None and viewpoint.target is not None:
        eye, target = np.array(viewpoint.position), np.array(viewpoint.target)
        axes = _find_axes(target - eye)
        distance = float(np.linalg.norm(target - eye))
        focus = viewpoint.height / (2 * slope * (distance if viewpoint.orthographic else 1.0))
    else:
        eye, axes, focus = _fit(viewpoint, points, slope)
    return PictureCamera(
        eye @ turn, axes @ turn, focus * viewpoint.zoom, size, viewpoint.orthographic
    )


def _fit(
    viewpoint: Viewpoint, points: FloatArray, slope: float
) -> tuple[FloatArray, FloatArray, float]:
    """Eye, axes and focus of a camera that shows all points, from a direction."""
    azimuth, elevation = radians(viewpoint.azimuth), radians(viewpoint.elevation)
    flat = cos(elevation)
    axes = _find_axes(
        -np.array([sin(azimuth) * flat, sin(elevation), cos(azimuth) * flat]), azimuth
    )
    # The middle of the picture is that of the box about the points, as the camera sees them.
    turned = points @ axes.T
    middle = (turned.min(axis=0) + turned.max(axis=0)) / 2 @ axes
    x, y, depth = axes @ (points - middle).T
    extent = float(np.abs(points - middle).max()) or 1.0
    aspect = viewpoint.width / viewpoint.height
    seen = MARGIN * slope
    if viewpoint.orthographic:
        half = max(float(np.abs(y).max()), float(np.abs(x).max()) / aspect, 1e-9 * extent) / MARGIN
        return middle - axes[2] * 4 * extent, axes, viewpoint.height / (2 * half)
    distances = np.maximum(np.abs(x) / (seen * aspect), np.abs(y) / seen) - depth
    distance = max(float(distances.max()), 1e-9 * extent)
    return middle - axes[2] * distance, axes, viewpoint.height / (2 * slope)


def _find_axes(direction: FloatArray, azimuth: float = 0.0) -> FloatArray:
    """Right, up and forward of a camera that looks along a direction, with y up in the picture.

    A camera that looks straight up or down has the azimuth that it is given.
    """
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    flat = hypot(x, z)
    right = np.array([cos(azimuth), 0.0, -sin(azimuth)])
    if flat > 1e-9:
        right = np.array([-z / flat, 0.0, x / flat])
    forward = np.array([x, y, z])
    return np.stack([right, np.cross(right, forward), forward])
