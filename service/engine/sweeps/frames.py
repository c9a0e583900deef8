"""Rotation-minimising frames along curves: normals that do not turn about the curve.

Every step from one sample to the next is a rotation, composed of two reflections: the first maps
one point to the next, the second then maps the reflected tangent to the next tangent. The error of
the normals along a whole curve is of fourth order in the step.

Wang, Jüttler, Zheng and Liu, Computation of rotation minimizing frames, ACM TOG 27(1), 2008.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.vectors import cross, dot, normalize

NO_PLANE = 1e-18
"""Vectors of smaller squared lengths count as zero: they have no plane of reflection. The unit is
the longest step, or a unit tangent."""


def compute_frames(
    points: FloatArray, tangents: FloatArray, fractions: FloatArray, *, closed: bool
) -> FloatArray:
    """Compute a unit normal at every sample of K curves; normals rotate least about the curve.

    At the end of a closed curve, the normal would differ from the first normal by some angle. The
    opposite rotation is distributed evenly over the length, so that both normals are equal.

    Parameters
    ----------
    points, tangents : ndarray of float64, shape (K, m, 3)
        Points may repeat, tangents have unit length. A closed curve ends where it begins.
    fractions : ndarray of float64, shape (K, m)
        Length up to each sample as a fraction of the length of the curve, 0 to 1.

    Returns
    -------
    ndarray of float64, shape (K, m, 3)
        Perpendicular to the tangents.
    """
    first = find_perpendicular(tangents[:, 0])
    if not closed:
        return _transport(points, tangents, first)
    # One more step, from the last sample to the first: both are one point, but at a corner their
    # tangents differ, and normals can be compared only about the same tangent.
    points = np.concatenate([points, points[:, :1]], axis=1)
    tangents = np.concatenate([tangents, tangents[:, :1]], axis=1)
    normals = _transport(points, tangents, first)
    last, axis = normals[:, -1], tangents[:, 0]
    twist = np.arctan2(dot(cross(first, last, -1), axis, -1), dot(first, last, -1))
    angle = -twist[:, None] * fractions
    normals, tangents = normals[:, :-1], tangents[:, :-1]
    across = cross(tangents, normals, -1)
    return np.cos(angle)[..., None] * normals + np.sin(angle)[..., None] * across


def fill_gaps(vectors: FloatArray, is_defined: Bools) -> FloatArray:
    """Vectors (K, m, 3); those that are not defined become the last before, or the first after."""
    number = np.where(is_defined, np.arange(vectors.shape[1]), -1)
    last_defined = np.maximum.accumulate(number, axis=1)
    source = np.where(last_defined >= 0, last_defined, is_defined.argmax(axis=1)[:, None])
    return np.take_along_axis(vectors, source[..., None], axis=1)


def find_perpendicular(vectors: FloatArray) -> FloatArray:
    """A unit vector perpendicular to each vector (…, 3): the perpendicular part of an axis."""
    return _find_normal_parts(np.eye(3)[np.abs(vectors).argmin(axis=-1)], vectors)


def _transport(points: FloatArray, tangents: FloatArray, first: FloatArray) -> FloatArray:
    """The normals at all samples, from the first normals (K, 3): shape (K, m, 3)."""
    turns = np.zeros((*points.shape[:2], 4))
    turns[:, 0, 0] = 1.0
    turns[:, 1:] = _steps(points, tangents)
    # The products of the first i rotations, for all i: each pass doubles the number of factors.
    span = 1
    while span < turns.shape[1]:
        turns[:, span:] = _multiply(turns[:, span:], turns[:, :-span])
        span *= 2
    return _find_normal_parts(_rotate(normalize(turns, -1), first[:, None]), tangents)


def _steps(points: FloatArray, tangents: FloatArray) -> FloatArray:
    """The rotation of every step as a unit quaternion (real part, vector part): (K, m−1, 4).

    Where a plane of reflection is not defined, the rotation is the least from tangent to tangent.
    """
    tangents_before, tangents_after = tangents[:, :-1], tangents[:, 1:]
    chord = np.diff(points, axis=1)
    # Relative to the longest step, because squares of small lengths may underflow.
    size = np.abs(chord).max(axis=(1, 2), keepdims=True)
    chord = chord / np.where(size > 0, size, 1.0)
    squared_lengths = dot(chord, chord, -1)
    lacks_plane: Bools = squared_lengths <= NO_PLANE
    # The unit normals of both planes of reflection.
    first = chord / np.sqrt(np.where(lacks_plane, 1.0, squared_lengths))[..., None]
    reflected_tangents = tangents_before - 2 * dot(first, tangents_before, -1)[..., None] * first
    second = tangents_after - reflected_tangents
    squared_lengths = dot(second, second, -1)
    lacks_plane |= squared_lengths <= NO_PLANE
    second = second / np.sqrt(np.where(lacks_plane, 1.0, squared_lengths))[..., None]
    # Two reflections one after the other are the rotation with this quaternion.
    turns = np.concatenate([-dot(second, first, -1)[..., None], cross(second, first, -1)], axis=-1)
    if lacks_plane.any():
        turns[lacks_plane] = _find_least_rotations(
            tangents_before[lacks_plane], tangents_after[lacks_plane]
        )
    return turns


def _find_least_rotations(first: FloatArray, second: FloatArray) -> FloatArray:
    """The least rotations that take some unit vectors to others, as quaternions: (M, 4)."""
    turns = np.concatenate(
        [1.0 + dot(first, second, -1)[:, None], cross(first, second, -1)], axis=-1
    )
    # The real part is 1 + cos of the angle: near 0 for opposite vectors, which take a half turn.
    is_opposite = turns[:, 0] < NO_PLANE
    turns[is_opposite, 0], turns[is_opposite, 1:] = (
        0.0,
        find_perpendicular(first[is_opposite]),
    )
    return normalize(turns, -1)


def _multiply(second: FloatArray, first: FloatArray) -> FloatArray:
    """Quaternion products: first the rotations `first`, then the rotations `second`."""
    # The real parts a, b and the vector parts u, v.
    a, u, b, v = second[..., :1], second[..., 1:], first[..., :1], first[..., 1:]
    real_part = a * b - dot(u, v, -1)[..., None]
    return np.concatenate([real_part, a * v + b * u + cross(u, v, -1)], axis=-1)


def _rotate(turns: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors v after the rotations by quaternions (w, u): v + 2 u × (u × v + w v)."""
    u = turns[..., 1:]
    v = np.broadcast_to(vectors, u.shape)
    return v + 2 * cross(u, cross(u, v, -1) + turns[..., :1] * v, -1)


def _find_normal_parts(vectors: FloatArray, tangents: FloatArray) -> FloatArray:
    """The parts of vectors that are perpendicular to the tangents, with unit length."""
    return normalize(vectors - dot(vectors, tangents, -1)[..., None] * tangents, -1)
