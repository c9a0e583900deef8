"""Decodes the files of CAD systems: each reader makes parts, and these become one document.

The readers are imported when a file needs them. They are several times as large as the readers of
control nets, and most processes of the service never need them: a child process reads the files.
"""

# ruff: noqa: PLC0415

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias

from service.decoders.format import Decoded, FileLimits, check_kind

if TYPE_CHECKING:
    from service.decoders.cad.content import CadContent

    Reader: TypeAlias = Callable[[bytes, FileLimits], CadContent]

FIELDS = ("up", "name", "invalid_faces")
"""The fields of a brep or a group that a client may set beside a file."""


def _import_step() -> "Reader":
    from service.decoders.step.read import read

    return read


def _import_iges() -> "Reader":
    from service.decoders.iges.read import read

    return read


def _import_3dm() -> "Reader":
    from service.decoders.rhino import read

    return read


READERS: Mapping[str, Callable[[], "Reader"]] = MappingProxyType(
    {"step": _import_step, "iges": _import_iges, "3dm": _import_3dm}
)
"""For each format a function that imports its reader.

It raises `ImportError` if a library that the format needs is not installed.
"""


def import_reader(name: str) -> "Reader":
    """Imports all that `cad_decoder` needs for a format, and returns its reader."""
    import service.decoders.cad.document  # noqa: F401

    return READERS[name]()


def cad_decoder(name: str) -> Callable[[bytes, str | None, FileLimits], Decoded]:
    """The function `Decoder.decode` of a format in `READERS`."""

    def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
        from service.decoders.cad.document import write_document

        check_kind(kind, ())
        read = READERS[name]()
        document = write_document(read(content, limits), limits)
        return Decoded(document.surface, document.reading)

    return decode
