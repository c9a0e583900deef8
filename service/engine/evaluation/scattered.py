"""Unit normals at arbitrary parameters of arbitrary patches of a model."""

from collections.abc import Iterator, Sequence

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.evaluation.normals import unit_normals
from service.engine.evaluation.triangle_normals import triangle_normals
from service.surface.batches import Patches, TrianglePatches


def group_by_batch(batches: Sequence[Patches], patch: Ints) -> Iterator[tuple[Patches, int, Ints]]:
    """Yields the batches that contain some of the patches (N,), numbered over all batches.

    For each batch it yields the batch, the number of its first patch, and which rows (m,) of
    `patch` are in the batch.
    """
    first = np.cumsum([0, *(batch.count for batch in batches)])
    batch_numbers = np.searchsorted(first, patch, side="right") - 1
    order = np.argsort(batch_numbers, kind="stable")
    ends = np.searchsorted(batch_numbers[order], np.arange(len(batches) + 1))
    for batch_number, batch in enumerate(batches):
        rows = order[ends[batch_number] : ends[batch_number + 1]]
        if len(rows):
            yield batch, int(first[batch_number]), rows


def evaluate_scattered_normals(
    batches: Sequence[Patches], patch: Ints, u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals (N, 3) at parameters of patches, and how many of them are limits.

    A triangle has the parameters (u, v) of a tensor-product patch whose side v = 1 is one point:
    s = u (1 − v), t = v.
    """
    normals = np.empty((len(patch), 3))
    total_limits = 0
    for batch, first, rows in group_by_batch(batches, patch):
        index, u_of_batch, v_of_batch = patch[rows] - first, u[rows], v[rows]
        if isinstance(batch, TrianglePatches):
            normals[rows], limit_count = triangle_normals(
                batch, index, u_of_batch * (1.0 - v_of_batch), v_of_batch
            )
        else:
            normals[rows], limit_count = unit_normals(batch, index, u_of_batch, v_of_batch)
        total_limits += limit_count
    return normals, total_limits
