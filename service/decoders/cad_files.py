"""Decodes the files of CAD systems: each reader makes parts, and these become one document.

The readers are imported when a file needs them. They are several times as large as the readers of
control nets, and most processes of the service never need them: a child process reads the files.
"""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType

from service.decoders.format import Decoded, FileLimits, check_kind

FIELDS = ("up", "name", "invalid_faces")
"""The fields of a brep or a group that a client may set beside a file."""

READERS = {
    "step": "service.decoders.step.read",
    "iges": "service.decoders.iges.read",
    "3dm": "service.decoders.rhino",
}
"""For each format its module with the function `read`, from bytes and limits to `CadContent`."""


def import_reader(name: str) -> ModuleType:
    """Imports all that is needed to read a format, and returns the module with `read`.

    Raises
    ------
    ImportError
        A library that the format needs is not installed.
    """
    import_module("service.decoders.cad.document")
    return import_module(READERS[name])


def cad_decoder(name: str) -> Callable[[bytes, str | None, FileLimits], Decoded]:
    """The function `Decoder.decode` of a format in `READERS`."""

    def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
        check_kind(kind, ())
        reader = import_reader(name)
        write_document = import_module("service.decoders.cad.document").write_document
        document = write_document(reader.read(content, limits), limits)
        return Decoded(document.surface, document.reading)

    return decode
