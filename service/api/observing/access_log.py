"""The access log: one line for each request, when its answer has been sent.

`logging` would take ten times as long for these lines, so they are made here; `service.server.logs`
makes all others, in the same form.
"""

import time
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeAlias

import orjson

from service.api.observing.record import RequestRecord
from service.settings.values import Settings

Write: TypeAlias = Callable[[str], None]
"""Takes a line with its end."""

FAILED = 500
"""Statuses from here on are errors of the service, and logged as such."""

PROBES = frozenset({"/health/live", "/health/ready", "/metrics"})
"""Routes that machines ask every few seconds: logged at the level `debug` only."""


def timestamp(seconds: float) -> str:
    """A time, given in seconds since 1970, as RFC 3339 writes it: UTC, with milliseconds."""
    return f"{_to_second(int(seconds))}.{int(seconds % 1 * 1000):03}Z"


@lru_cache(2)
def _to_second(seconds: int) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds))


class AccessLog:
    """Writes the lines that the settings ask for."""

    def __init__(self, settings: Settings, write: Write | None) -> None:
        self._write = write if settings.access_log else None
        self._line = json_line if settings.log_format == "json" else text_line
        self._level = settings.log_level

    def add(self, record: RequestRecord, end: float, seconds: float) -> None:
        """Writes the line of a request that ended at `end`, in seconds since 1970."""
        is_wanted = (
            record.status >= FAILED
            or self._level == "debug"
            or (self._level == "info" and record.label.route not in PROBES)
        )
        if is_wanted and self._write is not None:
            self._write(self._line(record, end, seconds))


def text_line(record: RequestRecord, _end: float, seconds: float) -> str:
    """The line as uvicorn writes it, with bytes and time; of a problem, with its code and id."""
    level = "ERROR:   " if record.status >= FAILED else "INFO:    "
    request = f'{record.client} - "{record.method} {record.label.path}" {record.status}'
    key, id = record.key and f"key {record.key}", record.code and f"id {record.id}"
    more = ", ".join(filter(None, (record.cache, record.code, key, id)))
    tail = f" ({more})" if more else ""
    return f"{level} {request}, {record.sent} bytes, {seconds * 1e3:.1f} ms{tail}\n"


def json_line(record: RequestRecord, end: float, seconds: float) -> str:
    """The line as one JSON object; texts that are not known are left out."""
    line: dict[str, Any] = {
        "time": timestamp(end),
        "level": "error" if record.status >= FAILED else "info",
        "event": "request",
        "request_id": record.id,
        "trace_id": record.trace_id,
        "span_id": record.span_id,
        "method": record.method,
        "route": record.label.route,
        "status": record.status,
        "bytes": record.sent,
        "ms": round(seconds * 1e3, 3),
        "client": record.client,
    }
    optional = {
        "surface": record.label.surface,
        "format": record.format,
        "cache": record.cache,
        "code": record.code,
        "key": record.key,
    }
    line |= {name: value for name, value in optional.items() if value}
    return orjson.dumps(line, option=orjson.OPT_APPEND_NEWLINE).decode()
