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
    """Largest angle of the unit normals at two vertices that an edge joins; None without edges.

    It is computed from the tangent of half of the angle, because the cosine is imprecise for small
    angles.
    """
    if not len(faces):
        return None
    largest = 0.0
    for corner in range(faces.shape[1]):
        one, other = normals[faces[:, corner - 1]], normals[faces[:, corner]]
        difference, total = (np.square(rows).sum(axis=1) for rows in (one - other, one + other))
        largest = max(largest, float(np.arctan2(np.sqrt(difference), np.sqrt(total)).max()))
    return 2 * largest


def cross_polynomial(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b of vector polynomials (K, 3, …) in the Bernstein basis."""
    first = multiply(a[:, (1, 2, 0)], b[:, (2, 0, 1)])
    first -= multiply(a[:, (2, 0, 1)], b[:, (1, 2, 0)])
    return first
