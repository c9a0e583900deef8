"""The matrix products that compute the samples of several patches on one grid."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from service.bases.arrays import RealArray
from service.bases.bernstein import sample_basis, sample_basis_columns, sample_partials_basis
from service.engine.evaluation.chunks import TRUSTED
from service.engine.scratch import Real


def count_vectors(degree: tuple[int, int]) -> tuple[int, int, int]:
    """Control points of a patch, and their differences along u and along v."""
    p, q = degree
    return (p + 1) * (q + 1), p * (q + 1), (p + 1) * q


Products: TypeAlias = list[list[tuple[RealArray, RealArray, RealArray]]]
"""For each of S, S_u and S_v: the pairs of matrices to multiply, and the output."""


def plan_whole_products(
    rows: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """All samples by one product of the vectors (K, d r) with the basis of all samples."""
    basis = sample_partials_basis(degree, resolution, rows.dtype.type)
    ends = np.cumsum(count_vectors(degree))[:-1]
    parts = zip(np.split(rows, ends), np.split(basis, ends), results, strict=True)
    return [[(net.T, values, out.reshape(-1, basis.shape[1]))] for net, values, out in parts]


def plan_separable_products(
    turned: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """All samples by a product along u, then one along v, of the vectors (d r, K)."""
    (p, q), (ru, rv), dtype = degree, resolution, turned.dtype.type
    u, u_below = (sample_basis(n, ru, dtype) for n in (p, p - 1))
    v, v_below = (sample_basis_columns(n, rv, dtype) for n in (q, q - 1))
    bases = ((u, v), (u_below, v), (u, v_below))
    nets = np.split(turned, np.cumsum(count_vectors(degree))[:-1], axis=1)
    products: Products = []
    for net, (along_u, along_v), out in zip(nets, bases, results, strict=True):
        planes = net.reshape(-1, along_u.shape[1], len(along_v))
        curves = np.empty((len(planes), ru + 1, len(along_v)), dtype)
        second = curves.reshape(-1, len(along_v)), along_v, out.reshape(-1, rv + 1)
        products.append([(along_u, planes, curves), second])
    return products


def build_means(degree: tuple[int, int], dtype: Real) -> RealArray:
    """Factors (2, differences) that give the mean squares of differences along u and along v.

    The means are multiplied by `TRUSTED`.
    """
    _, along_u, along_v = count_vectors(degree)
    means = np.zeros((2, along_u + along_v), dtype)
    means[0, :along_u] = TRUSTED[dtype] / along_u
    means[1, along_u:] = TRUSTED[dtype] / along_v
    return means
