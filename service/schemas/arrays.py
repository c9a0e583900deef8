"""Converts nested lists of numbers to arrays; no other module does so.

A fast first pass checks all lists of one level at once. Only if this pass finds an error, a second
pass goes through the lists one by one and finds the positions of the errors (`GridRules`).

A net from a file or from the store is an array already. An error in an array has the code and the
pointer that it would have in lists of the same numbers. A wrong shape or type is reported once, at
the first position that has this error.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from math import prod
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import core_schema

from service.bases.cache import build_by_text
from service.bases.triangle import degree_of, degree_or_none, row_starts
from service.errors import MAX_ISSUES, Issue, count_nouns
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits
from service.schemas.grid_rules import PLANAR_WIDTH, GridRules
from service.schemas.validation import (
    MAX_INDEX,
    Path,
    empty_list,
    index_too_large,
    limits_of,
    ragged_triangle,
    to_invalid,
    to_refusal,
    wrong_type,
)

Array: TypeAlias = NDArray[np.float64] | NDArray[np.int64]

_SCALARS: dict[str, object] = {"b": True, "i": 0, "u": 0, "f": 0.5}
"""For each kind of NumPy type, a JSON value of the same kind, which error messages describe. For
other kinds they describe an object."""


def tuple_schema(item: dict[str, Any], length: int) -> dict[str, Any]:
    """The JSON Schema of a list of `length` items, each of the schema `item`.

    It has no `prefixItems`: some generators of clients add these to `items`, as further elements.
    """
    return {"type": "array", "items": item, "minItems": length, "maxItems": length}


class NumberGrid(GridRules):
    """The annotation of a field of numbers in nested lists, which become an array."""

    __slots__ = ()

    def array(self, value: object, limits: DocumentLimits = DEFAULT_LIMITS) -> Array:
        """Convert nested lists to an array of float64, or of int64 for indices.

        The array has one axis for each level; but for triangles, the level of the rows and the
        level of their entries are one axis. If `value` is an array with these axes, it is checked.

        Raises
        ------
        pydantic.ValidationError
            With one detail for each of the first `MAX_ISSUES` errors.
        """
        if isinstance(value, np.ndarray):
            return validate_array(self, value, limits)
        items: list[Any] = [value]
        shape: list[int] = []
        last = len(self.levels) - 1
        # In each turn, `items` holds all lists of one level, and then all items of these lists.
        for level in range(last + 1):
            if set(map(type, items)) != {list}:
                raise to_refusal(self.find_faults(value))
            lengths = set(map(len, items))
            if level + 1 == self.point_levels or level in self.degree_levels:
                self.check_size(level, sum(map(len, items)), max(lengths), limits)
            if level == self.triangle_level:
                rows = shape.pop()
                row_lengths = [*range(rows, 0, -1)]
                is_right = list(map(len, items)) == row_lengths * (len(items) // rows)
                length = sum(row_lengths)
            else:
                length = lengths.pop()  # if the lists are equally long, no other length is left
                has_width = level < last or self.accepts_width(length)
                is_right = not lengths and length > 0 and has_width
            if not is_right:
                raise to_refusal(self.find_faults(value))
            shape.append(length)
            items = list(chain.from_iterable(items))
        if not self.has_numbers(items):
            raise to_refusal(self.find_faults(value))
        if self.integers:
            return np.fromiter(items, np.int64, len(items)).reshape(shape)
        return self.to_space(np.fromiter(items, np.float64, len(items)).reshape(shape))

    def to_space(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """The array of points in space, if it has points in a plane: their last coordinate is 0."""
        if not self.may_be_planar or values.shape[-1] == self.width:
            return values
        return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, 1)])

    def to_homogeneous(self) -> "NumberGrid":
        """The rules for homogeneous points, which have one number more than points in space."""
        return replace(
            self,
            width=(self.width or 0) + 1,
            may_be_planar=False,
            width_rule="A homogeneous control point has four numbers, [w x, w y, w z, w].",
        )

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The validator of the field; it refuses null, and every other value that is not a list."""

        def validate(value: object, info: ValidationInfo) -> Array:
            limits, grid = limits_of(info), self
            if self.may_be_homogeneous and getattr(info, "data", {}).get("homogeneous"):
                grid = self.to_homogeneous()
            # Clients often send the same indices with other points, so arrays of indices are
            # cached.
            if self.integers:
                return build_by_text(
                    value, (limits, *self.levels), lambda: self.array(value, limits)
                )
            return grid.array(value, limits)

        return core_schema.with_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The JSON Schema of the field: arrays of arrays of numbers."""
        result: dict[str, Any] = (
            {"type": "integer", "minimum": 0} if self.integers else {"type": "number"}
        )
        if self.is_weight:
            result["minimum"] = 0
        for level in reversed(range(len(self.levels))):
            result = {"type": "array", "items": result, "minItems": 1}
            if level in self.degree_levels:
                min_degree, max_degree = self.min_degree, DEFAULT_LIMITS.max_degree
                result |= {"minItems": min_degree + 1, "maxItems": max_degree + 1}
            elif level == self.triangle_level:
                result["maxItems"] = DEFAULT_LIMITS.max_degree + 1
            if self.is_last(level) and level not in self.degree_levels:
                if self.width is not None:
                    result = tuple_schema(result["items"], self.width)
                result |= self.list_schema
                if self.may_be_planar:
                    items = result["items"]
                    result = {"oneOf": [result, tuple_schema(items, PLANAR_WIDTH)]}
                    if self.may_be_homogeneous and self.width:
                        result["oneOf"].append(tuple_schema(items, self.width + 1))
        return result


def validate_array(grid: NumberGrid, values: NDArray[Any], limits: DocumentLimits) -> Array:
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
        _refuse(grid, (values > MAX_INDEX) | (values < -MAX_INDEX), index_too_large())
        return np.ascontiguousarray(values, dtype=np.int64)
    if values.dtype.kind == "f":
        needed = "a finite number"
        issue = Issue("not_finite", "Every number must be finite.", "", "NaN or Infinity", needed)
        _refuse(grid, ~np.isfinite(values), issue)
    return np.ascontiguousarray(grid.to_space(values), dtype=np.float64)


def _check_shape(
    grid: GridRules, shape: tuple[int, ...], sample: object, limits: DocumentLimits
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
        if level == len(grid.levels) and grid.width is not None and not grid.accepts_width(length):
            raise to_refusal([(first_path, grid.length_issue(level - 1, length, grid.width))])
    if len(shape) > axis_count:
        raise to_refusal([((0,) * level, wrong_type([], grid.scalar))])


def _refuse(grid: GridRules, is_wrong: NDArray[np.bool_], issue: Issue) -> None:
    """Raise the issue for each of the first `MAX_ISSUES` positions where `is_wrong` is true."""
    if is_wrong.any():
        indices = np.argwhere(is_wrong)[:MAX_ISSUES].tolist()
        raise to_refusal((_path(grid, tuple(index), is_wrong.shape), issue) for index in indices)


def _path(grid: GridRules, index: tuple[int, ...], shape: tuple[int, ...]) -> Path:
    """The path that a number of the array has in nested lists, in which a triangle has rows.

    `index` is the index of the number in the array, and `shape` is the shape of the array.
    """
    if grid.triangle_level is None:
        return index
    axis = grid.triangle_level - 1  # the axis of all rows together
    starts = row_starts(degree_of(shape[axis]))
    row = int(np.searchsorted(starts, index[axis], side="right")) - 1
    return (*index[:axis], row, index[axis] - int(starts[row]), *index[axis + 1 :])


def check_total(definitions: Iterable[BaseModel], where: str, info: ValidationInfo) -> None:
    """Refuse surfaces that together have too many control points; `where` is the pointer."""
    total, max_points = sum(map(_count_points, definitions)), limits_of(info).max_control_points
    if total > max_points:
        raise to_invalid(
            Issue(
                "too_many_control_points",
                "All surfaces together have more control points than this service takes.",
                where,
                count_nouns(total, "control points"),
                f"at most {max_points}",
            )
        )


def _count_points(definition: BaseModel) -> int:
    """The number of points in the largest array of a surface that has one entry for each point.

    Such arrays are control points, weights, indices, colours and uvs; attributes are not counted.
    For a multipatch it is the sum over its surfaces; for a tube or ribbon it is that of its curve.
    Breps, and nets whose degree is raised, count their own points.
    """
    if (point_count := getattr(definition, "point_count", None)) is not None:
        return int(point_count)
    if surfaces := getattr(definition, "surfaces", ()):
        return sum(map(_count_points, surfaces))
    if (curve := getattr(definition, "curve", None)) is not None:
        return _count_points(curve)
    return max(
        (
            # In a triangle, the list of the rows and the rows are one axis.
            _count_entries(value, grid.point_levels - (grid.triangle_level is not None))
            for name, field in type(definition).model_fields.items()
            for grid in field.metadata
            if isinstance(grid, NumberGrid) and grid.point_levels
            if (value := getattr(definition, name)) is not None
        ),
        default=0,
    )


def _count_entries(value: Array | tuple[Array, ...], axes: int) -> int:
    """The number of entries along the first axes of an array, or of a list of arrays."""
    if isinstance(value, tuple):  # grids of several degrees
        return sum(prod(each.shape[: axes - 1]) for each in value)
    return prod(value.shape[:axes])
