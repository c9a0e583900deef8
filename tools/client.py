"""A client that calls the application in this process, without a server."""

from collections.abc import (
    AsyncIterable,
    AsyncIterator,
    Awaitable,
    Callable,
    Iterable,
    Iterator,
    Mapping,
)
from contextlib import contextmanager
from typing import Any, TypeAlias, TypeVar

import httpx
import orjson
from anyio.from_thread import BlockingPortal, start_blocking_portal
from starlette.types import ASGIApp

Result = TypeVar("Result")
Body: TypeAlias = bytes | Iterable[bytes] | AsyncIterable[bytes]


_HEADERS = {"X-Request-Id": "a-test"}
"""Headers of all requests: with equal request ids, tests can compare the headers of responses."""


class Client:
    """Sends requests to one application; all run on one event loop."""

    def __init__(self, app: ASGIApp, portal: BlockingPortal) -> None:
        # Starlette sends the response 500 and then raises the exception again, for the log of a
        # server. The client ignores it, so that tests can check the response.
        self._transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        self._portal = portal

    def request(
        self,
        method: str,
        url: str,
        content: Body | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> httpx.Response:
        """The response to a request; each element of an iterable body arrives alone."""
        return self._portal.call(self._request, method, url, content, headers)

    def get(self, url: str, headers: Mapping[str, str] | None = None) -> httpx.Response:
        return self.request("GET", url, headers=headers)

    def get_raw(self, url: str, headers: Mapping[str, str] | None = None) -> httpx.Response:
        """The response to a GET; the client adds no `Accept-Encoding` and decodes no coding."""
        return self._portal.call(self._request_raw, "GET", url, None, headers)

    def post_raw(
        self, url: str, document: Any, headers: Mapping[str, str] | None = None
    ) -> httpx.Response:
        """The response to a POST with a JSON body, like that of `get_raw`."""
        headers = {"Content-Type": "application/json", **(headers or {})}
        content = orjson.dumps(document)
        return self._portal.call(self._request_raw, "POST", url, content, headers)

    def post(
        self, url: str, document: Any, headers: Mapping[str, str] | None = None
    ) -> httpx.Response:
        """The response to a POST request with this document as its JSON body."""
        headers = {"Content-Type": "application/json", **(headers or {})}
        return self.request("POST", url, orjson.dumps(document), headers)

    def call(self, function: Callable[..., Awaitable[Result]], *arguments: Any) -> Result:
        """The result of a coroutine function, which runs on the event loop of the requests."""
        return self._portal.call(function, *arguments)

    async def _request(
        self, method: str, url: str, content: Body | None, headers: Mapping[str, str] | None
    ) -> httpx.Response:
        if content is not None and not isinstance(content, bytes | AsyncIterable):
            content = _iterate_chunks(content)
        async with httpx.AsyncClient(
            transport=self._transport, base_url="http://service", headers=_HEADERS
        ) as client:
            return await client.request(method, url, content=content, headers=headers)

    async def _request_raw(
        self, method: str, url: str, content: bytes | None, headers: Mapping[str, str] | None
    ) -> httpx.Response:
        async with httpx.AsyncClient(
            transport=self._transport, base_url="http://service", headers=_HEADERS
        ) as client:
            client.headers.pop("Accept-Encoding")
            async with client.stream(method, url, content=content, headers=headers) as response:
                body = b"".join([chunk async for chunk in response.aiter_raw()])
        # Created without the header `Content-Encoding`, the new response does not decode the body;
        # then it gets all headers.
        other_headers = [
            pair for pair in response.headers.multi_items() if pair[0] != "content-encoding"
        ]
        raw_response = httpx.Response(response.status_code, headers=other_headers, content=body)
        raw_response.headers = response.headers
        return raw_response


@contextmanager
def start_client(app: ASGIApp) -> Iterator[Client]:
    """A client of this application, which works until the block ends."""
    with start_blocking_portal() as portal:
        yield Client(app, portal)


async def _iterate_chunks(chunks: Iterable[bytes]) -> AsyncIterator[bytes]:
    for chunk in chunks:
        yield chunk
