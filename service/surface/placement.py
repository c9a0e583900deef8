"""Boxes around surfaces; placements by affine matrices (4, 4), and exact quarter turns.

A matrix acts on columns, x' = L x + t: L is its upper left 3 × 3 matrix, and t is its last column.
"""

from collections.abc import Iterable
from math import sqrt
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import Bools, FloatArray
from service.errors import InvalidRequest, Issue, pointer
from service.surface.checks import MAX_COORDINATE, Up

_IDENTITY = np.eye(4).tolist()

Box: TypeAlias = tuple[FloatArray, FloatArray]
"""Least and greatest coordinates, two arrays (d,)."""

LEAST_SCALING = float(np.finfo(np.float32).tiny)
"""The least scaling of a placement: viewers compute in float32, and may round smaller numbers to
0."""

MAX_SCALING_RATIO = 1e6
"""A placement may scale one direction at most this factor more than another. Flatter bodies would
lose their thickness in float32."""

_TURNS = MappingProxyType(
    {
        ("z", "y"): ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
        ("y", "z"): ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    }
)
"""Quarter turns about x that take one vertical axis to the other."""


def validate_matrix(values: ArrayLike) -> FloatArray:
    """Check a placement: returns `values` as a read-only invertible affine matrix (4, 4).

    Raises
    ------
    InvalidRequest
        `wrong_dimension`, `not_finite`, `out_of_range`, `not_affine` or `singular_matrix`, with
        pointers relative to the matrix.
    """
    matrix = np.array(values, dtype=np.float64, order="C")
    if matrix.shape != (4, 4):
        raise _refusal("wrong_dimension", "A placement is four rows of four numbers.",
                       f"an array of shape {matrix.shape}", "shape (4, 4)")  # fmt: skip
    # The comparison is false for NaN, too.
    is_wrong = ~(np.abs(matrix) <= MAX_COORDINATE)
    if is_wrong.any():
        position = np.argwhere(is_wrong)[0]
        value = float(matrix[tuple(position)])
        if np.isfinite(value):
            raise _refusal("out_of_range", "Coordinates are stored in single precision.",
                           f"{value:.6g}", f"at most {MAX_COORDINATE:.7g} in absolute value",
                           pointer(position.tolist()))  # fmt: skip
        raise _refusal("not_finite", "Every number must be finite.", "no finite number",
                       "a finite number", pointer(position.tolist()))  # fmt: skip
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise _refusal("not_affine", "A placement is affine: it moves, turns, scales and shears.",
                       "another last row", "0, 0, 0, 1", "/3")  # fmt: skip
    linear = matrix[:3, :3]
    if not _is_clearly_valid(linear) and not is_valid_linear(linear[np.newaxis])[0]:
        max_scaling, _, min_scaling = np.linalg.svd(linear, compute_uv=False).tolist()
        raise _refusal("singular_matrix", "A placement must not flatten a body.",
                       f"scalings from {min_scaling:.6g} to {max_scaling:.6g}",
                       f"scalings of at least {LEAST_SCALING:.7g}, the largest at most "
                       f"{MAX_SCALING_RATIO:.0e} times the smallest")  # fmt: skip
    # −0 becomes 0, so that equal placements have equal bytes.
    matrix += 0.0
    matrix.flags.writeable = False
    return matrix


def is_valid_linear(linear: FloatArray) -> Bools:
    """Whether each linear map, (N, 3, 3), flattens no body."""
    scalings = np.linalg.svd(linear, compute_uv=False)
    largest, least = scalings[:, 0], scalings[:, 2]
    is_valid: Bools = (least >= LEAST_SCALING) & (largest <= MAX_SCALING_RATIO * least)
    return is_valid


def _is_clearly_valid(linear: FloatArray) -> bool:
    """Whether a linear map (3, 3) is far from flattening a body; faster than its scalings.

    Let s ≥ m ≥ l be the scalings, and F = s² + m² + l² the sum of the squares of all numbers. Then
    |det| = s m l ≤ F l / 2 and s ≤ √F. So l ≥ 2 |det| / F, and s/l ≤ F √F / (2 |det|). The factors
    1/10 and 10 allow for rounding.
    """
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    squares = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + i * i
    determinant = abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    if not 1e-12 < squares < 1e12:
        return False
    least = 2 * determinant / squares / 10
    return bool(least * MAX_SCALING_RATIO > sqrt(squares) * 10)


def turn_upright(matrix: FloatArray | None, up: Up, target: Up) -> FloatArray | None:
    """A placement after a quarter turn that moves a model's vertical axis `up` to `target`.

    A quarter turn exchanges coordinates, so nothing is rounded. None stands for the identity, as
    argument and as result.
    """
    if up != target:
        turn = np.eye(4)
        turn[:3, :3] = _TURNS[up, target]
        matrix = turn if matrix is None else matrix @ turn + 0.0  # −0 becomes 0
    return None if matrix is not None and is_identity(matrix) else matrix


def turn_matrices(matrices: FloatArray, target: Up) -> FloatArray:
    """Placements (N, 4, 4) after a quarter turn of models from the other vertical axis."""
    turn = np.eye(4)
    turn[:3, :3] = _TURNS["z" if target == "y" else "y", target]
    turned: FloatArray = matrices @ turn + 0.0  # −0 becomes 0
    return turned


def is_identity(matrix: FloatArray) -> bool:
    """Whether a placement moves nothing."""
    return bool(matrix.tolist() == _IDENTITY)


def find_box(points: FloatArray) -> Box:
    """The box of points (…, d)."""
    # NumPy reduces long rows ten times as fast as long columns.
    columns = np.ascontiguousarray(points.reshape(-1, points.shape[-1]).T)
    return columns.min(axis=1), columns.max(axis=1)


def join_boxes(boxes: Iterable[Box]) -> Box:
    """The box that contains all of these boxes."""
    lows, highs = zip(*boxes, strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def check_box(box: Box, where: str, points: str) -> None:
    """Refuse a box with coordinates that float32 cannot store.

    `where` is the JSON pointer for the error, and `points` says what is in the box.
    """
    low, high = box
    largest_coordinate = float(max(-low.min(), high.max()))
    if largest_coordinate > MAX_COORDINATE:
        raise _refusal("coordinate_too_large", "Coordinates are stored in single precision.",
                       f"{points} as far as {largest_coordinate:.6g}",
                       f"at most {MAX_COORDINATE:.7g}", where)  # fmt: skip


def is_mirroring(matrix: FloatArray | None) -> bool:
    """Whether a placement mirrors bodies: its determinant is negative."""
    return matrix is not None and bool(np.linalg.det(matrix[:3, :3]) < 0)


def place_box(box: Box, matrix: FloatArray | None) -> Box:
    """The box of a box after a placement."""
    if matrix is None:
        return box
    half = (box[1] - box[0]) / 2
    middle = matrix[:3, :3] @ (box[0] + half) + matrix[:3, 3]
    half_box = np.abs(matrix[:3, :3]) @ half
    return middle - half_box, middle + half_box


def place_boxes(lows: FloatArray, highs: FloatArray, matrices: FloatArray) -> Box:
    """The boxes of N boxes, (N, 3) each, after N placements (N, 4, 4), bit by bit as `place_box`.

    Identities must be left out: `place_box` returns their boxes without rounding.
    """
    half = (highs - lows) / 2
    linear = matrices[:, :3, :3]
    middle = (linear @ (lows + half)[..., np.newaxis])[..., 0] + matrices[:, :3, 3]
    half_boxes = (np.abs(linear) @ half[..., np.newaxis])[..., 0]
    return middle - half_boxes, middle + half_boxes


def _refusal(code: str, message: str, got: str, needed: str, where: str = "") -> InvalidRequest:
    return InvalidRequest(Issue(code, message, where, got, needed))
