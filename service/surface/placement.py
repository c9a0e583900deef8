"""Boxes around surfaces; placements by affine matrices (4, 4), and exact quarter turns.

A matrix acts on columns, x' = L x + t: L is its upper left 3 × 3 matrix, and t is its last column.
"""

from collections.abc import Iterable
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, pointer
from service.surface.checks import MAX_COORDINATE, Up

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
    wrong_positions = np.argwhere(~(np.abs(matrix) <= MAX_COORDINATE))
    if len(wrong_positions):
        position = wrong_positions[0]
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
    max_scaling, _, min_scaling = np.linalg.svd(matrix[:3, :3], compute_uv=False).tolist()
    if min_scaling < LEAST_SCALING or max_scaling > MAX_SCALING_RATIO * min_scaling:
        raise _refusal("singular_matrix", "A placement must not flatten a body.",
                       f"scalings from {min_scaling:.6g} to {max_scaling:.6g}",
                       f"scalings of at least {LEAST_SCALING:.7g}, the largest at most "
                       f"{MAX_SCALING_RATIO:.0e} times the smallest")  # fmt: skip
    # −0 becomes 0, so that equal placements have equal bytes.
    matrix += 0.0
    matrix.flags.writeable = False
    return matrix


def turn_upright(matrix: FloatArray | None, up: Up, target: Up) -> FloatArray | None:
    """A placement after a quarter turn that moves a model's vertical axis `up` to `target`.

    A quarter turn exchanges coordinates, so nothing is rounded. None stands for the identity, as
    argument and as result.
    """
    if up != target:
        turn = np.eye(4)
        turn[:3, :3] = _TURNS[up, target]
        matrix = turn if matrix is None else matrix @ turn + 0.0  # −0 becomes 0
    if matrix is not None and np.array_equal(matrix, np.eye(4)):
        return None
    return matrix


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


def _refusal(code: str, message: str, got: str, needed: str, where: str = "") -> InvalidRequest:
    return InvalidRequest(Issue(code, message, where, got, needed))
