"""Numbers in texts are read exactly, for any division of the text into pieces."""

import numpy as np
import pytest

from service.decoders import numbers
from service.decoders.format import too_many
from service.decoders.numbers import line_of_number, read_numbers
from service.errors import SurfaceError


def read(text: bytes, most: int = 10**6) -> list[float]:
    result: list[float] = read_numbers(
        text, 0, len(text), most, lambda: too_many("more", most)
    ).tolist()
    return result


@pytest.mark.parametrize("piece", [1, 2, 7, 64, 1 << 16])
def test_pieces_are_cut_between_numbers(monkeypatch: pytest.MonkeyPatch, piece: int) -> None:
    monkeypatch.setattr(numbers, "PIECE", piece)
    values = np.random.default_rng(3).normal(size=500) * 10.0 ** np.arange(-250, 250)
    text = "".join(
        f"{value!r}{', ' if i % 3 else chr(10)}" for i, value in enumerate(values.tolist())
    )
    assert read(text.encode()) == values.tolist()


@pytest.mark.parametrize("piece", [1, 2, 3, 5, 1 << 16])
def test_words_are_counted_before_they_are_read(
    monkeypatch: pytest.MonkeyPatch, piece: int
) -> None:
    monkeypatch.setattr(numbers, "PIECE", piece)
    for text, count in ((b"", 0), (b"1", 1), (b" 1,, 22\n3\t", 3), (b"12 34 56", 3), (b" ,", 0)):
        assert numbers._words(text, 0, len(text)) == count
        if count:
            with pytest.raises(SurfaceError, match="more control points"):
                read(text, count - 1)


def test_the_line_of_a_number() -> None:
    text = b"head 1,2\n\n3 ,\n4 5"
    assert [line_of_number(text, 4, index) for index in range(5)] == [1, 1, 3, 4, 4]


def test_only_the_needed_numbers_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "PIECE", 16)
    assert read(b"1 " * 100, 100) == [1.0] * 100
    with pytest.raises(SurfaceError, match="more control points"):
        read(b"1 " * 100 + b"x", 100)  # the text after them is not read
