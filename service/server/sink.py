"""Where lines of the log go: to a file descriptor, from a thread of its own.

A pipe that nobody reads blocks whoever writes to it, and one whose reader has gone is an error.
Neither may stop the service: lines wait in a bounded queue, and what is too much is dropped and
counted. Written are all that have come meanwhile at once, which also is cheaper than one by one.
"""

import atexit
import os
import time
from collections import deque
from threading import Event, Thread

PAUSE = 0.05
"""Seconds for which lines are gathered, unless they are urgent."""

WAITING = 10_000
"""Lines that may wait."""

AT_ONCE = 1 << 16
"""Characters after which what is gathered is written."""

FAREWELL = 1.0
"""Seconds that the last lines have when the process ends."""


class Sink:
    """Lines to a file descriptor, in their order.

    Parameters
    ----------
    file : int
        The descriptor; it stays open.
    waiting : int
        Lines that may wait.
    """

    def __init__(self, file: int, waiting: int = WAITING) -> None:
        self.dropped = 0
        self._file = file
        self._lines: deque[str] = deque()
        self._waiting = waiting
        self._some = Event()
        self._urgent = Event()
        self._idle = Event()
        self._idle.set()
        Thread(target=self._run, name=f"log {file}", daemon=True).start()
        atexit.register(self.flush)

    def write(self, line: str) -> None:
        """Takes a line, its end included; returns at once."""
        if len(self._lines) >= self._waiting:
            self.dropped += 1
            return
        self._lines.append(line)
        if not self._some.is_set():
            self._some.set()

    def write_now(self, line: str) -> None:
        """The same of a line that shall not wait for others."""
        self.write(line)
        self._urgent.set()

    def flush(self, seconds: float = FAREWELL) -> bool:
        """Waits until all lines are written, so long at most; whether they are."""
        end = time.monotonic() + seconds
        self._urgent.set()
        while self._lines or not self._idle.is_set():
            if time.monotonic() > end:
                return False
            time.sleep(0.001)
        return True

    def _run(self) -> None:
        while True:
            self._some.wait()
            self._urgent.wait(PAUSE)
            self._idle.clear()
            # What comes from here on sets it again, so that nothing is forgotten.
            self._some.clear()
            self._urgent.clear()
            while self._lines:
                self._put(self._gathered())
            self._idle.set()

    def _gathered(self) -> bytes:
        """Lines that are written together."""
        lines, length = [], 0
        while self._lines and length < AT_ONCE:
            lines.append(self._lines.popleft())
            length += len(lines[-1])
        return "".join(lines).encode("utf-8", "backslashreplace")

    def _put(self, text: bytes) -> None:
        """Writes it, or drops it where nobody can read it any more."""
        rest = memoryview(text)
        while rest:
            try:
                rest = rest[os.write(self._file, rest) :]
            except BlockingIOError:  # somebody else has told the file not to wait
                time.sleep(PAUSE)
            except OSError:
                self.dropped += bytes(rest).count(b"\n")
                return
