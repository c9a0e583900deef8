"""Batches of rows contain every row once, in order, and no batch is too long."""

from hypothesis import given
from hypothesis import strategies as st

from service.bases.row_batches import row_slices


@given(st.integers(0, 50), st.integers(1, 20), st.integers(0, 100))
def test_every_row_is_in_one_batch_and_batches_fit_into_the_room(
    count: int, width: int, room: int
) -> None:
    """A batch of one row may be larger than the room, because no batch can be shorter."""
    result = list(row_slices(count, width, room))
    assert [row for part in result for row in range(part.start, part.stop)] == list(range(count))
    for part in result:
        length = part.stop - part.start
        assert length == 1 or length * width <= room
