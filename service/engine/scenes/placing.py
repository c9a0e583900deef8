"""Placements L x + t of points, normals and faces: their scaling, and bounds of rounding errors."""

from math import hypot

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.engine.extent import AT_ZERO, is_moved
from service.engine.vectors import normalize
from service.surface.lowered import Chain

SINGULAR_VALUE_ERROR = 2.0**-44
"""Bound of the error of a computed singular value of a 3 × 3 matrix, relative to the largest one.
The algorithm is backward stable: the error is a few units in the last place of the largest singular
value, hundreds of times smaller than this bound."""

COPY_ERROR = 2.0**-36
"""Bound of the error of the positions of copies, as a fraction of the size of the placed model. If
this service multiplies the vertices, the error of L x is at most 2^-50 |L| |x|. If a node of the
file has a rotation and scalings, the error is some 1e-12, because columns count as perpendicular,
and scalings as 1, up to 1e-12."""

TRANSLATION_ERROR = 2.0**-50
"""Bound of the rounding error of adding the translation, as a fraction of its length."""


def scalings(matrix: FloatArray | None) -> tuple[float, float]:
    """Bounds (s, S) of the scaling of lengths: s |x − y| ≤ |L x − L y| ≤ S |x − y|."""
    if matrix is None:
        return 1.0, 1.0
    max_scaling, _, min_scaling = np.linalg.svd(matrix[:3, :3], compute_uv=False).tolist()
    slack = SINGULAR_VALUE_ERROR * max_scaling
    return max(min_scaling - slack, 0.0), max_scaling + slack


def bound_placing_error(
    matrix: FloatArray | None, low: FloatArray, high: FloatArray, chain: Chain | None = None
) -> float:
    """Bound of the distance between the computed and the exact copy of a point within bounds.

    `chain` is `PlacedModel.chain`. Let the placement be the product of k matrices L_j x + t_j, each
    with a relative error of at most c, which is `COPY_ERROR`, and let s_j be the product of the
    scalings of the matrices above L_j. A point of the model at the distance r from 0 is at most s r
    + Σ s_j |t_j| from 0 in the group, where s is the product of all scalings. Each matrix adds at
    most c times this distance.
    """
    if matrix is None and chain is None:
        return 0.0
    distance = hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())
    if chain is not None:
        levels, stretch, reach = chain
        return COPY_ERROR * levels * (stretch * distance + reach)
    assert matrix is not None  # the first condition; for mypy
    shift = hypot(*matrix[:3, 3].tolist())
    return COPY_ERROR * scalings(matrix)[1] * distance + TRANSLATION_ERROR * shift


def place_points(
    points: RealArray, matrix: FloatArray | None, origin: FloatArray = AT_ZERO
) -> FloatArray:
    """The placed points (…, 3) in float64; `points` are relative to the origin.

    Each coordinate is computed separately: a matrix product may give two equal points different
    bits.
    """
    positions = points.astype(np.float64)
    if is_moved(origin):
        positions += origin
    return positions if matrix is None else _multiply(positions, matrix[:3, :3]) + matrix[:3, 3]


def place_nets(points: FloatArray, matrices: FloatArray) -> FloatArray:
    """Nets of control points (K, …, 3), each after its own placement (K, 4, 4).

    The bits are those of `place_points`.
    """
    rows = matrices.reshape(len(points), *(1,) * (points.ndim - 2), 4, 4)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    coordinates = [
        rows[..., i, 0] * x + rows[..., i, 1] * y + rows[..., i, 2] * z + rows[..., i, 3]
        for i in range(3)
    ]
    return np.stack(coordinates, axis=-1)


def place_normals(normals: RealArray, matrix: FloatArray | None) -> FloatArray:
    """Unit normals (N, 3) of a surface after a placement, in the direction L⁻ᵀ n.

    L⁻ᵀ is the matrix of cofactors divided by det L. So the cofactors give the direction, and the
    sign of det L the sign.
    """
    in_double = normals.astype(np.float64)
    if matrix is None:
        return in_double
    a, b, c = matrix[:3, :3] / np.abs(matrix[:3, :3]).max()
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    if np.dot(a, cofactors[0]) < 0:
        cofactors = -cofactors
    return normalize(_multiply(in_double, cofactors / np.abs(cofactors).max()), -1)


def reverse_faces(faces: IndexArray) -> IndexArray:
    """Faces in the opposite order, from the same first corner; quads keep their diagonal."""
    # The first corner, then the remaining corners from the last to the second.
    return np.concatenate([faces[:, :1], faces[:, :0:-1]], axis=1)


def _multiply(vectors: FloatArray, linear: FloatArray) -> FloatArray:
    """L x for every vector x of (…, 3); equal vectors give equal bits, wherever they are."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([line[0] * x + line[1] * y + line[2] * z for line in linear], axis=-1)
