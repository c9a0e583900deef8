"""Slices of rows contain every row once, in order, and no slice is too large."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.bases.row_batches import first_positions, row_slices


@given(st.integers(0, 50), st.integers(1, 20), st.integers(0, 100))
def test_every_row_is_in_one_slice_and_slices_have_at_most_the_size(
    count: int, width: int, max_size: int
) -> None:
    """A slice of one row may be larger, because no slice can be shorter."""
    slices = list(row_slices(count, width, max_size))
    assert [row for each in slices for row in range(each.start, each.stop)] == list(range(count))
    for each in slices:
        length = each.stop - each.start
        assert length == 1 or length * width <= max_size


@given(st.lists(st.integers(0, 20)))
def test_first_positions_are_those_of_a_search(numbers: list[int]) -> None:
    first = first_positions(np.array(numbers, np.uint32), 21).tolist()
    assert first == [numbers.index(k) if k in numbers else 0 for k in range(21)]
