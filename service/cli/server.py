"""How uvicorn serves: its protocol with a bound on heads, and its log of requests.

Its event loop is uvloop, which it takes where that is installed.
"""

import logging
from copy import deepcopy
from typing import Any

import uvicorn
from starlette.types import ASGIApp
from uvicorn.config import LOGGING_CONFIG
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

DRAIN = 25
"""Seconds that answers under way may take once the service is told to stop."""

MAX_HEAD = 1 << 16
"""Bytes of an address and of all headers together. Uvicorn's other protocol has the same bound."""


class BoundedProtocol(HttpToolsProtocol):
    """HTTP/1.1 as httptools reads it, quickly, but by itself with heads of any length.

    Bounded are the address and the headers that were read, trailers included, and the bytes that
    have come to nothing so far: a header, say, that does not end.
    """

    _head = 0
    _unread = 0

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


def _logging() -> dict[str, Any]:
    """Uvicorn's log, its lines about requests written in half of the time."""
    config = deepcopy(LOGGING_CONFIG)
    config["formatters"]["access"] = {"format": "%(levelname)s:     %(message)s"}
    return config


OPTIONS: dict[str, Any] = {
    "http": BoundedProtocol,
    "log_config": _logging(),
    "timeout_graceful_shutdown": DRAIN,
    # Nobody need know what serves; and nothing here asks who a proxy says that the client is.
    "server_header": False,
    "proxy_headers": False,
}
"""What uvicorn is told, wherever it listens."""


def serve(app: ASGIApp, host: str, port: int) -> None:
    """Answers until the process is told to stop."""
    _shorten_records()
    uvicorn.run(app, host=host, port=port, **OPTIONS)


def _shorten_records() -> None:
    """Leaves out of log records what no line of ours shows: a third of the time of a request's.

    The switches are those of the section "Optimization" in Python's "Logging HOWTO".
    """
    logging.logThreads = logging.logProcesses = False
    logging.logMultiprocessing = False
    logging._srcfile = None
