"""The child processes that read files: starts them ahead, exchanges bytes with them, ends them.

A child is a new interpreter that imports NumPy and the readers alone (0.1 s, 14 MB): it has none of
this process's descriptors, threads, memory or variables. It is in a process group of its own, so
that Ctrl-C in a terminal does not reach it. If this process dies, its pipes close, and that ends
the child.
"""

import atexit
import logging
import os
import selectors
import subprocess
import sys
from contextlib import suppress
from threading import Lock

from service.cancellation import checkpoint
from service.errors import Busy

if sys.platform == "linux":
    import fcntl

PROGRAM = "service.decoders.child_program"
"""The module with `main`, which a child runs."""

PAUSE = 0.05
"""Seconds between two checks whether the request has ended."""

PIPE_BYTES = 1 << 20
"""Bytes that a pipe holds, where the system allows it: so both sides wait less often."""

_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""All variables of a child, until it clears them: NumPy must not start threads."""

_log = logging.getLogger(__name__)


class AnswerTooLong(Exception):
    """The answer of a child has more bytes than it may have."""


class ChildProcesses:
    """Starts processes, and the next one ahead.

    Attributes
    ----------
    starts_ahead : bool
        Whether there is a process that waits, after the first file. For a program that reads one
        file, and ends, it would be of no use.
    """

    def __init__(self) -> None:
        self.starts_ahead = False
        self._spare: subprocess.Popen[bytes] | None = None
        self._lock = Lock()
        self._was_reported = False

    def take(self) -> subprocess.Popen[bytes]:
        """A process for one file.

        Raises
        ------
        Busy
            The system can start no process now: it has too many, or too little memory.
        """
        with self._lock:
            process, self._spare = self._spare, None
        if process is not None and process.poll() is not None:  # it has died
            end_process(process)
            process = None
        try:
            process = process or start_process()
        except OSError:
            _log.exception("No process could be started to read a file")
            raise Busy from None
        with self._lock, suppress(OSError):  # the next file starts its own, or is refused
            if self.starts_ahead and self._spare is None:
                self._spare = start_process()
        return process

    def close(self) -> None:
        """Ends the process that waits."""
        with self._lock:
            process, self._spare = self._spare, None
        if process is not None:
            end_process(process)

    def report_confinement(self, *, is_confined: bool) -> None:
        """Logs once if the system does not refuse system calls to children."""
        if not is_confined and not self._was_reported:
            self._was_reported = True
            _log.warning(
                "This system cannot refuse system calls to the processes that read CAD files"
            )


PROCESSES = ChildProcesses()
"""Those of this process."""

atexit.register(PROCESSES.close)


def start_process() -> subprocess.Popen[bytes]:
    """Starts a child, which imports its modules and waits for a task."""
    start = f"import sys; sys.path[:] = sys.argv[1:]; from {PROGRAM} import main; main()"
    options = ("-I", "-S", "-B")  # ignores variables, imports no `site`, writes no bytecode
    process = subprocess.Popen(
        [sys.executable, *options, "-c", start, *map(os.path.abspath, sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
        cwd=os.path.abspath(os.sep),
        env=_ENVIRONMENT,
        process_group=None if sys.platform == "win32" else 0,
    )
    if sys.platform == "linux":
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with suppress(OSError):  # its user has too many long pipes
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
    return process


def end_process(process: subprocess.Popen[bytes]) -> None:
    """Kills a process if it has not ended, closes its pipes, and waits for its end."""
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()
    process.wait()


def exchange(
    process: subprocess.Popen[bytes], task: bytes, content: bytes, max_answer: int
) -> bytes:
    """Writes a task and a file to a process, and returns its answer, read to the end.

    Parameters
    ----------
    task : bytes
        At most 4096 bytes, which an empty pipe takes at once.
    max_answer : int
        The most bytes of the answer.

    Raises
    ------
    AnswerTooLong
    Cancelled, OutOfTime
        The request has ended.
    """
    if sys.platform == "win32":
        return _communicate(process, task + content)
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(BrokenPipeError):
        process.stdin.write(task)
    unwritten, parts, length = memoryview(content), list[bytes](), 0
    with selectors.DefaultSelector() as selector:
        for pipe, event in (
            (process.stdin, selectors.EVENT_WRITE),
            (process.stdout, selectors.EVENT_READ),
        ):
            os.set_blocking(pipe.fileno(), False)
            selector.register(pipe, event)
        while True:
            checkpoint()
            for key, event in selector.select(PAUSE):
                if event == selectors.EVENT_READ:
                    part = os.read(key.fd, PIPE_BYTES)
                    if not part:
                        return b"".join(parts)
                    parts.append(part)
                    length += len(part)
                    if length > max_answer:
                        raise AnswerTooLong
                    continue
                try:
                    unwritten = unwritten[os.write(key.fd, unwritten[:PIPE_BYTES]) :]
                except BrokenPipeError:  # it has ended; its answer may say why
                    unwritten = memoryview(b"")
                if not unwritten:
                    selector.unregister(process.stdin)
                    process.stdin.close()


def _communicate(process: subprocess.Popen[bytes], content: bytes) -> bytes:
    """`exchange` for a system that cannot wait for several pipes at once."""
    unsent: bytes | None = content
    while True:
        checkpoint()
        with suppress(subprocess.TimeoutExpired):
            return process.communicate(unsent, PAUSE)[0]
        unsent = None  # it continues with the first one
