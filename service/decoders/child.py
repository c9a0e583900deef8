"""Reads files in child processes: one file each, and the next process is started ahead.

A reader in Python would keep this process's lock for long, and a library in C++ could crash it. A
child has few rights, little memory and little time (`service.decoders.confinement`). Bytes go in
and a document comes out through pipes (`service.decoders.child_program`). The document is no more
trusted than the file: it is checked like a posted one.

The thread that waits for a child calls `checkpoint`, and kills the child if its request has ended.
"""

import json
import logging
import signal
import subprocess
import traceback
from contextlib import suppress
from dataclasses import astuple
from typing import Any

from service.decoders.answers import parse_decoded, parse_error, parse_mesh
from service.decoders.child_processes import PROCESSES, AnswerTooLong, end_process, exchange
from service.decoders.child_program import ANSWER, LENGTH_BYTES, OUT_OF_MEMORY
from service.decoders.format import Decoded, Decoder, FileLimits, build_file_error
from service.errors import InvalidRequest, Issue, SurfaceError, TooLarge
from service.framing import UNREADABLE, read_frame
from service.interpreter import pause_collection, short_turns

ANSWER_SHARE = 4
"""The answer may take a quarter of the memory of a file, and the child the rest."""

_END_SECONDS = 1.0
"""Seconds in which a child ends after its answer."""

_log = logging.getLogger(__name__)


def read_file(decoder: Decoder, content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
    """The content of a file; of a longer one by a child process (`Decoder.is_read_in_child`).

    A fault of the reader is logged, and becomes an error of the file.

    Parameters
    ----------
    kind : str or None
        The kind of surface that the client has requested.

    Raises
    ------
    InvalidRequest, MalformedBody, TooLarge
        The errors of the decoder; `malformed_file` if the reader fails or its process dies; and
        `too_much_memory`.
    Cancelled, OutOfTime
        The request has ended; so has the child.
    """
    if decoder.is_read_in_child(len(content)):
        return _read_in_child(decoder, content, kind, limits)
    try:
        return decoder.decode(content, kind, limits)
    except SurfaceError:
        raise
    except MemoryError:
        raise _too_much_memory(decoder.memory(len(content))) from None
    except Exception:
        raise _fault(decoder, traceback.format_exc()) from None


def _read_in_child(
    decoder: Decoder, content: bytes, kind: str | None, limits: FileLimits
) -> Decoded:
    memory = decoder.memory(len(content))
    max_answer = memory // ANSWER_SHARE
    task = {
        "decoder": decoder.name,
        "is_mesh": decoder.is_mesh,
        "kind": kind,
        "limits": astuple(limits),
        "length": len(content),
        "memory": memory - max_answer,
        "seconds": decoder.seconds(len(content)),
    }
    process = PROCESSES.take()
    try:
        answer = exchange(process, json.dumps(task).encode() + b"\n", content, max_answer)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_SECONDS)
        status = process.poll()
    except AnswerTooLong:
        raise _too_much_memory(memory) from None
    finally:
        end_process(process)
    return _parse_answer(decoder, answer, status, len(content))


def _parse_answer(decoder: Decoder, content: bytes, status: int | None, length: int) -> Decoded:
    """The content of a file of this length from the answer of a child.

    `status` is that of the child's end: minus the number of a signal that has killed it; None if it
    has not ended by itself.
    """
    try:
        with short_turns(), pause_collection():
            header = _read_frames(content)
        answer: dict[str, Any] = header[ANSWER]
        PROCESSES.report_confinement(is_confined=bool(header["is_confined"]))
        if "error" in answer:
            raise parse_error(answer)
        if "tree" in answer:
            return parse_mesh(answer) if decoder.is_mesh else parse_decoded(answer)
        fault = str(answer["fault"])
    except UNREADABLE:
        fault = f"the child has ended with status {status}, and without an answer"
    if fault == OUT_OF_MEMORY or _was_killed(status, "SIGKILL"):  # Linux kills if it has no memory
        raise _too_much_memory(decoder.memory(length))
    if _was_killed(status, "SIGPROF", "SIGXCPU"):
        raise _too_slow()
    raise _fault(decoder, fault)


def _read_frames(content: bytes) -> dict[str, Any]:
    """The header of the last frame, with the definitions from the frames before it in its tree.

    Raises
    ------
    Any of `UNREADABLE`
    """
    frames, start = list[bytes](), 0
    while start < len(content):
        begin = start + LENGTH_BYTES
        start = begin + int.from_bytes(content[start:begin], "little")
        frames.append(content[begin:start])
    *definitions, last = frames
    header = read_frame(ANSWER, last)
    if definitions:
        header[ANSWER]["tree"]["definitions"] = [
            read_frame(ANSWER, frame)[ANSWER] for frame in definitions
        ]
    return header


def _was_killed(status: int | None, *signals: str) -> bool:
    """Whether one of these signals has ended a process; Windows has none of them."""
    return status in [-getattr(signal, name) for name in signals if hasattr(signal, name)]


def _too_much_memory(memory: int) -> TooLarge:
    return TooLarge(
        Issue(
            "too_much_memory",
            "To read this file takes more memory than its length allows.",
            got=f"more than {memory} bytes",
            needed="a file with less in it, such as a part of the assembly",
        )
    )


def _too_slow() -> InvalidRequest:
    return build_file_error(
        "The file takes far longer to read than others of its length: it may be damaged.",
        "several times the usual time",
        "the file written again by another program",
    )


def _fault(decoder: Decoder, text: str) -> InvalidRequest:
    """The error of a file at which the reader has failed, which the log explains."""
    _log.warning("The reader of %s has failed at a file: %s", decoder.name, text)
    return build_file_error(
        "The reader of this service has failed at this file.",
        "a file that is damaged, or that has a content which the reader does not expect",
        "the file written again by another program",
    )
