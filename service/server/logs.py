"""The log: as text for people, or as one JSON object a line for machines.

Requests are told of on standard output, in lines that `service.api.observing.access_log` makes;
everything else on standard error, through `logging`: the server, the store, Python's warnings.
Both have the same form.
"""

import io
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging.handlers import MemoryHandler
from typing import TextIO

from service.server.records import JsonRecords, TextRecords
from service.server.sink import Sink
from service.settings.values import Settings

HELD = 1000
"""Records that are kept until it is known what a line of the log is."""

_UVICORN = ("uvicorn", "uvicorn.error", "uvicorn.access", "uvicorn.asgi")


@dataclass(frozen=True, slots=True)
class Logs:
    """The two streams of a process that serves."""

    requests: Sink
    others: Sink

    def dropped(self) -> int:
        """Lines that could not be written."""
        return self.requests.dropped + self.others.dropped


@contextmanager
def held() -> Iterator[None]:
    """Keeps what is logged within for the block's end: `logs` may come to be in between."""
    root = logging.getLogger()
    holding = MemoryHandler(HELD, flushLevel=logging.CRITICAL + 1)
    before = root.handlers[:]
    root.addHandler(holding)
    try:
        yield
    finally:
        root.removeHandler(holding)
        others = [handler for handler in root.handlers if handler not in before]
        holding.setTarget(others[0] if others else logging.lastResort)
        holding.close()


@contextmanager
def logs(settings: Settings) -> Iterator[Logs]:
    """The log as it is set, of the whole process, until the block ends; then all is written."""
    found = Logs(Sink(_descriptor(sys.stdout)), Sink(_descriptor(sys.stderr)))
    handler = _ToSink(found.others)
    handler.setFormatter(JsonRecords() if settings.log_format == "json" else TextRecords())
    root = logging.getLogger()
    level, handlers = root.level, root.handlers[:]
    root.handlers[:] = [handler]
    root.setLevel(settings.log_level.upper())
    logging.captureWarnings(capture=True)
    for name in _UVICORN:  # whatever was set of these, their records go the way of all others
        logger = logging.getLogger(name)
        logger.handlers.clear()
        logger.setLevel(logging.NOTSET)
        logger.propagate = True
    try:
        yield found
    finally:
        logging.captureWarnings(capture=False)
        root.handlers[:] = handlers
        root.setLevel(level)
        found.requests.flush()
        found.others.flush()


class _ToSink(logging.Handler):
    """Hands records on as lines, at once."""

    def __init__(self, sink: Sink) -> None:
        super().__init__()
        self._sink = sink

    def emit(self, record: logging.LogRecord) -> None:
        """One record; what cannot be written as a line is no reason to fail."""
        try:
            line = self.format(record)
        except Exception:
            self.handleError(record)
        else:
            self._sink.write_now(line + "\n")


def _descriptor(stream: TextIO | None) -> int:
    """The file descriptor of a stream; -1, which takes nothing, where there is none."""
    try:
        return -1 if stream is None else stream.fileno()
    except (io.UnsupportedOperation, ValueError):
        return -1
