"""Nested lists become arrays exactly if every number is valid for the field."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from service.schemas.arrays import NumberGrid
from service.schemas.bezier import CONTROL_NET, NET_WEIGHTS
from service.schemas.document import DocumentLimits
from service.schemas.patches import PATCHES, VERTICES
from service.schemas.validation import invalid_request

LIMITS = DocumentLimits()
UNUSUAL_ITEMS: st.SearchStrategy[Any] = st.sampled_from(
    [0, 1, -2, 0.5, 1e30, True, None, "1", [], {}, 2**60]
)


def nested_lists(depth: int) -> st.SearchStrategy[Any]:
    """Lists nested to this depth, mostly of equal length, with some invalid lengths and values."""
    if depth == 0:
        return st.sampled_from([0, 1, 2, 0.5]) | UNUSUAL_ITEMS
    length = st.sampled_from([3, 3, 3, 2, 0])
    return (
        length.flatmap(lambda n: st.lists(nested_lists(depth - 1), min_size=n, max_size=n))
        | UNUSUAL_ITEMS
    )


def is_valid(value: Any, grid: NumberGrid) -> bool:
    """Whether a value is valid for the field, decided number by number."""
    lengths: dict[int, set[int]] = {}

    def is_valid_item(item: Any, level: int) -> bool:
        if level == len(grid.levels):
            if grid.integers:
                return type(item) is int and abs(item) <= 2**53
            return type(item) in (int, float)
        if not isinstance(item, list) or not item:
            return False
        lengths.setdefault(level, set()).add(len(item))
        return all(is_valid_item(child, level + 1) for child in item)

    if not is_valid_item(value, 0) or any(len(result) != 1 for result in lengths.values()):
        return False
    return grid.width is None or lengths[len(grid.levels) - 1] == {grid.width}


@pytest.mark.parametrize("grid", [CONTROL_NET, NET_WEIGHTS, PATCHES, VERTICES])
@given(data=st.data())
def test_arrays_are_accepted_exactly_if_valid(grid: NumberGrid, data: st.DataObject) -> None:
    value = data.draw(nested_lists(len(grid.levels)))
    if is_valid(value, grid):
        array = grid.array(value, LIMITS)
        assert array.tolist() == value
        assert array.dtype == (np.int64 if grid.integers else np.float64)
    else:
        with pytest.raises(ValidationError) as refusal:
            grid.array(value, LIMITS)
        assert 1 <= refusal.value.error_count() <= 20


@given(st.lists(st.lists(st.floats(-1e300, 1e300), min_size=3, max_size=3), min_size=1))
def test_arrays_have_the_numbers_of_the_lists(points: list[list[float]]) -> None:
    assert VERTICES.array(points, LIMITS).tolist() == points


def test_too_many_control_points_are_refused_before_points_are_read() -> None:
    limits = DocumentLimits(max_control_points=9)
    invalid_points = [[None] * 5, [None] * 5]
    with pytest.raises(ValidationError) as refusal:
        CONTROL_NET.array(invalid_points, limits)
    issue = invalid_request(refusal.value).issues[0]
    assert (issue.code, issue.got) == ("too_many_control_points", "10 control points")


def test_the_first_list_determines_the_length_of_the_others() -> None:
    with pytest.raises(ValidationError) as refusal:
        NET_WEIGHTS.array([[1, 2], [1, 2, 3], [1, 2], [1]], LIMITS)
    issues = invalid_request(refusal.value).issues
    assert [(i.code, i.pointer, i.got, i.needed) for i in issues] == [
        ("ragged", "/1", "3 weights", "2 weights"),
        ("ragged", "/3", "1 weight", "2 weights"),
    ]
