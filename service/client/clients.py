"""The clients: `Client` returns when the answer is there, `AsyncClient` in an event loop."""

import re
from collections.abc import Coroutine, Sequence
from typing import Any, Self, TypeVar
from urllib.parse import quote

import httpx

from service.client import calls
from service.client.bodies import JSON, Request, build_request, unwrap
from service.client.call import Asynchronous, Direct, Part
from service.client.connection import (
    AsyncTransport,
    Connection,
    Deadline,
    DirectTransport,
    Transport,
    run_now,
)
from service.client.errors import ServiceError
from service.client.jobs import Progress, Work, compute, compute_all, show_nothing
from service.client.surfaces import FILE_FIELDS

A = TypeVar("A")

TIMEOUT = 600.0
"""The default seconds that a call may take."""

_LOOPBACK = frozenset({"127.0.0.1", "::1", "localhost"})
"""Hosts on this machine, to which no network is slower than compression."""

MAX_KEPT = 16
"""The most surfaces whose definitions a client keeps: for calls by id that take no id."""


class Calls:
    """All calls, one row each."""

    mesh = calls.mesh
    image = calls.image
    points = calls.points
    curve = calls.curve
    project = calls.project
    intersect = calls.intersect
    measure = calls.measure
    check = calls.check
    convert = calls.convert
    estimate = calls.estimate
    store = calls.store
    sign = calls.sign


class Session:
    """The common part of both clients: a connection, the time of a call, definitions by id."""

    def __init__(self, url: str, transport: Transport, timeout: float) -> None:
        self.connection, self.timeout = Connection(url, transport), timeout
        self._definitions: dict[str, Any] = {}

    async def perform(self, part: Part[A]) -> A:
        """The answer of a call."""
        work = self._begin()
        request = await self._complete(part, work)
        return part.call.read((await compute(self.connection, request, work)).content)

    async def fetch(self, part: Part[Any], format: str) -> bytes:
        """The answer of a call as a file."""
        work = self._begin()
        request = await self._complete(part, work, format)
        return (await compute(self.connection, request, work)).content

    async def job(
        self, parts: Sequence[Part[A]], timeout: float | None, progress: Progress
    ) -> list[A | ServiceError]:
        """The answers of several calls, computed as one job."""
        work = Work(Deadline.after(self.timeout if timeout is None else timeout), progress)
        requests = [await self._complete(part, work, is_part=True) for part in parts]
        results = await compute_all(self.connection, requests, work)
        return [
            result if isinstance(result, ServiceError) else part.call.read(result.content)
            for part, result in zip(parts, results, strict=True)
        ]

    def _begin(self) -> Work:
        return Work(Deadline.after(self.timeout))

    async def _complete(
        self,
        part: Part[Any],
        work: Work,
        format: str | None = None,
        *,
        is_part: bool = False,
    ) -> Request:
        """The request of a call; gets the surface of an id, or of a file, if its body needs it."""
        request = build_request(part, format)
        if request is None or (is_part and request.media_type != JSON):
            part = await self._resolve(part, work)
            request = build_request(part, format)
        assert request is not None
        return request

    async def _resolve(self, part: Part[Any], work: Work) -> Part[Any]:
        """The call with a dictionary in place of an id or a file."""
        subject = unwrap(part.subject)
        if isinstance(subject, str):
            return Part(part.call, await self._define(subject, work), part.fields)
        names = part.fields.keys() & FILE_FIELDS
        beside = {name: part.fields[name] for name in names}
        request = build_request(Part(calls.convert, subject, beside))
        assert request is not None
        converted = calls.convert.read((await compute(self.connection, request, work)).content)
        others = {name: value for name, value in part.fields.items() if name not in names}
        return Part(part.call, converted.surface, others)

    async def _define(self, id: str, work: Work) -> Any:
        """The definition of a built-in or a stored surface; the last ones are kept."""
        if id not in self._definitions:
            request = Request("GET", f"/v1/surfaces/{quote(id, safe='')}")
            response = await compute(self.connection, request, work)
            while len(self._definitions) >= MAX_KEPT:
                del self._definitions[next(iter(self._definitions))]
            self._definitions[id] = response.json()["surface"]
        return self._definitions[id]


class Client(Calls, Direct):
    """A service at a URL, for programs without an event loop; several threads may share it.

    Parameters
    ----------
    url : str
    key : str, optional
        The API key, for a service that needs one.
    timeout : float
        The most seconds that a call may take, with all waiting for a busy service, and for a job.

    Raises
    ------
    ValueError
        The key has characters that no key has.
    """

    def __init__(self, url: str, key: str | None = None, timeout: float = TIMEOUT) -> None:
        self._client = httpx.Client(base_url=url, headers=build_headers(url, key))
        self._session = Session(url, DirectTransport(self._client), timeout)

    def perform(self, part: Part[A]) -> A:
        """The answer of a call."""
        return run_now(self._session.perform(part))

    def file(self, part: Part[Any], format: str) -> bytes:
        """The answer of a call as a file, as in `client.file(Client.mesh.part("sphere"), "glb")`.

        `format` is the name of a format that the call has.
        """
        return run_now(self._session.fetch(part, format))

    def job(
        self,
        parts: Sequence[Part[A]],
        *,
        timeout: float | None = None,
        progress: Progress = show_nothing,
    ) -> list[A | ServiceError]:
        """The answers of several calls, which the service computes as one job.

        Parameters
        ----------
        parts : sequence of Part
            `Client.mesh.part(surface, resolution=8)` and the like.
        timeout : float, optional
            The most seconds that the job may take; default: that of the client.
        progress : callable
            Called with each state of the job.

        Returns
        -------
        list
            For each part its answer, or the error with which it failed.
        """
        return run_now(self._session.job(parts, timeout, progress))

    def close(self) -> None:
        """Closes the connections."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncClient(Calls, Asynchronous):
    """A service at a URL, for programs with an event loop; the parameters are those of `Client`."""

    def __init__(self, url: str, key: str | None = None, timeout: float = TIMEOUT) -> None:
        self._client = httpx.AsyncClient(base_url=url, headers=build_headers(url, key))
        self._session = Session(url, AsyncTransport(self._client), timeout)

    def perform(self, part: Part[A]) -> Coroutine[Any, Any, A]:
        """The answer of a call."""
        return self._session.perform(part)

    async def file(self, part: Part[Any], format: str) -> bytes:
        """The answer of a call as a file, as `Client.file`."""
        return await self._session.fetch(part, format)

    async def job(
        self,
        parts: Sequence[Part[A]],
        *,
        timeout: float | None = None,
        progress: Progress = show_nothing,
    ) -> list[A | ServiceError]:
        """The answers of several calls, which the service computes as one job, as `Client.job`."""
        return await self._session.job(parts, timeout, progress)

    async def aclose(self) -> None:
        """Closes the connections."""
        await self._client.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.aclose()


def build_headers(url: str, key: str | None) -> dict[str, str]:
    """The headers of every request: the key; and within one machine, that nothing is compressed.

    Raises
    ------
    ValueError
        The key has characters that no key has.
    """
    headers = {"Accept-Encoding": "identity"} if httpx.URL(url).host in _LOOPBACK else {}
    if not key:
        return headers
    if not re.fullmatch("[!-~]+", key):
        raise ValueError("needed a key of ASCII characters without spaces")
    return headers | {"Authorization": f"Bearer {key}"}
