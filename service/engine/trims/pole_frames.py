"""Surfaces near their poles: the directions in which they leave them, and the angle of a point.

Near a pole P, where v = 0, S(u, v) ≈ P + v D(u) with D(u) = S_v(u, 0). D runs around an ellipse, or
nearly. In the metric in which the ellipse is a circle, u is about the angle around the pole.

At a cusp, such as the point where a torus touches its axis, D has one direction only. There the
chords from P to the middle of the surface take its place: they run around the axis.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.closure import ClosedSurfaces
from service.engine.vectors import dot, length

RAYS = 64
"""Directions around a pole."""

CUSP = 1e-6
"""A pole is a cusp if its rays, added, are shorter by at most this share than their lengths."""

FLAT = 1e-8
"""The square of the least ratio of the axes of an ellipse of directions."""


@dataclass(frozen=True, eq=False, slots=True)
class PoleFrames:
    """The poles of n faces on the side where the parameter `axis` is least (`end` 0) or greatest.

    Attributes
    ----------
    axis, end : int
    points : ndarray of float64, shape (n, 3)
    sides : ndarray of float64, shape (n,)
        The parameter of the side.
    angles : ndarray of float64, shape (n, RAYS)
        Values of the other parameter.
    rays : ndarray of float64, shape (n, RAYS, 3)
        ± S_v at these: into the surface. At a cusp, chords of the surface.
    """

    axis: int
    end: int
    points: FloatArray
    sides: FloatArray
    angles: FloatArray
    rays: FloatArray

    @classmethod
    def of(cls, surfaces: ClosedSurfaces, face: Ints, axis: int, end: int) -> "PoleFrames":
        """The poles of faces (n,)."""
        used, row = np.unique(face, return_inverse=True)
        side = (surfaces.surfaces.high if end else surfaces.low)[used, axis]
        shares = (np.arange(RAYS) + 0.5) / RAYS
        low, period = surfaces.low[used, 1 - axis], surfaces.period[used, 1 - axis]
        angles = low[:, np.newaxis] + period[:, np.newaxis] * shares
        parameters = np.empty((len(used), RAYS, 2))
        parameters[..., axis], parameters[..., 1 - axis] = side[:, np.newaxis], angles
        # Not wrapped: the greatest parameter of a side is no other place.
        run = np.repeat(used, RAYS)
        partials = surfaces.surfaces.evaluate_partials(run, parameters.reshape(-1, 2))
        rays = partials[1 + axis].reshape(-1, RAYS, 3) * (-1.0 if end else 1.0)
        points = surfaces.pole_points[used, axis, end]
        cusps = _find_cusps(rays)
        if len(cusps):
            half = surfaces.period[used[cusps], axis][:, np.newaxis] / 2
            parameters[cusps, :, axis] += -half if end else half
            middles = surfaces.surfaces.evaluate(
                np.repeat(used[cusps], RAYS), parameters[cusps].reshape(-1, 2)
            )
            chords = middles.reshape(-1, RAYS, 3) - points[cusps, np.newaxis]
            rays[cusps] = chords / half[..., np.newaxis]
        return cls(axis, end, points[row], side[row], angles[row], rays[row])

    def find_metrics(self) -> FloatArray:
        """Matrices (n, 3, 3) after which directions are a circle about the pole, approximately."""
        moments = np.einsum("nki,nkj->nij", self.rays, self.rays) / RAYS
        size = np.einsum("nii->n", moments)
        moments[size == 0] = np.eye(3)
        values, vectors = np.linalg.eigh(moments)
        # Ascending: that of the normal of the surface becomes as large as the largest one.
        largest = values[:, 2]
        scales = np.stack([largest, np.maximum(values[:, 1], FLAT * largest), largest], axis=1)
        metrics: FloatArray = vectors.swapaxes(1, 2) / np.sqrt(scales)[..., np.newaxis]
        return metrics

    def guess(self, points: FloatArray) -> FloatArray:
        """Parameters (n, 2) of the point of a ray that is nearest to each point (n, 3)."""
        rest = (points - self.points)[:, np.newaxis]
        square = dot(self.rays, self.rays, -1)
        along = np.maximum(dot(self.rays, rest, -1), 0.0) / np.where(square > 0, square, np.inf)
        apart = rest - along[..., np.newaxis] * self.rays
        nearest = dot(apart, apart, -1).argmin(axis=1)
        every = np.arange(len(points))
        found = np.empty((len(points), 2))
        found[:, self.axis] = self.sides + along[every, nearest] * (-1.0 if self.end else 1.0)
        found[:, 1 - self.axis] = self.angles[every, nearest]
        return found


def _find_cusps(rays: FloatArray) -> Ints:
    """The poles whose rays (n, RAYS, 3) all have one direction."""
    total = length(rays.sum(axis=1), -1)
    cusps: Ints = (total > (1.0 - CUSP) * length(rays, -1).sum(axis=1)).nonzero()[0]
    return cusps
