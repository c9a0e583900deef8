"""HTTP/1.1 as it is spoken here: uvicorn's own protocol, with bounds."""

import asyncio
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from service.server.connections import Connections

MAX_HEAD = 1 << 16
"""Bytes of an address and of all headers together. Uvicorn's other protocol has the same bound."""


class BoundedProtocol(HttpToolsProtocol):
    """HTTP/1.1 as httptools reads it, quickly, but by itself with heads of any length.

    Bounded are the address and the headers that were read, trailers included, and the bytes that
    have come to nothing so far: a header, say, that does not end.
    """

    _head = 0
    _unread = 0

    def __init__(self, connections: Connections, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._all = connections

    @property
    def is_idle(self) -> bool:
        """Whether nothing of a request has arrived, and no answer is under way."""
        return not self._unread and getattr(self.cycle, "response_complete", True)

    def drain(self) -> None:
        """Makes an answer that has not begun yet the last."""
        cycle: RequestResponseCycle | None = self.cycle
        if cycle and not cycle.response_started:
            cycle.keep_alive = False

    def close(self) -> None:
        """Ends the connection, once what was written has been taken."""
        self.transport.close()

    def abort(self) -> None:
        """Ends the connection, and forgets what was written."""
        self.transport.abort()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client has come."""
        super().connection_made(transport)
        self._all.all.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """A client has gone."""
        self._all.all.discard(self)
        super().connection_lost(exc)

    def on_headers_complete(self) -> None:
        """The head of a request has been read."""
        super().on_headers_complete()
        if self._all.draining:
            self.cycle.keep_alive = False

    def data_received(self, data: bytes) -> None:
        """Some bytes: whatever ends within them sets the number of the unread ones to zero."""
        self._unread += len(data)
        super().data_received(data)
        if self._unread > MAX_HEAD and not self.transport.is_closing():
            self.send_400_response("Invalid HTTP request received.")

    def on_message_begin(self) -> None:
        """A request begins."""
        self._head = 0
        super().on_message_begin()

    def on_url(self, url: bytes) -> None:
        """The address, or a piece of it."""
        self._count(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        """A header, or a trailer."""
        self._count(len(name) + len(value))
        super().on_header(name, value)

    def on_body(self, body: bytes) -> None:
        """Bytes of the body, which the application bounds."""
        self._unread = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The request has been read."""
        self._unread = 0
        super().on_message_complete()

    def _count(self, length: int) -> None:
        self._unread = 0
        self._head += length
        if self._head > MAX_HEAD:
            # For the parser this is a request that it cannot read: 400, and the connection closes.
            raise ValueError("the head of the request is too long")
