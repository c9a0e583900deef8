"""Lines in pictures, as narrow triangles that face the eye and are a little in front."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints
from service.engine.pictures.camera import PictureCamera

NEARER = 2.0
"""How many pixels lines are nearer to the eye than they are, so that their surface does not hide
them: mesh and lines are a quarter of a pixel from the surface."""


@dataclass(frozen=True, eq=False, slots=True)
class ScreenTriangles:
    """Triangles (T, 3) of vertices with homogeneous coordinates (3, V) and depths (V,)."""

    corners: FloatArray
    depths: FloatArray
    triangles: Ints


def draw_lines(
    camera: PictureCamera, positions: FloatArray, segments: IndexArray, width: float
) -> ScreenTriangles:
    """Segments (L, 2) between positions (V, 3) as two triangles each, `width` pixels wide."""
    ends = positions[segments]
    depth = (ends - camera.eye) @ camera.axes[2]
    # The part behind the eye is cut off.
    near = 1e-6 * np.abs(depth).max(initial=0.0)
    kept = (depth > near).any(axis=1)
    ends, depth = ends[kept], depth[kept]
    span = np.where(depth[:, 1] == depth[:, 0], 1.0, depth[:, 1] - depth[:, 0])
    for end in range(2):
        behind = depth[:, end] < near
        share = ((near - depth[:, end]) / (span if end == 0 else -span))[:, np.newaxis]
        moved = ends[:, end] + share * (ends[:, 1 - end] - ends[:, end])
        ends[:, end] = np.where(behind[:, np.newaxis], moved, ends[:, end])
    first, second = (camera.place(ends[:, end]) for end in range(2))
    (a, depth_a), (b, depth_b) = first, second
    along = b[:2] / b[2] - a[:2] / a[2]
    lengths = np.hypot(*along)
    along = np.where(lengths > 0, along / np.where(lengths > 0, lengths, 1.0), [[1.0], [0.0]])
    along *= width / 2
    across = np.stack([-along[1], along[0]])
    corners, depths = [], []
    for point, at, sign in ((a, depth_a, -1.0), (b, depth_b, 1.0)):
        for side in (-1.0, 1.0):
            moved = point.copy()
            moved[:2] += (sign * along + side * across) * point[2]
            corners.append(moved)
            pixel = np.full_like(at, 1 / camera.focus) if camera.orthographic else at / camera.focus
            depths.append(np.maximum(at - NEARER * pixel, at / 2))
    count = len(lengths)
    number = np.arange(count, dtype=np.intp)
    triangles = [
        np.stack([number + k * count for k in each], axis=1) for each in ((0, 1, 2), (2, 1, 3))
    ]
    return ScreenTriangles(
        np.concatenate(corners, axis=1), np.concatenate(depths), np.concatenate(triangles)
    )
