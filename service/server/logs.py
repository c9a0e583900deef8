"""Writes the log: as text for people, or as one JSON object a line for programs.

Lines about requests go to standard output; `service.api.observing.middleware` formats them. All
other lines go to standard error through `logging`. For each of the two, a thread writes lines from
a queue of bounded length: if a pipe is full or broken, the service drops lines, counts them, and
continues.

A log record, or the text of an exception, may repeat what a client sent. So its length is bounded,
and control characters are escaped: they cannot end the line or control a terminal.
"""

import logging
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from logging.handlers import QueueHandler
from queue import SimpleQueue
from threading import Event, Thread
from traceback import TracebackException
from typing import Any, Literal, NamedTuple

import orjson

from service.api.observing.middleware import timestamp
from service.api.record import current_record
from service.settings.values import Settings

MAX_LINES, GATHER_SECONDS, FLUSH_SECONDS = 10_000, 0.05, 1.0
"""Most lines in the queue; seconds for which the thread collects lines before it writes them; most
seconds to write the last lines."""

MAX_BLOCK = 4096
"""Most bytes of one write. A pipe takes them at once, so that lines of workers that write to one
pipe do not mix: PIPE_BUF of Linux, pipe(7)."""

MAX_MESSAGE, MAX_TEXT, MAX_FRAMES = 4000, 200, 50
"""Most characters of a message or of a frame's line, and of an exception's text; most frames of a
traceback."""

_UNSAFE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters, ends of lines, and characters that change the direction of a text."""


class Logs(NamedTuple):
    """The log of requests, and that of everything else."""

    access: "LogLines"
    errors: "LogLines"

    def count_dropped(self) -> int:
        """The number of lines that could not be written."""
        return self.access.dropped + self.errors.dropped


def start_logs(settings: Settings) -> Logs:
    """Sends `logging` and warnings to standard error; returns the access log and the error log."""
    # A process without standard output or error gets the descriptor −1: every write to it fails, so
    # the lines are dropped.
    access_log, error_log = LogLines(1 if sys.stdout else -1), LogLines(2 if sys.stderr else -1)
    error_log.setFormatter(RecordFormatter(settings.log_format))
    root = logging.getLogger()
    root.handlers[:] = [error_log]
    root.setLevel(settings.log_level.upper())
    logging.captureWarnings(capture=True)
    return Logs(access_log, error_log)


class LogLines(QueueHandler):
    """Writes lines to a file descriptor, in order, from a thread; counts the lines that it drops.

    The thread does not write through a `StreamHandler`, which would hold its lock while it waits
    for a full pipe: the process flushes all handlers before it exits, and would wait for this lock.
    """

    def __init__(self, descriptor: int, max_lines: int = MAX_LINES) -> None:
        self.lines: SimpleQueue[str | Event] = SimpleQueue()
        super().__init__(self.lines)
        self.dropped, self._max_lines, self._descriptor = 0, max_lines, descriptor
        Thread(target=self._write_all, name="log", daemon=True).start()

    def enqueue(self, record: logging.LogRecord) -> None:
        """Queues a record; `QueueHandler.prepare` has stored the formatted text in `record.msg`."""
        self.write(f"{record.msg}\n")

    def write(self, line: str) -> None:
        """Queues a line, which ends with a line feed; returns at once."""
        if self.lines.qsize() < self._max_lines:
            self.lines.put(line)
        else:
            self.dropped += 1

    def flush(self) -> None:
        """Waits until the lines are written, for at most `FLUSH_SECONDS` seconds."""
        self.lines.put(all_written := Event())
        all_written.wait(FLUSH_SECONDS)

    def _write_all(self) -> None:
        while True:
            batch = [self.lines.get()]
            time.sleep(GATHER_SECONDS)  # fewer writes leave more time to requests
            while not self.lines.empty():
                batch.append(self.lines.get())
            for block in join_lines(line for line in batch if isinstance(line, str)):
                self._write(block)
            for event in batch:
                if isinstance(event, Event):
                    event.set()

    def _write(self, block: bytes) -> None:
        try:
            while block:
                block = block[os.write(self._descriptor, block) :]
        except OSError:
            self.dropped += block.count(b"\n")


def join_lines(lines: Iterable[str]) -> Iterator[bytes]:
    """The lines, encoded, in blocks of at most `MAX_BLOCK` bytes; a longer line is a block."""
    block = b""
    for text in lines:
        line = text.encode("utf-8", "backslashreplace")
        if block and len(block) + len(line) > MAX_BLOCK:
            yield block
            block = b""
        block += line
    if block:
        yield block


class RecordFormatter(logging.Formatter):
    """Formats a record and its exception's traceback: as JSON, or as text with a time stamp."""

    def __init__(self, form: Literal["text", "json"]) -> None:
        super().__init__()
        self._is_json = form == "json"

    def format(self, record: logging.LogRecord) -> str:
        """The lines of a record, without the last line feed."""
        message = escape(record.getMessage().strip(), MAX_MESSAGE)
        request, lines = current_record.get(), format_trace(record)
        if not self._is_json:
            id = "" if request is None else f" (id {request.id})"
            head = f"{timestamp(record.created)} {record.levelname + ':':9} {message}{id}"
            return "\n    ".join((head, *lines))
        line: dict[str, Any] = {
            "time": timestamp(record.created),
            "level": record.levelname.lower(),
            "event": "log",
            "logger": escape(record.name, MAX_TEXT),
            "message": message,
        }
        if request is not None:
            line["request_id"] = request.id
            line["trace_id"], line["span_id"] = request.trace_id, request.span_id
        if record.exc_info and record.exc_info[0]:
            line["exception"] = record.exc_info[0].__qualname__
            line["traceback"] = "\n".join(lines)
        return orjson.dumps(line).decode()


def escape(text: str, max_length: int) -> str:
    """A text in one line, cut to a number of characters and then escaped."""
    text = text if len(text) <= max_length else text[:max_length] + "…"
    return _UNSAFE.sub(lambda match: ascii(match[0])[1:-1], text)


def format_trace(record: logging.LogRecord) -> list[str]:
    """The traceback of a record's exception and of its causes, with shortened texts, as lines."""
    lines: list[str] = []
    error = record.exc_info[1] if record.exc_info else None
    trace = (
        TracebackException.from_exception(error, limit=-MAX_FRAMES) if error is not None else None
    )
    while trace is not None:
        text = escape("".join(trace.format_exception_only()).strip(), MAX_TEXT)
        frames = (f"  {frame.filename}:{frame.lineno} in {frame.name}" for frame in trace.stack)
        lines = [*(escape(frame, MAX_MESSAGE) for frame in frames), text, *lines]
        trace = trace.__cause__ or (None if trace.__suppress_context__ else trace.__context__)
    return lines
