"""The form that nested lists of numbers must have, and the errors of lists that have another form.

This module checks the types of JSON values, because NumPy would convert true to 1, "1.5" to 1.5 and
null to NaN.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from service.errors import Issue, count_nouns
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

_WHOLE, _NUMBER = frozenset({int}), frozenset({int, float})


PLANAR_WIDTH = 2
"""The number of coordinates of a point in a plane."""


@dataclass(frozen=True, slots=True)
class GridRules:
    """The form of numbers in nested lists; lists of one level have equal lengths.

    Attributes
    ----------
    levels : tuple of str
        For each level, the plural noun of the items of its lists, outermost first: "rows", "control
        points", "numbers".
    width : int or None
        Required length of the innermost lists; None if they may have any length.
    may_be_planar : bool
        Whether the innermost lists may have one number less than `width`, all of them: points in a
        plane, which get the last coordinate 0.
    may_be_homogeneous : bool
        Whether the innermost lists have one number more than `width` if the field `homogeneous` of
        the same object is true.
    integers : bool
        Whether the numbers are indices.
    is_weight : bool
        Whether the JSON Schema refuses negative numbers; the class of the surface checks them.
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
    may_be_planar: bool = False
    may_be_homogeneous: bool = False
    integers: bool = False
    is_weight: bool = False
    point_levels: int = 0
    degree_levels: tuple[int, ...] = ()
    min_degree: int = 1
    width_rule: str = "A control point has exactly three coordinates."
    degree_rule: str = "A net of r × c control points is one patch of degree r − 1 by c − 1."
    list_schema: Mapping[str, int] = field(default_factory=dict)
    triangle_level: int | None = None

    @property
    def scalar(self) -> str:
        """The kind of number that is needed, as a text for clients."""
        return "a whole number" if self.integers else "a number"

    def has_numbers(self, scalars: list[Any]) -> bool:
        """Whether all values are numbers of the right type, and indices at most `MAX_INDEX`."""
        if not set(map(type, scalars)) <= (_WHOLE if self.integers else _NUMBER):
            return False
        return not self.integers or max(map(abs, scalars)) <= MAX_INDEX

    def accepts_width(self, length: int) -> bool:
        """Whether the innermost lists may have this length."""
        return self.width in (None, length) or (self.may_be_planar and length == PLANAR_WIDTH)

    def is_last(self, level: int) -> bool:
        """Whether the lists of this level contain the numbers."""
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
            raise to_refusal(
                [
                    (
                        (),
                        Issue(
                            "too_many_control_points",
                            "The surface has more control points than this service takes.",
                            "",
                            count_nouns(total, "control points"),
                            f"at most {max_count}",
                        ),
                    )
                ]
            )
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
        if self.may_be_planar and self._is_planar(value):
            lengths[-1] = PLANAR_WIDTH
        return self._walk(value, (), lengths)

    def _is_planar(self, value: Any) -> bool:
        """Whether the first innermost list has two numbers."""
        for _ in self.levels[1:]:
            value = value[0] if isinstance(value, list) and value else None
        return isinstance(value, list) and len(value) == PLANAR_WIDTH

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
        if self.is_last(level) and self.has_numbers(value):
            return
        has_innermost_lists = level + 2 == len(self.levels)
        for index, item in enumerate(value):
            # Most points are valid; do not create a generator for these.
            is_point = has_innermost_lists and type(item) is list and len(item) == lengths[-1]
            if not (is_point and self.has_numbers(item)):
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
        if self.is_last(level) and self.width is not None:
            if self.may_be_homogeneous and got == self.width + 1:
                needed_text += ", or `homogeneous`: true beside the points"
            return Issue("wrong_dimension", self.width_rule, got=got_text, needed=needed_text)
        if level == self.triangle_level:
            return ragged_triangle(got_text, needed_text)
        return Issue(
            "ragged",
            "Lists side by side must be equally long; the first one sets the length.",
            got=got_text,
            needed=needed_text,
        )
