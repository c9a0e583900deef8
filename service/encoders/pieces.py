"""A long file as the pieces of memory that it is made of."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

JOINED = 1 << 18
"""Bytes up to which a file is joined: to send one more piece costs more than to copy it."""


@dataclass(frozen=True, eq=False, slots=True)
class Pieces:
    """Bytes in order, not copied together: `bytes(pieces)` does that."""

    pieces: tuple[bytes | memoryview, ...]

    def __len__(self) -> int:
        return sum(map(len, self.pieces))

    def __iter__(self) -> Iterator[bytes | memoryview]:
        return iter(self.pieces)

    def __bytes__(self) -> bytes:
        return b"".join(self.pieces)


Content: TypeAlias = bytes | Pieces
"""What is in a file."""


def joined(pieces: tuple[bytes | memoryview, ...], length: int) -> Content:
    """Pieces of `length` bytes together: as one unless that would copy much."""
    return b"".join(pieces) if length <= JOINED else Pieces(pieces)
