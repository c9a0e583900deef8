"""A long file as a list of buffers."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, eq=False, slots=True)
class Pieces:
    """Bytes in several buffers, in order; `bytes(pieces)` joins them."""

    pieces: tuple[bytes | memoryview, ...]

    def __len__(self) -> int:
        return sum(map(len, self.pieces))

    def __iter__(self) -> Iterator[bytes | memoryview]:
        return iter(self.pieces)

    def __bytes__(self) -> bytes:
        return b"".join(self.pieces)


Content: TypeAlias = bytes | Pieces
"""The bytes of a file, in one buffer or in several."""
