"""Connections to the server's protocol without a network, with a clock that tests set."""

import asyncio
import json
import re
from types import SimpleNamespace
from typing import Any

from starlette.types import ASGIApp
from uvicorn.server import ServerState

from service.server.protocol import BoundedProtocol
from service.server.run import make_server
from service.settings.values import Settings

STATUS = re.compile(rb"HTTP/1\.1 [0-9]{3} ")


class Clock:
    """The event loop with a clock that only tests change."""

    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self.now = 1000.0

    def time(self) -> float:
        return self.now

    def __getattr__(self, name: str) -> Any:
        return getattr(self.loop, name)


class Wire(asyncio.Transport):
    """The transport of a connection: records what the server sends, and whether it closes."""

    def __init__(self) -> None:
        super().__init__()
        self.sent_bytes = b""
        self.is_closed = self.is_aborted = self.has_ended = self.is_paused = False
        self.unsent_count = 0

    def write(self, data: bytes | bytearray | memoryview) -> None:
        assert not self.has_ended
        assert not self.is_closed
        self.sent_bytes += bytes(data)

    def write_eof(self) -> None:
        self.has_ended = True

    def get_write_buffer_size(self) -> int:
        return self.unsent_count

    def close(self) -> None:
        self.is_closed = True

    def abort(self) -> None:
        self.is_closed = self.is_aborted = True

    def is_closing(self) -> bool:
        return self.is_closed

    def pause_reading(self) -> None:
        self.is_paused = True

    def resume_reading(self) -> None:
        self.is_paused = False


class Server:
    """A server whose connections are objects in memory; `refusals` has the codes of refusals."""

    def __init__(self, app: ASGIApp, **settings: Any) -> None:
        self.clock = Clock()
        self.refusals: list[str] = []
        counters = SimpleNamespace(count_refusal=self.refusals.append)
        self.app_state = SimpleNamespace(ready=True, counters=counters)
        self._config = make_server(app, Settings(**settings), self.app_state).config
        self._config.load()
        self.state = ServerState()

    def connect(self) -> "Client":
        """A client with a new connection."""
        # `make_server` gave `self.app_state` to the class. The argument `app_state` is another one:
        # the state of the ASGI lifespan, which the applications of these tests do not use.
        protocol_class: Any = self._config.http_protocol_class
        return Client(
            protocol_class(
                config=self._config, server_state=self.state, app_state={}, _loop=self.clock
            )
        )

    def wait(self, seconds: float) -> None:
        """Advances the clock, and closes connections that are late."""
        self.clock.now += seconds
        for connection in list(self.state.connections):
            assert isinstance(connection, BoundedProtocol)
            connection.end_if_late(self.clock.now)


class Client:
    """The client of one connection."""

    def __init__(self, protocol: BoundedProtocol) -> None:
        self.protocol = protocol
        self.wire = Wire()
        protocol.connection_made(self.wire)

    async def send(self, data: bytes) -> None:
        """Sends bytes, and runs the event loop until the server waits."""
        if not self.wire.is_closed:
            self.protocol.data_received(data)
        await settle()

    def lose(self) -> None:
        """Tells the server that the connection is lost."""
        self.protocol.connection_lost(None)

    @property
    def statuses(self) -> list[int]:
        """The statuses of all responses, in their order."""
        return [int(line.split()[1]) for line in STATUS.findall(self.wire.sent_bytes)]

    @property
    def problem(self) -> dict[str, Any]:
        """The last response, which must be a problem, after which the connection is closed."""
        starts = [match.start() for match in STATUS.finditer(self.wire.sent_bytes)]
        head, _, body = self.wire.sent_bytes[starts[-1] :].partition(b"\r\n\r\n")
        lines = head.decode().split("\r\n")
        headers = dict(line.split(": ", 1) for line in lines[1:])
        assert headers["content-type"] == "application/problem+json"
        assert headers["cache-control"] == "no-store"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["connection"] == "close"
        assert int(headers["content-length"]) == len(body)
        document: dict[str, Any] = json.loads(body)
        assert lines[0] == f"HTTP/1.1 {document['status']} {document['title']}"
        assert self.wire.has_ended or self.wire.is_closed
        return {**document, "headers": headers}


async def settle() -> None:
    """Runs the event loop for 20 rounds, in which every response becomes complete."""
    for _ in range(20):
        await asyncio.sleep(0)
