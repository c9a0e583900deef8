"""Checks NumPy arrays that are in a document in place of lists of numbers.

A net from a file or from the store is an array already. An error in an array has the code and the
pointer that it would have in lists of the same numbers. A wrong shape or type is reported once, at
the first position that has this error.
"""

from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from service.bases.triangle import degree_of, degree_or_none, row_starts
from service.errors import MAX_ISSUES, Issue
from service.schemas.document import DocumentLimits
from service.schemas.validation import (
    MAX_INDEX,
    Path,
    empty_list,
    index_too_large,
    ragged_triangle,
    to_refusal,
    wrong_type,
)

if TYPE_CHECKING:
    from service.schemas.arrays import Array, NumberGrid

_SCALARS: dict[str, object] = {"b": True, "i": 0, "u": 0, "f": 0.5}
"""For each kind of NumPy type, a JSON value of the same kind, which error messages describe. For
other kinds they describe an object."""


def validate_array(grid: "NumberGrid", values: NDArray[Any], limits: DocumentLimits) -> "Array":
    """Check an array, and convert it to the type that `grid.array` returns.

    An array that already has this type and is contiguous is not copied.

    Parameters
    ----------
    grid : NumberGrid
        The lists for which the array stands. Each of their levels is an axis of the array; but all
        rows of a triangle are one axis of (n+1)(n+2)/2 entries.
    values : ndarray of integers or, unless `grid.integers`, of floats up to double precision
        In any byte order. Booleans, texts, objects and longer floats are refused.
    limits : DocumentLimits

    Raises
    ------
    pydantic.ValidationError
        With one detail for each of the first `MAX_ISSUES` errors.
    """
    values = np.asarray(values)
    sample = _SCALARS.get(values.dtype.kind, {})
    _check_shape(grid, values.shape, sample, limits)
    if values.dtype.kind not in ("iu" if grid.integers else "iuf") or values.dtype.itemsize > 8:
        raise to_refusal([((0,) * len(grid.levels), wrong_type(sample, grid.scalar))])
    if grid.integers:
        is_outside = (values > MAX_INDEX) | (values < -MAX_INDEX)
        _refuse(grid, is_outside, index_too_large())
        return np.ascontiguousarray(values, dtype=np.int64)
    if values.dtype.kind == "f":
        needed = "a finite number"
        issue = Issue("not_finite", "Every number must be finite.", "", "NaN or Infinity", needed)
        _refuse(grid, ~np.isfinite(values), issue)
    return np.ascontiguousarray(values, dtype=np.float64)


def _check_shape(
    grid: "NumberGrid", shape: tuple[int, ...], sample: object, limits: DocumentLimits
) -> None:
    """Refuse a wrong shape, with the error that nested lists of this shape would have.

    `sample` is a JSON value of the same kind as the numbers of the array.
    """
    # In a triangle, one axis stands for two levels: the list of the rows, and the rows.
    axis_count = len(grid.levels) - (grid.triangle_level is not None)
    level = 0
    for axis in range(axis_count):
        first_path, needed = (0,) * level, f"a list of {grid.levels[level]}"
        if axis == len(shape):
            raise to_refusal([(first_path, wrong_type(sample, needed))])
        length, total = shape[axis], prod(shape[: axis + 1])
        if not length:
            raise to_refusal([(first_path, empty_list(needed))])
        if level + 1 == grid.triangle_level:
            # Check the list of the rows here, and the rows below, like a level of any other array.
            degree = degree_or_none(length)
            if degree is None:
                issue = ragged_triangle(f"{length} entries", "3, 6, 10, 15, … entries")
                raise to_refusal([(first_path, issue)])
            rows = degree + 1
            grid.check_size(level, total=prod(shape[:axis]) * rows, longest=rows, limits=limits)
            level += 1
            length = rows
        grid.check_size(level, total=total, longest=length, limits=limits)
        level += 1
        if level == len(grid.levels) and grid.width is not None and length != grid.width:
            raise to_refusal([(first_path, grid.length_issue(level - 1, length, grid.width))])
    if len(shape) > axis_count:
        raise to_refusal([((0,) * level, wrong_type([], grid.scalar))])


def _refuse(grid: "NumberGrid", is_wrong: NDArray[np.bool_], issue: Issue) -> None:
    """Raise the issue for each of the first `MAX_ISSUES` positions where `is_wrong` is true."""
    if is_wrong.any():
        indices = np.argwhere(is_wrong)[:MAX_ISSUES].tolist()
        raise to_refusal((_path(grid, tuple(index), is_wrong.shape), issue) for index in indices)


def _path(grid: "NumberGrid", index: tuple[int, ...], shape: tuple[int, ...]) -> Path:
    """The path that a number of the array has in nested lists, in which a triangle has rows.

    `index` is the index of the number in the array, and `shape` is the shape of the array.
    """
    if grid.triangle_level is None:
        return index
    axis = grid.triangle_level - 1  # the axis of all rows together
    starts = row_starts(degree_of(shape[axis]))
    row = int(np.searchsorted(starts, index[axis], side="right")) - 1
    return (*index[:axis], row, index[axis] - int(starts[row]), *index[axis + 1 :])
