"""Lines of the log about requests: one for each, when its answer has been sent.

They are not made by `logging`, which takes ten times as long; `service.server.logs` makes all
others, in the same form. What a client chose stands in no line, but for what was found harmless:
its id of the request, the id of a surface.
"""

import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, Literal, TypeAlias

import orjson

from service.api.observing.exchange import Exchange

Write: TypeAlias = Callable[[str], None]
"""Takes a line, its end included."""

Line: TypeAlias = Callable[[Exchange, float], str]
"""Makes a line of an exchange and the seconds it took."""

FAILED = 500
"""Statuses from here on are errors, and logged as such."""


class Clock:
    """The time as RFC 3339 writes it, in UTC and with milliseconds."""

    def __init__(self) -> None:
        self._second = -1
        self._text = ""

    def __call__(self, now: float | None = None) -> str:
        """The time given, in seconds since 1970, or the present one."""
        now = time.time() if now is None else now
        second = int(now)
        if second != self._second:
            self._second = second
            self._text = datetime.fromtimestamp(second, UTC).strftime("%Y-%m-%dT%H:%M:%S")
        return f"{self._text}.{int((now - second) * 1000):03}Z"


def line_of(form: Literal["text", "json"]) -> Line:
    """What makes the lines of this form."""
    return _Json() if form == "json" else _text


def _text(exchange: Exchange, seconds: float) -> str:
    """As uvicorn writes it, with what it took; and an id to look for, where something is wrong."""
    e = exchange
    level = "ERROR:   " if e.status >= FAILED else "INFO:    "
    more = [part for part in (e.cache, e.code, e.key and f"key {e.key}") if part]
    if e.code:
        more.append(f"id {e.id}")
    tail = f" ({', '.join(more)})" if more else ""
    did = f'{e.client} - "{e.method} {e.place.shown}" {e.status}'
    return f"{level} {did}, {e.sent} bytes, {seconds * 1e3:.1f} ms{tail}\n"


class _Json:
    """One JSON object a line; what is not known is left out."""

    def __init__(self) -> None:
        self._clock = Clock()

    def __call__(self, exchange: Exchange, seconds: float) -> str:
        e = exchange
        line: dict[str, Any] = {
            "time": self._clock(),
            "level": "error" if e.status >= FAILED else "info",
            "event": "request",
            "request_id": e.id,
            "trace_id": e.trace_id,
            "span_id": e.span_id,
            "method": e.method,
            "route": e.place.route,
            "status": e.status,
            "bytes": e.sent,
            "ms": round(seconds * 1e3, 3),
            "client": e.client,
        }
        if e.place.surface:
            line["surface"] = e.place.surface
        if e.format:
            line["format"] = e.format
        if e.cache:
            line["cache"] = e.cache
        if e.code:
            line["code"] = e.code
        if e.key:
            line["key"] = e.key
        return orjson.dumps(line, option=orjson.OPT_APPEND_NEWLINE).decode()
