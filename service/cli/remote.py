"""Commands at a service (`--url`): the client of `service.client`, its errors, and its progress."""

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import httpx
import orjson

from service.client.bodies import ANY, JSON, Request, write_json
from service.client.clients import build_headers
from service.client.connection import Connection, Deadline, DirectTransport, run_now
from service.client.errors import ServiceError
from service.client.jobs import Work, compute
from service.client.records import Record
from service.errors import BadAddress, InvalidRequest, Issue, ServiceFailed

if TYPE_CHECKING:
    from service.encoders.format import FileFormat, Format

KEY = "SURFACE_KEY"
"""The environment variable with the caller's API key, for services that need one."""

MAX_BUSY = 90.0
"""The most seconds that a command waits for a busy service."""

LONGEST = 365 * 24 * 3600.0
"""Seconds that a command may take: jobs have no limit of time, and Ctrl-C ends the command."""

_ABSENT = frozenset({"not_found", "method_not_allowed"})
"""Codes of a service that does not have a call. Every surface service has all calls that the
commands use except those that its settings switch on, so usually another server responded."""


def fetch_mesh(url: str, id: str, options: Mapping[str, str], fmt: "Format") -> bytes:
    """The mesh file of an example or of a stored surface; raises the errors of `post`.

    `options` are the options by name, as text.
    """
    path = f"/v1/surfaces/{id}/mesh.{fmt.suffix}"
    return _send(url, Request("GET", path, options, accept=_type_of(fmt))).content


def post(
    url: str,
    path: str,
    body: dict[str, Any] | bytes,
    fmt: "FileFormat | None" = None,
    query: Mapping[str, str] = MappingProxyType({}),
    *,
    media_type: str = JSON,
    on_headers: Callable[[Mapping[str, str]], None] = lambda _: None,
) -> bytes:
    """The response to a document or a file that is posted to a path of the service at `url`.

    Parameters
    ----------
    body : dict or bytes
        The document, or the content of the file, which is sent unchanged.
    fmt : FileFormat, optional
        The format of the response; default: JSON.
    query : Mapping
        Further parameters of the URL.
    media_type : str
        That of the body.
    on_headers : callable
        Called with the headers of the result, whose names may be asked for in any case.

    Raises
    ------
    InvalidRequest
        The service reports an error of the request; the issues are from the response.
    BadAddress, ServiceFailed
    """
    accept, params = JSON, dict(query)
    if fmt is not None:
        accept, params["format"] = _type_of(fmt), fmt.name
    content = body if isinstance(body, bytes) else write_json(body)
    response = _send(url, Request("POST", path, params, content, media_type, accept))
    on_headers(response.headers)
    return response.content


def store_urls(url: str, content: bytes) -> dict[str, str]:
    """The `id` in the response to `POST /v1/surfaces`, and URLs of the surface and its meshes."""
    response = orjson.loads(content)
    links = {"self": response["links"]["self"], **response["links"]["mesh"]}
    return {"id": response["id"]} | {k: str(httpx.URL(url).join(v)) for k, v in links.items()}


def list_stored(url: str) -> Iterator[dict[str, Any]]:
    """The stored surfaces of a service, in the order of their ids: `id`, `bytes` and `time` each.

    Raises
    ------
    InvalidRequest, BadAddress, ServiceFailed
    """
    query: dict[str, str] = {"limit": "1000"}
    absent = "This service has no list of stored surfaces: it needs API keys (SURFACE_API_KEYS)."
    while query:
        page = orjson.loads(_send(url, Request("GET", "/v1/stored", query), absent).content)
        yield from page["surfaces"]
        query = dict(httpx.URL(page["links"].get("next", "")).params)


def delete(url: str, id: str) -> None:
    """Removes a stored surface; raises the errors of `list_stored`."""
    absent = "This service deletes no surfaces (SURFACE_ALLOW_DELETE), or this is an example."
    _send(url, Request("DELETE", f"/v1/surfaces/{id}", accept=ANY), absent)


def _type_of(fmt: "FileFormat") -> str:
    """The media type of a format, without parameters."""
    return fmt.media_type.partition(";")[0]


def _send(url: str, request: Request, absent: str = "") -> httpx.Response:
    """The response to a request; `absent` is the error of a service without this call."""
    progress = _Progress()
    try:
        with _connect(url) as connection:
            work = Work(Deadline.after(LONGEST), progress.show)
            return run_now(compute(connection, request, work))
    except ServiceError as error:
        raise _convert(error, url, request, absent) from None
    finally:
        progress.end()


@contextmanager
def _connect(url: str) -> Iterator[Connection]:
    """A connection with the key in the environment.

    Raises
    ------
    BadAddress
        The URL, or the key, is invalid.
    """
    try:
        headers = build_headers(url, os.environ.get(KEY))
        client = httpx.Client(base_url=url, headers=headers)
    except ValueError as error:
        raise BadAddress(f"{KEY}: {error}") from None
    except httpx.InvalidURL as error:
        raise BadAddress(f"--url: {error}") from None
    with client:
        yield Connection(url, DirectTransport(client), MAX_BUSY)


def _convert(error: ServiceError, url: str, request: Request, absent: str) -> Exception:
    """The error of a command: `InvalidRequest`, `ServiceFailed` or `BadAddress`."""
    if isinstance(error.__cause__, httpx.InvalidURL | httpx.UnsupportedProtocol):
        return BadAddress(f"--url: {error.__cause__}")
    if error.code in _ABSENT and absent:
        return InvalidRequest(Issue(error.code, absent))
    if failure := _describe_failure(error, url, request):
        return ServiceFailed(failure)
    if error.status == httpx.codes.UNAUTHORIZED:
        return InvalidRequest(Issue(error.code, error.detail, needed=f"a key in {KEY}"))
    issues = [Issue(e.code, e.message, e.pointer, e.got, e.needed) for e in error.errors]
    return InvalidRequest(*issues or [Issue(error.code, error.detail)])


def _describe_failure(error: ServiceError, url: str, request: Request) -> str:
    """The failure of a service, which is not an error of the request; "" if it is one."""
    if error.code in _ABSENT:
        about = f"{error.status} {httpx.URL(url).join(request.path)}"
        return f"{url}: not a surface service ({about})"
    if error.code == "not_a_surface_service" or not error.status:
        return error.detail
    if error.status in (httpx.codes.TOO_MANY_REQUESTS, httpx.codes.SERVICE_UNAVAILABLE):
        return f"{url} is busy: {error.detail}"
    return f"{url} failed: {error.detail}" if httpx.codes.is_server_error(error.status) else ""


class _Progress:
    """Shows the states of a job in the last line of the terminal, if there is one."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._has_shown = False

    def show(self, state: Record) -> None:
        """Replaces the line."""
        waiting = state.to_dict().get("waiting_for")
        reason = f", waits for {waiting}" if waiting else ""
        seconds = time.monotonic() - self._start
        self._write(
            f"computed as a job: {state.state}{reason}, {seconds:.0f} s; Ctrl-C withdraws it"
        )
        self._has_shown = True

    def end(self) -> None:
        """Clears the line."""
        if self._has_shown:
            self._write("")

    def _write(self, line: str) -> None:
        if sys.stderr is not None and sys.stderr.isatty():
            print(f"\r\x1b[K{line}", end="", file=sys.stderr, flush=True)
