"""What polynomial patches of low degree bend between the samples of a grid, by one product.

The bound is that of `service.engine.deviation.bends`, block by block:

    ⅛ (h_u² p (p−1) max |Δ_u² P| + 2 h_u h_v p q max |Δ_u Δ_v P| + h_v² q (q−1) max |Δ_v² P|)

All vectors in it are linear in the control points, so that one matrix, with the factors in it,
makes all of them for all blocks of all patches.
"""

from itertools import accumulate, pairwise

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.cache import PLANS
from service.bases.chunks import chunks
from service.engine.deviation.bends import across, blocks_along, shares
from service.surface.batches import TensorPatches

LARGEST = 1 << 14
"""Numbers of a third of the matrix up to which one product is faster than several."""

CHUNK = 1 << 17
"""Numbers that are worked on at a time: they fit the second-level cache."""

ORDERS = ((2, 0), (1, 1), (0, 2))
"""How often differences are taken along u and along v."""


def is_small(patches: TensorPatches, divisions: tuple[int, int]) -> bool:
    """Whether one product is the faster way; rational patches always need several."""
    p, q = patches.degree
    blocks = blocks_along(divisions[0], p) * blocks_along(divisions[1], q)
    return patches.weights is None and blocks * ((p + 1) * (q + 1)) ** 2 <= LARGEST


def bend(patches: TensorPatches, divisions: tuple[int, int]) -> FloatArray:
    """How far patches are at most from triangles between their points at R_u × R_v divisions: (P,).

    Parameters
    ----------
    patches : TensorPatches
        P polynomial patches of degree (p, q).
    divisions : (R_u, R_v)
        Triangles lie in boxes of sides h = 1/R.
    """
    p, q = patches.degree
    counts = [max(p + 1 - i, 0) * max(q + 1 - j, 0) for i, j in ORDERS]
    blocks = blocks_along(divisions[0], p), blocks_along(divisions[1], q)
    key = ("second differences", (p, q), divisions)
    matrix = PLANS.array(key, lambda: _second_differences((p, q), divisions, blocks))
    diagonal, found = across(patches), np.empty(patches.count)
    for rows in chunks(patches.count, 3 * len(matrix) + 1, CHUNK):
        points = patches.points[rows].reshape(-1, (p + 1) * (q + 1), 3) - patches.middle
        vectors = matrix @ points.transpose(2, 1, 0)
        np.multiply(vectors, vectors, out=vectors)
        squares = vectors[0]
        squares += vectors[1]
        squares += vectors[2]
        squares = squares.reshape(-1, blocks[0] * blocks[1], len(points))
        bounds = np.zeros(squares.shape[1:])
        for first, last in pairwise(accumulate(counts, initial=0)):
            if last > first:
                bounds += np.sqrt(squares[first:last].max(axis=0))
        np.minimum(bounds.max(axis=0), diagonal, out=found[rows])
    return found


def _second_differences(
    degree: tuple[int, int], divisions: tuple[int, int], blocks: tuple[int, int]
) -> FloatArray:
    """Rows (vector, block u, block v) for nets of (p + 1)(q + 1) points; kind after kind."""
    kinds = []
    for i, j in ORDERS:
        rows = _differences(degree[0], i, divisions[0], blocks[0])
        columns = _differences(degree[1], j, divisions[1], blocks[1])
        products = np.einsum("iak,jbl->ijabkl", rows, columns) * (2 if i == j else 1) / 8
        kinds.append(products.reshape(-1, (degree[0] + 1) * (degree[1] + 1)))
    return np.concatenate(kinds)


def _differences(degree: int, order: int, divisions: int, blocks: int) -> FloatArray:
    """h^k n!/(n−k)! Δ^k over every block of n + 1 points, k the order: rows (point, block)."""
    if order > degree:
        return np.empty((0, blocks, degree + 1))
    factor = (1.0, degree, degree * (degree - 1))[order] / divisions**order
    rows = shares(degree - order, divisions, blocks) @ np.diff(np.eye(degree + 1), order, axis=0)
    scaled: FloatArray = factor * rows.reshape(-1, blocks, degree + 1)
    return scaled
