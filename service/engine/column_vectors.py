"""Products of vectors that are the columns of arrays (3, N)."""

import numpy as np

from service.bases.arrays import FloatArray


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross products a × b of columns, shape (3, N)."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=product[k])
        product[k] -= a[j] * b[i]
    return product


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """The dot products a · b of columns, shape (N,); terms are added in a fixed order."""
    total = a[0] * b[0]
    total += a[1] * b[1]
    total += a[2] * b[2]
    return np.asarray(total)


def length(a: FloatArray) -> FloatArray:
    """The lengths |a| of columns, shape (N,)."""
    return np.asarray(np.sqrt(dot(a, a)))
