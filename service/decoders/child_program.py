"""The program of a child process: it reads one file, and ends.

`service.decoders.child` starts it ahead: it imports the readers, and waits for a task. Then it
gives up what it does not need (`service.decoders.confinement`), and only then does it read the file
from its standard input. The answer goes to its standard output:

    task   = one line of JSON, and the bytes of the file
    answer = frames (`service.framing`), each after its length in 8 bytes, little-endian

The member `answer` of the last frame has `tree` and `reading`; or `error`, the class of an error,
and its `issues`; or `fault`, the end of a traceback, if the reader has failed. The frames before it
have the definitions of a group, one each: so the service never parses a long text at once. Of CAD
files, the edges and faces of each brep are columns (`service.decoders.columns`).
"""

import codecs
import gc
import json
import os
import sys
import traceback
from collections.abc import Iterator
from dataclasses import astuple
from io import FileIO
from typing import Any, TypeAlias

import numpy.linalg
import numpy.ma

from service.decoders import confinement
from service.decoders.cad_files import READERS, import_reader
from service.decoders.columns import pack_brep
from service.decoders.format import Decoder, FileLimits
from service.decoders.mesh_registry import MESH_BY_NAME, import_readers
from service.decoders.registry import BY_NAME
from service.errors import SurfaceError
from service.framing import Block, mark_nulls, write_blocks

Frame: TypeAlias = list[Block]
"""The blocks of a frame."""

ANSWER = "answer"
"""The name of the tree in the frame of an answer."""

LENGTH_BYTES = 8
"""Bytes of the length of a frame."""

OUT_OF_MEMORY = "memory"
"""The fault of a reader that needs more memory than it has."""

AHEAD = ("step", "iges")
"""Formats whose readers a child imports before it gets a task: those without a library."""

CODECS = ("latin-1", "cp1252", "utf-8-sig", "utf-16-be", "utf-16-le", "utf-32-be")
"""Encodings of texts in CAD files: a codec is a module, which cannot be imported later."""

MAX_FAULT = 2000
"""The most characters of a traceback."""

READ_BYTES = 1 << 20
"""Bytes that are read at once."""


def main() -> None:
    """Waits for a task, and does it."""
    confinement.lower_priority()
    for name in AHEAD:
        import_reader(name)
    for name in CODECS:
        codecs.lookup(name)
    _allocate_buffers()
    task_file = FileIO(0, closefd=False)
    task = _read_task(task_file)
    if task is None:  # the service has ended, or does not need this process any more
        os._exit(0)
    decoder = _find_decoder(task)
    if decoder.is_mesh:
        import_readers()
    elif decoder.name in READERS:
        import_reader(decoder.name)
    os.environ.clear()
    gc.disable()  # readers make few cycles, and the process ends soon
    confinement.limit_resources(task["memory"], task["seconds"])
    is_confined = confinement.refuse_system_calls()
    # While there is memory:
    out_of_memory = _frame({"fault": OUT_OF_MEMORY}, is_confined)
    try:
        content = _read_content(task_file, task["length"])
        for frame in _answer(task, content, is_confined):
            _write(frame)
    except MemoryError:
        _write(out_of_memory)
    os._exit(0)


def _write(frame: Frame) -> None:
    """Writes the length of a frame and its blocks to standard output."""
    for block in (sum(map(len, frame)).to_bytes(LENGTH_BYTES, "little"), *frame):
        view = memoryview(block)
        while view:
            view = view[os.write(1, view) :]


def _allocate_buffers() -> None:
    """Makes OpenBLAS take its buffers: it ends a process that has no memory for them later."""
    numpy.linalg.inv(numpy.eye(64) @ numpy.eye(64))


def _read_task(file: FileIO) -> dict[str, Any] | None:
    """The first line, byte by byte: what follows is read when the process is confined."""
    line = bytearray()
    while not line.endswith(b"\n"):
        byte = file.read(1)
        if not byte:
            return None
        line += byte
    task: dict[str, Any] = json.loads(line)
    return task


def _find_decoder(task: dict[str, Any]) -> Decoder:
    """The decoder that a task names: some names are those of surfaces and of meshes."""
    return (MESH_BY_NAME if task["is_mesh"] else BY_NAME)[task["decoder"]]


def _read_content(file: FileIO, length: int) -> bytes:
    content = bytearray()
    while len(content) < length:
        part = file.read(min(READ_BYTES, length - len(content)))
        if not part:  # the service has given up
            os._exit(0)
        content += part
    return bytes(content)


def _answer(task: dict[str, Any], content: bytes, is_confined: bool) -> Iterator[Frame]:
    """The frames of an answer with the content of the file, or with an error."""
    try:
        decoder, limits = _find_decoder(task), FileLimits(*task["limits"])
        decoded = decoder.decode(content, task["kind"], limits)
        tree, pack = dict(decoded.tree), pack_brep if decoder.is_cad else dict
        for definition in tree.pop("definitions", ()):
            yield _frame(pack(definition), is_confined)
        yield _frame({"tree": pack(tree), "reading": decoded.reading}, is_confined)
    except SurfaceError as error:
        issues = [list(astuple(issue)) for issue in error.issues]
        yield _frame({"error": type(error).__name__, "issues": issues}, is_confined)
    except MemoryError:
        raise
    except Exception:
        yield _frame({"fault": traceback.format_exc()[-MAX_FAULT:]}, is_confined)


def _frame(answer: dict[str, Any], is_confined: bool) -> Frame:
    return [*write_blocks(ANSWER, mark_nulls(answer), is_confined=int(is_confined))]


if __name__ == "__main__":
    sys.exit("This program is started by service.decoders.child.")
