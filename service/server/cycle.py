"""One request and its answer, as uvicorn has them, with an end that loses nothing."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from uvicorn.protocols.http.httptools_impl import RequestResponseCycle

from service.server.connections import Connections
from service.server.refusals import broken

SMALL = 1 << 16
"""Bytes of a body that are read to their end though the answer does not depend on them."""


class Wire:
    """What a request sees of its connection: it writes, and says that its answer was the last."""

    __slots__ = ("close", "is_closing", "write")

    def __init__(self, transport: asyncio.Transport, close: Callable[[], None]) -> None:
        self.write = transport.write
        self.is_closing = transport.is_closing
        self.close = close


class Cycle(RequestResponseCycle):
    """A request; its answer says `Connection: close` where nothing can come after it.

    Parameters
    ----------
    connections : Connections
        All those of the server.
    """

    def __init__(self, connections: Connections, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._connections = connections

    def send(self, message: Any) -> Coroutine[Any, Any, None]:
        """A piece of the answer."""
        if not self.response_started and (self._connections.draining or self.more_body):
            self.keep_alive = self.keep_alive and self._may_go_on()
        return super().send(message)

    def _may_go_on(self) -> bool:
        """Whether the connection can be used again after this answer.

        Not if it would mean to read a long body that nobody wants, or one of unknown length; nor if
        the client waits to be told to send it, since it may then send something else instead.
        """
        if self._connections.draining or self.waiting_for_100_continue:
            return False
        lengths = [value for name, value in self.scope["headers"] if name == b"content-length"]
        return bool(lengths) and len(lengths[0]) < 10 and int(lengths[0]) <= SMALL

    async def send_500_response(self) -> None:
        """The answer where the application has failed and not answered."""
        self.keep_alive = False
        self.response_started = self.response_complete = True
        self.transport.write(broken().answer(self.default_headers))
        self.message_event.set()
        self.transport.close()
        self.on_response()
