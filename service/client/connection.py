"""A connection to a service: its key, its retries, its deadline and its errors.

The code is that of a coroutine. In `Client` its operations return at once, so that the coroutine
runs to its end without an event loop; in `AsyncClient` they wait.
"""

import asyncio
import time
from collections.abc import AsyncGenerator, Coroutine, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from math import inf
from typing import Any, Protocol, TypeVar

import httpx

from service.client.bodies import ANY, Request
from service.client.errors import ServiceError, read_problem

Result = TypeVar("Result")

CONNECT, MAX_SILENCE = 10.0, 600.0
"""The most seconds to wait for a connection, and for the next bytes of a response."""

LEAST = 0.001
"""The seconds of a request after the deadline: it fails as one that takes too long."""

_BUSY = frozenset({429, 503})
"""Statuses of a busy service. Every request may be sent again, even if the service had begun to
compute: to store a surface twice changes nothing."""

_ABSENT = frozenset({"not_found", "method_not_allowed"})
"""Codes of a service that does not have a call."""


class Transport(Protocol):
    """Sends requests: at once in this thread, or in an event loop."""

    async def request(self, method: str, url: str, **options: Any) -> httpx.Response:
        """The response to a request; `options` are those of `httpx.Client.request`."""
        ...

    def lines(self, url: str, timeout: httpx.Timeout) -> AsyncGenerator[str, None]:
        """The lines of a response as they come; raises `httpx.HTTPStatusError` without one."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Waits."""
        ...


class DirectTransport:
    """Sends requests in this thread: its coroutines never wait."""

    def __init__(self, client: httpx.Client) -> None:
        self.client = client

    async def request(self, method: str, url: str, **options: Any) -> httpx.Response:
        """The response to a request."""
        return self.client.request(method, url, **options)

    async def lines(self, url: str, timeout: httpx.Timeout) -> AsyncGenerator[str, None]:
        """The lines of a response."""
        with self.client.stream("GET", url, timeout=timeout) as response:
            if not response.is_success:
                response.read()
            response.raise_for_status()
            for line in response.iter_lines():
                yield line

    async def sleep(self, seconds: float) -> None:
        """Sleeps."""
        time.sleep(seconds)


class AsyncTransport:
    """Sends requests in an event loop."""

    def __init__(self, client: httpx.AsyncClient) -> None:
        self.client = client

    async def request(self, method: str, url: str, **options: Any) -> httpx.Response:
        """The response to a request."""
        return await self.client.request(method, url, **options)

    async def lines(self, url: str, timeout: httpx.Timeout) -> AsyncGenerator[str, None]:
        """The lines of a response."""
        async with self.client.stream("GET", url, timeout=timeout) as response:
            if not response.is_success:
                await response.aread()
            response.raise_for_status()
            async for line in response.aiter_lines():
                yield line

    async def sleep(self, seconds: float) -> None:
        """Waits in the event loop."""
        await asyncio.sleep(seconds)


def run_now(coroutine: Coroutine[Any, Any, Result]) -> Result:
    """The result of a coroutine whose operations return at once."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        result: Result = end.value
        return result
    raise AssertionError("an operation waits")


@dataclass(frozen=True, slots=True)
class Deadline:
    """The moment until which a call may take, by `time.monotonic`."""

    end: float

    @classmethod
    def after(cls, seconds: float) -> "Deadline":
        """The deadline in some seconds."""
        return cls(time.monotonic() + seconds)

    @property
    def left(self) -> float:
        """Seconds that are left; 0 after the deadline."""
        return max(self.end - time.monotonic(), 0.0)


class Connection:
    """A service at a URL.

    `max_busy` are the most seconds for which one request waits while the service is busy; the
    deadline of a call limits them, too.
    """

    def __init__(self, url: str, transport: Transport, max_busy: float = inf) -> None:
        self.url, self.transport, self.max_busy = url, transport, max_busy

    async def send(
        self,
        request: Request,
        deadline: Deadline,
        patience: float = inf,
        headers: Mapping[str, str] | None = None,
    ) -> httpx.Response:
        """The response, also if it is an error; a busy service is asked again until the deadline.

        A request that took too much time is not sent again, because it would again.

        Raises
        ------
        httpx.ReadTimeout
            No response within `patience` seconds.
        ServiceError
        """
        options: dict[str, Any] = {"headers": dict(headers or {})}
        if request.method == "POST":
            options["content"] = request.content
            options["headers"]["Content-Type"] = request.media_type
        waited = 0.0
        while True:
            left = max(min(deadline.left, MAX_SILENCE), LEAST)
            timeout = httpx.Timeout(left, connect=min(left, CONNECT), read=min(left, patience))
            with self._errors(is_patient=patience >= left):
                response = await self.transport.request(
                    request.method, request.url, timeout=timeout, **options
                )
            wait = find_wait(response)
            if wait is None or wait > min(deadline.left, self.max_busy - waited):
                return response
            waited += wait
            await self.transport.sleep(wait)

    def read(self, response: httpx.Response, accept: str) -> httpx.Response:
        """The response, if it is a success of this media type.

        Raises
        ------
        ServiceError
        """
        media_type = response.headers.get("content-type", "").partition(";")[0]
        if response.is_success and accept in (ANY, media_type):
            return response
        problem = find_problem(response)
        if not problem:
            detail = f"{self.url}: not a surface service ({response.status_code} {response.url})"
            raise ServiceError(response.status_code, "not_a_surface_service", detail)
        raise read_problem(problem)

    def fail(self, error: Exception, code: str = "unreachable") -> ServiceError:
        """The error of a service that does not respond."""
        failure = ServiceError(0, code, f"{self.url} does not answer: {type(error).__name__}")
        failure.__cause__ = error
        return failure

    @contextmanager
    def _errors(self, *, is_patient: bool) -> Iterator[None]:
        """Raises errors of the connection as `ServiceError`, but that of a patience as it is."""
        try:
            yield
        except httpx.ReadTimeout as error:
            if not is_patient:
                raise
            raise self.fail(error, "timeout") from error
        except httpx.TimeoutException as error:
            raise self.fail(error, "timeout") from error
        except (httpx.TransportError, httpx.InvalidURL) as error:
            raise self.fail(error) from error


def find_problem(response: httpx.Response) -> dict[str, Any]:
    """The problem document (RFC 9457) in a response; empty if no surface service wrote it."""
    if not response.headers.get("content-type", "").startswith("application/problem+json"):
        return {}
    try:
        problem = response.json()
    except ValueError:
        return {}
    is_problem = isinstance(problem, dict) and {"code", "detail", "errors"} <= problem.keys()
    return {"status": response.status_code, **problem} if is_problem else {}


def find_wait(response: httpx.Response) -> float | None:
    """Seconds after which a busy service wants to be asked again; None for other responses."""
    header = response.headers.get("retry-after")
    if response.status_code not in _BUSY or header is None:
        return None
    if find_problem(response).get("code") == "out_of_time":
        return None
    if header.isdecimal():
        return float(header)
    try:
        moment = parsedate_to_datetime(header)
    except ValueError:
        return None
    return max((moment - datetime.now(UTC)).total_seconds(), 0.0)
