"""The program of a child process: it reads one file, and ends.

`service.decoders.child` starts it ahead: it imports the readers, and waits for a task. Then it
gives up what it does not need (`service.decoders.confinement`), and only then does it read the file
from its standard input. The answer goes to its standard output:

    task   = one line of JSON, and the bytes of the file
    answer = a frame (`service.framing`)

The member `answer` of the frame has `tree` and `reading`; or `error`, the class of an error, and
its `issues`; or `fault`, the end of a traceback, if the reader has failed.
"""

import codecs
import gc
import json
import os
import sys
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import astuple
from io import FileIO
from itertools import chain
from typing import Any

import numpy.linalg
import numpy.ma

from service.decoders import confinement
from service.decoders.cad_files import READERS, import_reader
from service.decoders.format import FileLimits
from service.decoders.registry import BY_NAME
from service.errors import SurfaceError
from service.framing import Block, mark_nulls, write_blocks

ANSWER = "answer"
"""The name of the tree in the frame of an answer."""

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
    decoder = BY_NAME[task["decoder"]]
    if decoder.name in READERS:
        import_reader(decoder.name)
    os.environ.clear()
    gc.disable()  # readers make few cycles, and the process ends soon
    confinement.limit_resources(task["memory"], task["seconds"])
    is_confined = confinement.refuse_system_calls()
    # While there is memory:
    out_of_memory = b"".join(_frame({"fault": OUT_OF_MEMORY}, is_confined))
    try:
        content = _read_content(task_file, task["length"])
        for block in _answer(task, content, is_confined):
            _write(block)
    except MemoryError:
        _write(out_of_memory)
    os._exit(0)


def _write(block: Block) -> None:
    """Writes a block to standard output."""
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


def _read_content(file: FileIO, length: int) -> bytes:
    content = bytearray()
    while len(content) < length:
        part = file.read(min(READ_BYTES, length - len(content)))
        if not part:  # the service has given up
            os._exit(0)
        content += part
    return bytes(content)


def _answer(task: dict[str, Any], content: bytes, is_confined: bool) -> Iterable[Block]:
    """The blocks of a frame with the content of the file, or with an error."""
    try:
        decoder, limits = BY_NAME[task["decoder"]], FileLimits(*task["limits"])
        decoded = decoder.decode(content, task["kind"], limits)
        answer = {"tree": decoded.tree, "reading": decoded.reading}
        del decoded
        blocks = _frame(answer, is_confined)
        return chain([next(blocks)], blocks)
    except SurfaceError as error:
        issues = [list(astuple(issue)) for issue in error.issues]
        return _frame({"error": type(error).__name__, "issues": issues}, is_confined)
    except MemoryError:
        raise
    except Exception:
        return _frame({"fault": traceback.format_exc()[-MAX_FAULT:]}, is_confined)


def _frame(answer: dict[str, Any], is_confined: bool) -> Iterator[Block]:
    return write_blocks(ANSWER, mark_nulls(answer), is_confined=int(is_confined))


if __name__ == "__main__":
    sys.exit("This program is started by service.decoders.child.")
