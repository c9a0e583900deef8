"""The matrix products that compute the samples of several patches on one grid.

r patches are computed together, in d coordinates: 3, or 4 for rational patches. Each patch has K
vectors: its control points, their differences along u, and those along v, in this order.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from service.bases.arrays import RealArray
from service.bases.bernstein import sample_basis, sample_basis_columns, sample_partials_basis
from service.engine.evaluation.chunks import PRECISE_SHARE
from service.engine.scratch import Real


def count_vectors(degree: tuple[int, int]) -> tuple[int, int, int]:
    """The numbers of control points of a patch, and of their differences along u and along v."""
    p, q = degree
    return (p + 1) * (q + 1), p * (q + 1), (p + 1) * q


Products: TypeAlias = list[list[tuple[RealArray, RealArray, RealArray]]]
"""For each of S, S_u and S_v, a list of products: the two matrices to multiply, and the output."""


def plan_whole_products(
    rows: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """For each of S, S_u and S_v, one product of its vectors with the basis of all samples.

    Parameters
    ----------
    rows : ndarray, shape (K, d r)
        Row k has vector k of all patches.
    results : three arrays, shape (d, r, samples)
        The outputs for S, S_u and S_v.
    """
    basis = sample_partials_basis(degree, resolution, rows.dtype.type)
    ends = np.cumsum(count_vectors(degree))[:-1]
    parts = zip(np.split(rows, ends), np.split(basis, ends), results, strict=True)
    return [[(net.T, values, out.reshape(-1, basis.shape[1]))] for net, values, out in parts]


def plan_separable_products(
    transposed: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """For each of S, S_u and S_v, two products: along u, then of the result along v.

    Parameters
    ----------
    transposed : ndarray, shape (d r, K)
        Column k has vector k of all patches.
    results : three arrays, shape (d, r, samples)
        The outputs for S, S_u and S_v.
    """
    (p, q), (ru, rv), dtype = degree, resolution, transposed.dtype.type
    u, u_lower = (sample_basis(n, ru, dtype) for n in (p, p - 1))
    v, v_lower = (sample_basis_columns(n, rv, dtype) for n in (q, q - 1))
    bases = ((u, v), (u_lower, v), (u, v_lower))
    nets = np.split(transposed, np.cumsum(count_vectors(degree))[:-1], axis=1)
    products: Products = []
    for net, (along_u, along_v), out in zip(nets, bases, results, strict=True):
        # One matrix for each coordinate of each patch: rows follow each other along u, columns
        # along v.
        matrices = net.reshape(-1, along_u.shape[1], len(along_v))
        curves = np.empty((len(matrices), ru + 1, len(along_v)), dtype)
        second = curves.reshape(-1, len(along_v)), along_v, out.reshape(-1, rv + 1)
        products.append([(along_u, matrices, curves), second])
    return products


def build_means(degree: tuple[int, int], dtype: Real) -> RealArray:
    """A matrix (2, differences) whose product with squares of differences gives two means.

    These are the mean squares of the differences along u and along v, times `PRECISE_SHARE`. Their
    product is the least |S_u × S_v|² that is precise enough.
    """
    _, along_u, along_v = count_vectors(degree)
    means = np.zeros((2, along_u + along_v), dtype)
    means[0, :along_u] = PRECISE_SHARE[dtype] / along_u
    means[1, along_u:] = PRECISE_SHARE[dtype] / along_v
    return means
