"""Converts nested lists of numbers to arrays; no other module does so.

This module checks the types of JSON values, because NumPy would convert true to 1, "1.5" to 1.5 and
null to NaN. A fast first pass checks all lists of one level at once. Only if this pass finds an
error, a second pass goes through the lists one by one and finds the positions of the errors.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import core_schema

from service.bases.arrays import FloatArray
from service.bases.cache import build_by_text
from service.errors import Issue, count_nouns
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits
from service.schemas.ndarrays import validate_array
from service.schemas.validation import (
    MAX_INDEX,
    Path,
    empty_list,
    index_too_large,
    limits_of,
    ragged_triangle,
    to_refusal,
    wrong_type,
)

Array: TypeAlias = NDArray[np.float64] | NDArray[np.int64]

_WHOLE, _NUMBER = frozenset({int}), frozenset({int, float})


def tuple_schema(item: dict[str, Any], length: int) -> dict[str, Any]:
    """The JSON Schema of a list of `length` items, each of the schema `item`.

    `prefixItems` adds nothing for validators; from it, generators of clients make a tuple type.
    """
    bounds = {"minItems": length, "maxItems": length}
    return {"type": "array", "items": item, "prefixItems": [item] * length, **bounds}


@dataclass(frozen=True, slots=True)
class NumberGrid:
    """The annotation of a field of numbers in nested lists; lists of one level have equal lengths.

    Attributes
    ----------
    levels : tuple of str
        For each level, the plural noun of the items of its lists, outermost first: "rows", "control
        points", "numbers".
    width : int or None
        Required length of the innermost lists; None if they may have any length.
    integers : bool
        Whether the numbers are indices.
    positive : bool
        Whether the JSON Schema requires positive numbers; the class of the surface checks them.
    point_levels : int
        The items of the lists at this depth (1 for the outermost list) are counted as control
        points, also if they are weights or indices; 0 if nothing is counted.
    degree_levels : tuple of int
        Levels, counted from 0, whose lists have one item more than a degree.
    min_degree : int
        The least degree in the JSON Schema; the class of the surface checks it.
    width_rule, degree_rule : str
        Error messages for another width, and for a degree that is too high.
    list_schema : mapping
        More entries for the JSON Schema of the innermost lists; the class of the surface checks
        them.
    triangle_level : int or None
        For triangles, the level, counted from 0, whose lists are the rows: the n+1 rows of a
        triangle have n+1, n, … 1 entries. In the array, all rows of a triangle are one axis of
        (n+1)(n+2)/2 entries.
    """

    levels: tuple[str, ...]
    width: int | None = None
    integers: bool = False
    positive: bool = False
    point_levels: int = 0
    degree_levels: tuple[int, ...] = ()
    min_degree: int = 1
    width_rule: str = "A control point has exactly three coordinates."
    degree_rule: str = "A net of r × c control points is one patch of degree r − 1 by c − 1."
    list_schema: Mapping[str, int] = field(default_factory=dict)
    triangle_level: int | None = None

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
                has_width = level < last or self.width in (None, length)
                is_right = not lengths and length > 0 and has_width
            if not is_right:
                raise to_refusal(self.find_faults(value))
            shape.append(length)
            items = list(chain.from_iterable(items))
        if not self._all_numbers(items):
            raise to_refusal(self.find_faults(value))
        if self.integers:
            return np.fromiter(items, np.int64, len(items)).reshape(shape)
        return np.fromiter(items, np.float64, len(items)).reshape(shape)

    @property
    def scalar(self) -> str:
        """The kind of number that is needed, as a text for clients."""
        return "a whole number" if self.integers else "a number"

    def _all_numbers(self, scalars: list[Any]) -> bool:
        """Whether all values are numbers of the right type, and indices at most `MAX_INDEX`."""
        if not set(map(type, scalars)) <= (_WHOLE if self.integers else _NUMBER):
            return False
        return not self.integers or max(map(abs, scalars)) <= MAX_INDEX

    def _is_last(self, level: int) -> bool:
        return level == len(self.levels) - 1

    def check_size(self, level: int, total: int, longest: int, limits: DocumentLimits) -> None:
        """Refuse too many control points, or too high a degree, by the lengths of the lists.

        Parameters
        ----------
        level : int
            The level of the lists.
        total, longest : int
            The sum of the lengths of all lists of this level, and the largest length.
        limits : DocumentLimits
        """
        if level + 1 == self.point_levels and total > limits.max_control_points:
            max_count = limits.max_control_points
            message = "The surface has more control points than this service takes."
            got, needed = count_nouns(total, "control points"), f"at most {max_count}"
            raise to_refusal([((), Issue("too_many_control_points", message, "", got, needed))])
        if level in self.degree_levels and longest - 1 > limits.max_degree:
            needed = f"degrees up to {limits.max_degree}; several pieces instead of one"
            issue = Issue("degree_too_high", self.degree_rule, "", f"degree {longest - 1}", needed)
            raise to_refusal([((), issue)])

    def find_faults(self, value: object) -> Iterator[tuple[Path, Issue]]:
        """Find all errors in nested lists, in the order of the document, as (path, issue).

        The function is a generator: the caller may stop after some errors.
        """
        lengths: list[int | None] = [None] * len(self.levels)
        lengths[-1] = self.width
        return self._walk(value, (), lengths)

    def _walk(
        self, value: object, path: Path, lengths: list[int | None]
    ) -> Iterator[tuple[Path, Issue]]:
        """Find the errors in one list, or in one number, at `path`.

        `lengths` has the required length of the lists of each level; None if no list has set it.
        """
        level = len(path)
        if level == len(self.levels):
            yield from self._find_scalar_fault(value, path)
            return
        needed = f"a list of {self.levels[level]}"
        if not isinstance(value, list):
            yield path, wrong_type(value, needed)
            return
        expected = lengths[level]
        if not value:
            yield path, empty_list(needed)
            return
        if level == self.triangle_level:
            # Row k of a triangle of n + 1 rows has n + 1 − k entries.
            expected = (lengths[level - 1] or 0) - int(path[-1])
        if expected is None:
            # The first list at a level sets the length for all others.
            lengths[level] = len(value)
        elif len(value) != expected:
            yield path, self.length_issue(level, len(value), expected)
            return
        if self._is_last(level) and self._all_numbers(value):
            return
        has_innermost_lists = level + 2 == len(self.levels)
        for index, item in enumerate(value):
            # Most points are valid; do not create a generator for these.
            is_point = has_innermost_lists and type(item) is list and len(item) == lengths[-1]
            if not (is_point and self._all_numbers(item)):
                yield from self._walk(item, (*path, index), lengths)

    def _find_scalar_fault(self, value: object, path: Path) -> Iterator[tuple[Path, Issue]]:
        """Find the error of a value in place of which a number is needed, if there is an error."""
        if type(value) not in (_WHOLE if self.integers else _NUMBER):
            yield path, wrong_type(value, self.scalar)
        elif self.integers and isinstance(value, int) and abs(value) > MAX_INDEX:
            yield path, index_too_large()

    def length_issue(self, level: int, got: int, needed: int) -> Issue:
        """The issue for a list of one level that has the length `got` in place of `needed`."""
        got_text, needed_text = (
            count_nouns(length, self.levels[level]) for length in (got, needed)
        )
        if self._is_last(level) and self.width is not None:
            return Issue("wrong_dimension", self.width_rule, got=got_text, needed=needed_text)
        if level == self.triangle_level:
            return ragged_triangle(got_text, needed_text)
        rule = "Lists side by side must be equally long; the first one sets the length."
        return Issue("ragged", rule, got=got_text, needed=needed_text)

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The validator of the field; it refuses null, and every other value that is not a list."""

        def validate(value: object, info: ValidationInfo) -> Array:
            limits = limits_of(info)
            # Clients often send the same indices with other points, so arrays of indices are
            # cached.
            if self.integers:
                return build_by_text(
                    value, (limits, *self.levels), lambda: self.array(value, limits)
                )
            return self.array(value, limits)

        return core_schema.with_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The JSON Schema of the field: arrays of arrays of numbers."""
        result: dict[str, Any] = {"type": "number"}
        if self.integers:
            result = {"type": "integer", "minimum": 0}
        if self.positive:
            result["exclusiveMinimum"] = 0
        for level in reversed(range(len(self.levels))):
            result = {"type": "array", "items": result, "minItems": 1}
            if level in self.degree_levels:
                min_degree, max_degree = self.min_degree, DEFAULT_LIMITS.max_degree
                result |= {"minItems": min_degree + 1, "maxItems": max_degree + 1}
            elif level == self.triangle_level:
                result["maxItems"] = DEFAULT_LIMITS.max_degree + 1
            if self._is_last(level) and level not in self.degree_levels:
                if self.width is not None:
                    result = tuple_schema(result["items"], self.width)
                result |= self.list_schema
        return result


CONTROL_NET = NumberGrid(
    ("rows", "control points", "coordinates"), width=3, point_levels=2, degree_levels=(0, 1)
)
NET_WEIGHTS = NumberGrid(("rows", "weights"), positive=True, degree_levels=(0, 1))
SPLINE_NET = NumberGrid(("rows", "control points", "coordinates"), width=3, point_levels=2)
SPLINE_WEIGHTS = NumberGrid(("rows", "weights"), positive=True, point_levels=2)
KNOTS = NumberGrid(("knots",))
CURVE_POINTS = NumberGrid(
    ("control points", "coordinates"),
    point_levels=1,
    degree_levels=(0,),
    degree_rule="n + 1 control points are one Bézier curve of degree n.",
    list_schema={"minItems": 2, "maxItems": 3},
)
SPLINE_POINTS = NumberGrid(
    ("control points", "coordinates"), point_levels=1, list_schema={"minItems": 2, "maxItems": 3}
)
CURVE_WEIGHTS = NumberGrid(("weights",), positive=True, point_levels=1)
VERTICES = NumberGrid(("vertices", "coordinates"), width=3, point_levels=1)
VERTEX_WEIGHTS = NumberGrid(("weights",), positive=True, point_levels=1)
PATCHES = NumberGrid(
    ("patches", "rows", "indices"), integers=True, point_levels=3, degree_levels=(1, 2)
)
PATCH = NumberGrid(("rows", "indices"), integers=True, degree_levels=(0, 1))
_TRIANGLE_RULE = "A triangle of n + 1 rows is one patch of degree n."
TRIANGLE_NET = NumberGrid(
    ("rows", "control points", "coordinates"),
    width=3,
    point_levels=2,
    degree_levels=(0,),
    degree_rule=_TRIANGLE_RULE,
    triangle_level=1,
)
TRIANGLE_WEIGHTS = NumberGrid(
    ("rows", "weights"),
    positive=True,
    degree_levels=(0,),
    degree_rule=_TRIANGLE_RULE,
    triangle_level=1,
)
TRIANGLES = NumberGrid(
    ("triangles", "rows", "indices"),
    integers=True,
    point_levels=3,
    degree_levels=(1,),
    degree_rule=_TRIANGLE_RULE,
    triangle_level=2,
)
MATRIX = NumberGrid(("rows", "numbers"))

_SURFACE_WEIGHTS = Field(
    description="One positive weight for every control point, in the same rows. Left out, the "
    "surface is polynomial."
)
_CURVE_WEIGHTS = Field(
    description="One positive weight for every control point. Left out, the curve is polynomial."
)
NetWeights: TypeAlias = Annotated[FloatArray | None, NET_WEIGHTS, _SURFACE_WEIGHTS]
SplineWeights: TypeAlias = Annotated[FloatArray | None, SPLINE_WEIGHTS, _SURFACE_WEIGHTS]
TriangleWeights: TypeAlias = Annotated[FloatArray | None, TRIANGLE_WEIGHTS, _SURFACE_WEIGHTS]
CurveWeights: TypeAlias = Annotated[FloatArray | None, CURVE_WEIGHTS, _CURVE_WEIGHTS]
