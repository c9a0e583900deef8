"""Vectors of space as arrays of shape (3, m), one component after another."""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray

Vectors: TypeAlias = FloatArray
"""Shape (3, m)."""


def dot(a: Vectors, b: Vectors) -> FloatArray:
    """Products a · b, shape (m,)."""
    product: FloatArray = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def dots(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products a · b of vectors (…, 3, m), shape (…, m)."""
    product: FloatArray = a[..., 0, :] * b[..., 0, :]
    product += a[..., 1, :] * b[..., 1, :]
    product += a[..., 2, :] * b[..., 2, :]
    return product


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Products a × b, shape (3, m)."""
    product = np.empty_like(a)
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
    return product


def length(a: Vectors) -> FloatArray:
    """Lengths |a|, shape (m,)."""
    size: FloatArray = np.sqrt(dot(a, a))
    return size
