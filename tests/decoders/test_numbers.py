"""Numbers in texts are read exactly; the text may be cut into pieces of any length."""

import numpy as np
import pytest

from service.decoders import numbers
from service.decoders.format import build_too_many_error
from service.decoders.numbers import line_of_number, read_numbers
from service.errors import SurfaceError

TOO_MANY = "The surface has more control points than this service allows"
"""The message of `build_too_many_error`, whatever is counted."""


def read(text: bytes, max_numbers: int = 10**6) -> list[float]:
    """The numbers of a text; a text with more than `max_numbers` is refused."""
    values: list[float] = read_numbers(
        text, 0, len(text), max_numbers, lambda: build_too_many_error("more numbers", max_numbers)
    ).tolist()
    return values


@pytest.mark.parametrize("piece_bytes", [1, 2, 7, 64, 1 << 16])
def test_pieces_are_cut_between_numbers(monkeypatch: pytest.MonkeyPatch, piece_bytes: int) -> None:
    monkeypatch.setattr(numbers, "PIECE_BYTES", piece_bytes)
    values = np.random.default_rng(3).normal(size=500) * 10.0 ** np.arange(-250, 250)
    # A line break follows every third number.
    text = "".join(
        f"{value!r}{', ' if i % 3 else chr(10)}" for i, value in enumerate(values.tolist())
    )
    assert read(text.encode()) == values.tolist()


@pytest.mark.parametrize("piece_bytes", range(1, 10))
def test_the_last_number_ends_where_the_range_ends(
    monkeypatch: pytest.MonkeyPatch, piece_bytes: int
) -> None:
    monkeypatch.setattr(numbers, "PIECE_BYTES", piece_bytes)
    text = b"1 2.5 -3} 4"
    values = read_numbers(
        text, 0, text.index(b"}"), 3, lambda: build_too_many_error("more numbers", 3)
    )
    assert values.tolist() == [1.0, 2.5, -3.0]


@pytest.mark.parametrize("piece_bytes", [1, 2, 3, 5, 1 << 16])
def test_words_are_counted_and_too_many_are_refused(
    monkeypatch: pytest.MonkeyPatch, piece_bytes: int
) -> None:
    monkeypatch.setattr(numbers, "PIECE_BYTES", piece_bytes)
    for text, count in ((b"", 0), (b"1", 1), (b" 1,, 22\n3\t", 3), (b"12 34 56", 3), (b" ,", 0)):
        assert len(read(text, count)) == count
        if count:
            with pytest.raises(SurfaceError, match=TOO_MANY):
                read(text, count - 1)


def test_each_number_is_on_the_line_that_is_computed() -> None:
    head = b"head"
    text = head + b" 1,2\n\n3 ,\n4 5"
    assert [line_of_number(text, len(head), index) for index in range(5)] == [1, 1, 3, 4, 4]


def test_numbers_after_the_limit_are_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "PIECE_BYTES", 16)
    assert read(b"1 " * 100, 100) == [1.0] * 100
    with pytest.raises(SurfaceError, match=TOO_MANY):
        # Reading "x" would raise another error.
        read(b"1 " * 100 + b"x", 100)
