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

    def join_short(self, max_bytes: int) -> Iterator[bytes | memoryview]:
        """Join neighbouring short buffers to at most `max_bytes` bytes each; keep long buffers."""
        short_pieces: list[bytes | memoryview] = []
        bytes_left = max_bytes
        for piece in self.pieces:
            if len(piece) > bytes_left and short_pieces:
                yield b"".join(short_pieces)
                short_pieces, bytes_left = [], max_bytes
            if len(piece) > max_bytes:
                yield piece
            else:
                short_pieces.append(piece)
                bytes_left -= len(piece)
        if short_pieces:
            yield b"".join(short_pieces)


Content: TypeAlias = bytes | Pieces
"""The bytes of a file, in one buffer or in several."""
