"""The type of a format of lines, that is, of curves or of sections."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from service.encoders.format import FileFormat
from service.encoders.registry import BY_NAME

Lines = TypeVar("Lines")
Size = TypeVar("Size")


@dataclass(frozen=True, slots=True)
class LineFormat(FileFormat, Generic[Lines, Size]):
    """A format of lines; `encode` returns the bytes, `byte_bound` bounds their number."""

    encode: Callable[[Lines], bytes]
    byte_bound: Callable[[Size], int]


def line_format(
    name: str,
    encode: Callable[[Lines], bytes],
    byte_bound: Callable[[Size], int],
    title: str = "",
) -> LineFormat[Lines, Size]:
    """A format of lines that is a format of meshes, too, with its name, media type and suffix.

    `name` is the name in both registries. Without `title`, the title is that of the format of
    meshes.
    """
    fmt = BY_NAME[name]
    return LineFormat(
        fmt.name, title or fmt.title, fmt.media_type, fmt.suffix, fmt.is_float32, encode, byte_bound
    )
