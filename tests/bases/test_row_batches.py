"""Batches of rows: every row once, in order, and no batch too long."""

from hypothesis import given
from hypothesis import strategies as st

from service.bases.row_batches import row_slices


@given(st.integers(0, 50), st.integers(1, 20), st.integers(0, 100))
def test_every_row_comes_once_and_chunks_fit(count: int, width: int, room: int) -> None:
    result = list(row_slices(count, width, room))
    assert [row for part in result for row in range(part.start, part.stop)] == list(range(count))
    for part in result:
        length = part.stop - part.start
        assert length == 1 or length * width <= room
