"""Placements as fields of glTF nodes.

A glTF node can translate, rotate and scale (3.5.3), but it cannot shear. By the singular value
decomposition L = U S Vᵀ, any linear map is a rotation after a scaling after a rotation. So a node
with shear has the rotation U and the scaling S, and its child has the rotation Vᵀ. A mirror image
has a negative scaling; readers then reverse the winding of its faces (3.7.4).

References
----------
Khronos, glTF 2.0 Specification: 3.5 nodes and transformations, 3.7.4 instantiation.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.gltf.buffer import JsonObject
from service.surface.placement import is_mirroring

NEGLIGIBLE = 1e-12
"""Columns whose cosine is at most this count as perpendicular, and a scaling that differs from 1 by
at most this counts as 1. Rounding errors are about 1e-16."""


def split_matrix(matrix: FloatArray | None) -> tuple[JsonObject, JsonObject]:
    """Split an affine matrix into the fields of a node, and of its child node if there is shear.

    The fields are `translation`, `rotation` and `scale`. None stands for the identity. Without
    shear, the second result is empty.
    """
    return split_matrices([matrix])[0]


def split_matrices(
    matrices: Sequence[FloatArray | None],
) -> list[tuple[JsonObject, JsonObject]]:
    """The results of `split_matrix` for many matrices."""
    fields: list[tuple[JsonObject, JsonObject]] = [({}, {})] * len(matrices)
    given = [number for number, matrix in enumerate(matrices) if matrix is not None]
    if not given:
        return fields
    stack = np.array([matrices[number] for number in given])
    shifts, linear = stack[:, :3, 3], np.ascontiguousarray(stack[:, :3, :3])
    diagonals = np.diagonal(linear, axis1=1, axis2=2)
    off_diagonal = linear - diagonals[:, np.newaxis] * np.eye(3)
    is_diagonal = ~np.asarray(off_diagonal.any(axis=(1, 2)), np.bool_)
    # If the columns are perpendicular, linear = turn · diag(lengths).
    lengths = np.sqrt((linear**2).sum(axis=1))
    lengths[np.linalg.det(linear) < 0] *= -1
    turns = linear / lengths[:, np.newaxis]
    errors = np.abs(turns.swapaxes(1, 2) @ turns - np.eye(3)).max(axis=(1, 2))
    is_sheared = (errors > NEGLIGIBLE) & ~is_diagonal
    lengths[is_diagonal] = diagonals[is_diagonal]
    is_scaled = np.asarray(np.abs(lengths - 1).max(axis=1) > NEGLIGIBLE, np.bool_)
    is_shifted = np.asarray(shifts.any(axis=1), np.bool_)
    columns = zip(
        given,
        shifts.tolist(),
        is_shifted.tolist(),
        quaternions(turns).tolist(),
        is_diagonal.tolist(),
        lengths.tolist(),
        is_scaled.tolist(),
        strict=True,
    )
    for number, shift, has_shift, turn, is_straight, scale, has_scale in columns:
        node: JsonObject = {"translation": shift} if has_shift else {}
        if not is_straight:
            node["rotation"] = turn
        if has_scale:
            node["scale"] = scale
        fields[number] = node, {}
    for place in np.flatnonzero(is_sheared).tolist():
        outer, inner = _split_shear(linear[place])
        if is_shifted[place]:
            outer = {"translation": shifts[place].tolist()} | outer
        fields[given[place]] = outer, inner
    return fields


def _split_shear(linear: FloatArray) -> tuple[JsonObject, JsonObject]:
    """The fields of two nodes whose product is a linear map with shear."""
    # linear = left · diag(scale) · right, where `left` and `right` may mirror at first.
    left, scale, right = np.linalg.svd(linear)
    if is_mirroring(left):
        left, scale = -left, -scale
    if is_mirroring(right):
        right, scale = -right, -scale
    outer: JsonObject = {"rotation": quaternion(left)}
    if np.abs(scale - 1).max() > NEGLIGIBLE:
        outer["scale"] = scale.tolist()
    return outer, {"rotation": quaternion(right)}


def quaternion(turn: FloatArray) -> list[float]:
    """The unit quaternion (x, y, z, w) of a rotation matrix (3, 3)."""
    unit: list[float] = quaternions(turn[np.newaxis])[0].tolist()
    return unit


def quaternions(turns: FloatArray) -> FloatArray:
    """The unit quaternions (x, y, z, w) of rotation matrices (N, 3, 3).

    References
    ----------
    Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1(3), 1978.
    """
    diagonals = np.diagonal(turns, axis1=1, axis2=2)
    traces = diagonals.sum(axis=1)
    # 4 times the squares of x, y, z and w.
    squares = np.empty((len(turns), 4))
    squares[:, :3] = 1 - traces[:, np.newaxis] + 2 * diagonals
    squares[:, 3] = 1 + traces
    # `products` is 4 times the quaternion times its largest component: the fewest digits are lost.
    largest = squares.argmax(axis=1)
    xyz = np.stack(
        [
            turns[:, 2, 1] - turns[:, 1, 2],
            turns[:, 0, 2] - turns[:, 2, 0],
            turns[:, 1, 0] - turns[:, 0, 1],
        ],
        axis=1,
    )
    products = np.concatenate([xyz, squares[:, 3:]], axis=1)
    rows = np.flatnonzero(largest < 3)
    axes = largest[rows]
    symmetric = turns[rows] + turns[rows].swapaxes(1, 2)
    count = np.arange(len(rows))
    products[rows, :3] = symmetric[count, axes]
    products[rows, 3] = xyz[rows, axes]
    products[rows, axes] = squares[rows, axes]
    norms = np.sqrt(products[:, np.newaxis] @ products[..., np.newaxis])[:, 0]
    unit: FloatArray = products / norms
    return unit
