"""A long file as several buffers, so that large arrays need not be copied."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, eq=False, slots=True)
class SplitContent:
    """The bytes of a file in several buffers, in order; `bytes(content)` joins them."""

    buffers: tuple[bytes | memoryview, ...]

    def __len__(self) -> int:
        return sum(map(len, self.buffers))

    def __iter__(self) -> Iterator[bytes | memoryview]:
        return iter(self.buffers)

    def __bytes__(self) -> bytes:
        return b"".join(self.buffers)

    def join_short(self, max_bytes: int) -> Iterator[bytes | memoryview]:
        """Join neighbouring short buffers to at most `max_bytes` bytes each; keep long buffers."""
        short_buffers: list[bytes | memoryview] = []
        bytes_left = max_bytes
        for buffer in self.buffers:
            if len(buffer) > bytes_left and short_buffers:
                yield b"".join(short_buffers)
                short_buffers, bytes_left = [], max_bytes
            if len(buffer) > max_bytes:
                yield buffer
            else:
                short_buffers.append(buffer)
                bytes_left -= len(buffer)
        if short_buffers:
            yield b"".join(short_buffers)


Content: TypeAlias = bytes | SplitContent
"""The bytes of a file, in one buffer or in several."""
