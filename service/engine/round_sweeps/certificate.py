"""Bounds of the distance between the round tube, or the smooth ribbon, and the rows of a mesh.

Between two rows, the surface, the lines between both rows, the strips of their polygons and the
triangles of the mesh are compared one after the other:

    |lines of the surface − chords| + w r (1 − cos π/n) + |strips − triangles| + rounding

with w the factor by which rings of mitres are wider. Each term holds in both directions.

Proofs in docs/proofs.md: "Strips of two triangles", "Turned rings" and "Round tubes".
"""

from math import cos, pi

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.bases.row_batches import row_slices
from service.engine.round_sweeps.bends import MARGIN
from service.engine.round_sweeps.frames_of_cells import CellFrames
from service.engine.sweeps.frames import compute_frames
from service.engine.vectors import UNIT, cross, dot, length

CHUNK = 1 << 16
"""Quads that are compared at once."""


def measure_strips(
    positions: FloatArray, has_faces: Bools, folds: Bools | None = None
) -> FloatArray:
    """How far the bilinear strips between rows are from their two triangles each: (m−1,).

    Let a, b, c, d be the corners of a strip, in order around it, and h the distance of c from the
    plane of a, b and d, with the foot c′. If a, b, c′ and d are convex, the bound is

        h / (1 + √q)²,  q = area(b, c′, d) / area(a, b, d)

    or |a − b + c − d| / 4 if that is less; if they are not convex, it is the second. A strip with
    two equal corners is a triangle.

    Parameters
    ----------
    positions : ndarray of float64, shape (m, columns, 3)
    has_faces : ndarray of bool, shape (m−1,)
    folds : ndarray of bool, shape (m−1, columns−1), optional
        Strips that the mesh divides where they fold (`divide_folds`): they are flat.
    """
    largest = np.zeros(len(positions) - 1)
    rows = np.flatnonzero(has_faces)
    for part in row_slices(len(rows), positions.shape[1], CHUNK):
        chosen = rows[part]
        low, high = positions[chosen], positions[chosen + 1]
        a, b, c, d = low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]
        sides = b - a, c - b, d - c, a - d
        normal = cross(sides[0], sides[3], -1)  # turned round, as all products below
        size = length(normal, -1)
        height = np.abs(dot(c - a, normal, -1)) / np.where(size > 0, size, 1.0)
        is_convex = size > 0
        for k in range(4):
            products = dot(cross(sides[k], sides[k - 1], -1), normal, -1)
            is_convex &= products > 0
            if k == 2:
                ratio = products / np.where(size > 0, size, 1.0) ** 2
        height /= (1 + np.sqrt(np.maximum(ratio, 0.0))) ** 2
        twist = length(sides[0] + sides[2], -1) / 4
        bound = np.where(is_convex, np.minimum(height, twist), twist)
        for side in sides:
            bound[(side == 0).all(axis=-1)] = 0.0
        if folds is not None:
            bound[folds[chosen]] = 0.0
        largest[chosen] = bound.max(axis=1)
    return largest * MARGIN


def measure_twists(frames: CellFrames) -> FloatArray:
    """How far the rings of two frames are turned against each other at most: (m−1,).

    This is the angle between the second normal and the first after the least rotation of the
    tangents; and rotation-minimising frames turn by at most θ tan(θ/2) against the least rotation,
    if the path turns by θ (`bound_tube_lines` adds this).
    """
    paths = frames.paths
    normals = compute_frames(paths.points, paths.tangents, paths.fractions, closed=paths.closed)[0]
    tangents = paths.tangents[0]
    first, second = tangents[:-1], tangents[1:]
    size = 1.0 + dot(first, second, -1)
    share = dot(normals[:-1], second, -1) / np.maximum(size, UNIT)
    turned = normals[:-1] - share[:, None] * (first + second)
    sine, cosine = length(cross(turned, normals[1:], -1), -1), dot(turned, normals[1:], -1)
    twist: FloatArray = np.arctan2(sine, cosine) + 64 * UNIT
    return twist


def find_sagitta(sides: int) -> float:
    """1 − cos(π/n): how far a circle of radius 1 is from its regular polygon of n sides."""
    return (1.0 - cos(pi / sides)) * MARGIN + UNIT
