"""The request record: what the service knows about a request and its response.

The middleware makes a record for each request; other parts get it from `record_of` and set its
fields. It has a label instead of the path, so that metrics, spans and logs contain no text that a
client chose; only logs contain the client's request id, of at most 128 safe characters.
"""

import random
import re
import time
from collections.abc import Iterable
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any, NamedTuple

from opentelemetry.trace import format_trace_id, get_current_span
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator
from starlette.routing import compile_path
from starlette.types import Scope

from service.encoders.registry import BY_SUFFIX
from service.storage.keys import is_id
from service.surface.examples.catalogue import EXAMPLES

SCOPE_ITEM = "surface.record"
"""Name of the record in an ASGI scope."""

UNMATCHED = "unmatched"
"""The route in the label of paths that no route matches."""

MAX_CACHED_PATH_LENGTH = 200
"""Most characters of a path whose label is cached, so that long paths cannot fill the memory."""

ID_HEADER = "X-Request-Id"

_REQUEST_ID, _TRACEPARENT = ID_HEADER.lower().encode(), b"traceparent"
_SAFE_ID = re.compile(rb"[A-Za-z0-9][A-Za-z0-9._:/+=@-]{0,127}")
_METHODS = frozenset({"GET", "HEAD", "POST", "DELETE", "OPTIONS", "PUT", "PATCH"})
_W3C = TraceContextTextMapPropagator()
_random = random.Random()


class RouteLabel(NamedTuple):
    """The route of a path; `surface` and `format` are empty if the path names none.

    `route` is a template such as `/v1/surfaces/{id}`; in `path`, the id of an example or of a
    stored surface, and the suffix of a format, replace the names in braces.
    """

    route: str
    path: str
    surface: str = ""
    format: str = ""


NO_ROUTE = RouteLabel(UNMATCHED, "(no such path)")


class RouteLabels:
    """Finds the label of a path, by the templates of the application's routes."""

    def __init__(self, templates: Iterable[str]) -> None:
        self._labels = {template: RouteLabel(template, template) for template in templates}
        self._patterns = [(t, compile_path(t)[0]) for t in self._labels if "{" in t]
        self._match_cached = lru_cache(4096)(self._match)

    def find(self, path: str) -> RouteLabel:
        """The label of a path."""
        match = self._match if len(path) > MAX_CACHED_PATH_LENGTH else self._match_cached
        # A template without names in braces is a path.
        return self._labels.get(path) or match(path)

    def _match(self, path: str) -> RouteLabel:
        for template, pattern in self._patterns:
            match = pattern.match(path)
            if match is not None:
                return _fill(template, **match.groupdict())
        return NO_ROUTE


def _fill(template: str, id: str = "", suffix: str = "", **_: str) -> RouteLabel:
    path, surface, format_name = template, "", ""
    # The id of a job stays out of labels: it permits to read the job, and there is no end of them.
    if template.startswith("/v1/surfaces/") and (id in EXAMPLES or is_id(id)):
        surface, path = id, path.replace("{id}", id)
    if suffix in BY_SUFFIX:
        format_name, path = BY_SUFFIX[suffix].name, path.replace("{suffix}", suffix)
    return RouteLabel(template, path, surface, format_name)


@dataclass(slots=True)
class RequestRecord:
    """One request and its response. Unknown texts are empty.

    `id` is the id that the client sent, or else `trace_id`. `status` is 0 until the response has
    begun. `key` is the name of the API key, never the key itself; `scopes` are what it permits.
    `sent_bytes` counts the bytes of
    the body that were sent so far. `code` is the problem's code, if the response is a problem
    document. `client` is the address of the client. `cache` is "hit" or "miss" for URLs whose
    responses the service caches. `steps` has for each step its name, its start by
    `time.perf_counter`, and its seconds.
    """

    method: str
    label: RouteLabel
    id: str
    trace_id: str
    span_id: str
    format: str = ""
    client: str = "-"
    key: str = ""
    scopes: frozenset[str] = frozenset()
    status: int = 0
    sent_bytes: int = 0
    code: str = ""
    cache: str = ""
    steps: list[tuple[str, float, float]] = field(default_factory=list)


current_record: ContextVar[RequestRecord | None] = ContextVar("request record", default=None)
"""The record of the running request, in its task and threads; log lines have its ids."""


def record_of(scope: Scope | dict[str, Any]) -> RequestRecord:
    """The record of the request that a scope belongs to."""
    record: RequestRecord = scope[SCOPE_ITEM]
    return record


def route_path(scope: Scope) -> str:
    """The path of a request below the mount point of the application."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path[len(root) :] if (path + "/").startswith(root + "/") else path


def start_record(scope: Scope, labels: RouteLabels) -> RequestRecord:
    """Makes the record of a request from its head; sets it in the scope and in the context.

    The trace id is from the header `traceparent` (W3C Trace Context), or else random. A repeated
    header counts as missing.
    """
    ids: list[bytes] = []
    parents: list[bytes] = []
    for name, value in scope["headers"]:
        if name == _REQUEST_ID:
            ids.append(value)
        elif name == _TRACEPARENT:
            parents.append(value)
    trace_id = caller_trace_id(parents[0]) if len(parents) == 1 else ""
    trace_id = trace_id or f"{_random.getrandbits(128):032x}"
    id = ids[0].decode() if len(ids) == 1 and _SAFE_ID.fullmatch(ids[0]) else trace_id
    method = scope["method"] if scope["method"] in _METHODS else "other"
    label = labels.find(scope["path"].removeprefix(scope.get("root_path", "")))
    span_id = f"{_random.getrandbits(64):016x}"
    record = RequestRecord(method, label, id, trace_id, span_id, label.format)
    scope[SCOPE_ITEM] = record
    current_record.set(record)
    return record


def caller_trace_id(traceparent: bytes) -> str:
    """The trace id in a `traceparent` header; empty if it has none."""
    context = _W3C.extract({"traceparent": traceparent.decode("latin-1")})
    caller = get_current_span(context).get_span_context()
    return format_trace_id(caller.trace_id) if caller.is_valid else ""


class Timing:
    """Steps of a request with their times, in the order in which they first ended.

    Parameters
    ----------
    mark : str
        Text before the steps, such as `cache;desc=miss`; it has no time.
    earlier : Timing
        Its steps come first.
    """

    def __init__(self, mark: str = "", earlier: "Timing | None" = None) -> None:
        self._mark = mark
        self._steps: dict[str, float] = {} if earlier is None else earlier._steps.copy()
        self.step = partial(Step, self._steps)
        """Measures a `with` block; blocks with the same name are added up."""

    def __str__(self) -> str:
        """The header `Server-Timing`, in milliseconds."""
        steps = [f"{name};dur={seconds * 1e3:.3f}" for name, seconds in self._steps.items()]
        return ", ".join([self._mark, *steps] if self._mark else steps)


class Step:
    """Adds the time of a `with` block, even if it fails, to the steps and the request record."""

    __slots__ = ("_name", "_start", "_steps")

    def __init__(self, steps: dict[str, float], name: str) -> None:
        self._steps, self._name = steps, name

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        seconds = time.perf_counter() - self._start
        self._steps[self._name] = self._steps.get(self._name, 0.0) + seconds
        if (record := current_record.get()) is not None:
            record.steps.append((self._name, self._start, seconds))
