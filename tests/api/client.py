"""A client that calls the application in this process, without a server."""

from collections.abc import AsyncIterable, AsyncIterator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeAlias

import httpx
import orjson
from anyio.from_thread import BlockingPortal, start_blocking_portal
from starlette.types import ASGIApp

Body: TypeAlias = bytes | Iterable[bytes] | AsyncIterable[bytes]


class Client:
    """Requests to one application, on one event loop."""

    def __init__(self, app: ASGIApp, portal: BlockingPortal) -> None:
        # As behind a server: what the application raises after a 500 is the log's business.
        self._transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        self._portal = portal

    def request(
        self,
        method: str,
        url: str,
        content: Body | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> httpx.Response:
        """The answer; an iterable body arrives in its pieces and without a length."""
        return self._portal.call(self._request, method, url, content, headers)

    def get(self, url: str, headers: Mapping[str, str] | None = None) -> httpx.Response:
        return self.request("GET", url, headers=headers)

    def post(
        self, url: str, document: Any, headers: Mapping[str, str] | None = None
    ) -> httpx.Response:
        sent = {"Content-Type": "application/json", **(headers or {})}
        return self.request("POST", url, orjson.dumps(document), sent)

    async def _request(
        self,
        method: str,
        url: str,
        content: Body | None,
        headers: Mapping[str, str] | None,
    ) -> httpx.Response:
        if content is not None and not isinstance(content, bytes | AsyncIterable):
            content = _pieces(content)
        async with httpx.AsyncClient(
            transport=self._transport, base_url="http://service"
        ) as client:
            return await client.request(method, url, content=content, headers=headers)


@contextmanager
def client_of(app: ASGIApp) -> Iterator[Client]:
    """A client of `app`, until the block ends."""
    with start_blocking_portal() as portal:
        yield Client(app, portal)


async def _pieces(chunks: Iterable[bytes]) -> AsyncIterator[bytes]:
    for chunk in chunks:
        yield chunk
