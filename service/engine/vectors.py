"""Products of vectors and of vector polynomials."""

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.bases.bernstein import multiply


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b along the last axis, faster than numpy.cross."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(a.shape)
    np.subtract(ay * bz, az * by, out=product[..., 0])
    np.subtract(az * bx, ax * bz, out=product[..., 1])
    np.subtract(ax * by, ay * bx, out=product[..., 2])
    return product


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Scalar products of rows (m, d): shape (m,)."""
    product: FloatArray = np.einsum("mk,mk->m", a, b)
    return product


def find_largest_angle(faces: IndexArray, normals: RealArray) -> float | None:
    """Largest angle, in radians, between the unit normals at the two ends of an edge of the faces.

    The result is None if there are no faces. The angle is computed from the tangent of its half,
    because the cosine is imprecise for small angles.
    """
    if not len(faces):
        return None
    largest = 0.0
    for corner in range(faces.shape[1]):
        first, second = normals[faces[:, corner - 1]], normals[faces[:, corner]]
        difference, total = (
            np.square(rows).sum(axis=1) for rows in (first - second, first + second)
        )
        largest = max(largest, float(np.arctan2(np.sqrt(difference), np.sqrt(total)).max()))
    return 2 * largest


def cross_polynomial(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b of vector polynomials (K, 3, …), K patches, in the Bernstein basis."""
    product = multiply(a[:, (1, 2, 0)], b[:, (2, 0, 1)])
    product -= multiply(a[:, (2, 0, 1)], b[:, (1, 2, 0)])
    return product
