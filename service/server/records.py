"""Records of `logging` as lines of the log.

A record may tell, in the text of an exception say, what came from outside: nothing in it can end
its line, or be an order to a terminal. How long it may become is bounded.
"""

import logging
import re
import traceback
from typing import Any

import orjson

from service.api.observing.access_log import timestamp
from service.api.observing.record import current_record

MESSAGE, TEXT, FRAMES = 4000, 200, 50
"""Letters of a message and of the text of an exception; frames of a traceback."""

_UNSAFE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Controls, ends of lines, and what turns the direction of a text round."""


def harmless(text: str, most: int) -> str:
    """A text in one line, of so many letters at most."""
    if len(text) > most:
        text = text[:most] + "…"
    return _UNSAFE.sub(_escaped, text)


def _escaped(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def traced(error: BaseException) -> list[str]:
    """An exception and what it came from, the last one last: files, lines and names.

    Of the lines of code nothing is shown, and of the texts only their beginnings: they may hold
    what somebody sent.
    """
    lines: list[str] = []
    seen: set[int] = set()
    at: BaseException | None = error
    while at is not None and id(at) not in seen:
        seen.add(id(at))
        try:
            text = harmless(str(at), TEXT)
        except Exception:
            text = "(no text)"
        frames = traceback.extract_tb(at.__traceback__)[-FRAMES:]
        where = [f"  {frame.filename}:{frame.lineno} in {frame.name}" for frame in frames]
        lines = [*where, f"{type(at).__qualname__}: {text}", *lines]
        hidden = at.__suppress_context__
        at = at.__cause__ or (None if hidden else at.__context__)
    return lines


def _error(record: logging.LogRecord) -> BaseException | None:
    return record.exc_info[1] if record.exc_info else None


class TextRecords(logging.Formatter):
    """`WARNING:  message`, as uvicorn writes it; tracebacks below, indented."""

    def format(self, record: logging.LogRecord) -> str:
        """The lines of a record, without the last end."""
        head = f"{record.levelname + ':':9} {harmless(record.getMessage().strip(), MESSAGE)}"
        request = current_record.get()
        if request is not None:
            head += f" (id {request.id})"
        error = _error(record)
        below = (
            [] if error is None else [f"    {harmless(line, MESSAGE)}" for line in traced(error)]
        )
        return "\n".join([head, *below])


class JsonRecords(logging.Formatter):
    """One JSON object; of a request that is under way, its ids too."""

    def format(self, record: logging.LogRecord) -> str:
        """The line of a record, without its end."""
        line: dict[str, Any] = {
            "time": timestamp(record.created),
            "level": record.levelname.lower(),
            "event": "log",
            "logger": harmless(record.name, TEXT),
            "message": harmless(record.getMessage().strip(), MESSAGE),
        }
        request = current_record.get()
        if request is not None:
            line["request_id"] = request.id
            line["trace_id"], line["span_id"] = request.trace_id, request.span_id
        error = _error(record)
        if error is not None:
            line["exception"] = type(error).__qualname__
            line["traceback"] = "\n".join(harmless(each, MESSAGE) for each in traced(error))
        return orjson.dumps(line).decode()
