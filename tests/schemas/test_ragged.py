"""Rows of a triangle are accepted only if each is shorter by one than the row before it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from oracles.triangles import keys
from service.errors import InvalidRequest, Issue, count_nouns
from service.schemas.arrays import NumberGrid
from service.schemas.bezier import TRIANGLE_NET, TRIANGLE_WEIGHTS, point_to_rows, split_rows
from service.schemas.document import DocumentLimits
from service.schemas.patches import TRIANGLES
from service.schemas.validation import invalid_request

LIMITS = DocumentLimits(max_control_points=100, max_degree=6)


@st.composite
def rows(draw: st.DrawFn) -> list[list[int]]:
    """The rows of a triangle, of which at most two numbers are missing or added."""
    n = draw(st.integers(1, 5))
    result = [list(range(n - m)) for m in range(n)]
    for _ in range(draw(st.integers(0, 2))):
        row = draw(st.sampled_from(result))
        if draw(st.booleans()):
            row.append(7)
        elif row:
            row.pop()
    return result


@given(rows())
def test_rows_are_accepted_exactly_if_each_is_shorter_by_one(value: list[list[int]]) -> None:
    is_valid = [len(row) for row in value] == list(range(len(value), 0, -1))
    if is_valid:
        array = TRIANGLE_WEIGHTS.array(value, LIMITS)
        assert array.tolist() == [x for row in value for x in row]
        assert [row.tolist() for row in split_rows(array)] == value
        return
    with pytest.raises(ValidationError) as refusal:
        TRIANGLE_WEIGHTS.array(value, LIMITS)
    issues = invalid_request(refusal.value).issues
    wrong_rows = [m for m, row in enumerate(value) if len(row) != len(value) - m]
    assert [issue.pointer for issue in issues] == [f"/{m}" for m in wrong_rows]
    for issue, m in zip(issues, wrong_rows, strict=True):
        if issue.code == "ragged":
            assert issue.got == count_nouns(len(value[m]), "weights")
            assert issue.needed == count_nouns(len(value) - m, "weights")
        else:
            assert (issue.code, value[m]) == ("empty_list", [])


@pytest.mark.parametrize("degree", range(7))
def test_control_points_are_stored_row_by_row(degree: int) -> None:
    """The array has the control points (i, j, k) with k outermost, then j; row k has one k."""
    net = [[[i, j, k] for i, j, k in keys(degree) if k == row] for row in range(degree + 1)]
    array = TRIANGLE_NET.array(net, LIMITS)
    assert [tuple(point) for point in array.tolist()] == keys(degree)
    assert [row.tolist() for row in split_rows(array)] == net


def test_a_list_of_triangles_becomes_one_array() -> None:
    array = TRIANGLES.array([[[0, 1, 2], [3, 4], [5]], [[5, 4, 3], [2, 1], [0]]], LIMITS)
    assert array.tolist() == [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]]
    assert array.dtype == np.int64


@pytest.mark.parametrize(
    ("grid", "value", "code"),
    [
        (TRIANGLES, [[[None]] * 8], "degree_too_high"),
        (TRIANGLE_NET, [[[None]] * 99, [[None]] * 99], "too_many_control_points"),
    ],
)
def test_too_large_triangles_are_refused_before_points_are_read(
    grid: NumberGrid, value: Any, code: str
) -> None:
    with pytest.raises(ValidationError) as refusal:
        grid.array(value, LIMITS)
    assert [issue.code for issue in invalid_request(refusal.value).issues] == [code]


@pytest.mark.parametrize("degree", [1, 2, 5])
def test_pointers_to_entries_become_pointers_to_rows(degree: int) -> None:
    """An issue of an entry of the array gets the pointer of row and column in the document.

    Entry (i, j, k) of a triangle is entry j of row k. The pattern has two of the three fields; the
    third keeps its pointer.
    """
    order = keys(degree)
    for entry, (_, j, k) in enumerate(order):
        error = InvalidRequest(
            Issue("a", "", f"/weights/{entry}"),
            Issue("b", "", f"/triangles/31/{entry}"),
            Issue("c", "", f"/control_net/{entry}/2"),
        )
        result = point_to_rows(error, r"/weights|/triangles/\d+", len(order))
        assert [issue.pointer for issue in result.issues] == [
            f"/weights/{k}/{j}",
            f"/triangles/31/{k}/{j}",
            f"/control_net/{entry}/2",
        ]
