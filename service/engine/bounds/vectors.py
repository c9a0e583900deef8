"""Vectors of space as arrays of shape (…, 3, m), one component after another."""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray

Vectors: TypeAlias = FloatArray
"""Shape (…, 3, m)."""


def dot(a: Vectors, b: Vectors) -> FloatArray:
    """Products a · b, shape (…, m)."""
    product: FloatArray = a[..., 0, :] * b[..., 0, :]
    product += a[..., 1, :] * b[..., 1, :]
    product += a[..., 2, :] * b[..., 2, :]
    return product


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Products a × b, shape (…, 3, m)."""
    product = np.empty_like(a)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        product[..., k, :] = a[..., i, :] * b[..., j, :] - a[..., j, :] * b[..., i, :]
    return product


def length(a: Vectors) -> FloatArray:
    """Lengths |a|, shape (…, m)."""
    size: FloatArray = np.sqrt(dot(a, a))
    return size
