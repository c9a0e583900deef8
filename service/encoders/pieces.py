"""A long file as several buffers, so that large arrays need not be copied."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, eq=False, slots=True)
class Pieces:
    """The bytes of a file in several buffers, in order; `bytes(pieces)` joins them."""

    pieces: tuple[bytes | memoryview, ...]

    def __len__(self) -> int:
        return sum(map(len, self.pieces))

    def __iter__(self) -> Iterator[bytes | memoryview]:
        return iter(self.pieces)

    def __bytes__(self) -> bytes:
        return b"".join(self.pieces)

    def join_short(self, most: int) -> Iterator[bytes | memoryview]:
        """Join neighbouring short buffers to buffers of at most `most` bytes; keep long buffers."""
        short: list[bytes | memoryview] = []
        room = most
        for piece in self.pieces:
            if len(piece) > room and short:
                yield b"".join(short)
                short, room = [], most
            if len(piece) > most:
                yield piece
            else:
                short.append(piece)
                room -= len(piece)
        if short:
            yield b"".join(short)


Content: TypeAlias = bytes | Pieces
"""The bytes of a file, in one buffer or in several."""
