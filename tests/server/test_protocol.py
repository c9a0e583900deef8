"""The server's own bound: heads of requests, whatever they are made of."""

import asyncio

import httpx
import pytest
from starlette.types import Receive, Scope, Send
from uvicorn.server import ServerState

from service.server.connections import Connections
from service.server.protocol import MAX_HEAD, BoundedProtocol
from service.server.run import make_server
from service.settings.values import Settings

CHUNK = 1 << 14
FIRST = b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\n"
CHUNKED = FIRST + b"Transfer-Encoding: chunked\r\n"


class Wire(asyncio.Transport):
    """The other end of a connection: what was answered, and whether it was closed."""

    def __init__(self) -> None:
        super().__init__()
        self.answer = b""
        self.closed = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.answer += bytes(data)

    def close(self) -> None:
        self.closed = True

    def is_closing(self) -> bool:
        return self.closed

    def pause_reading(self) -> None:
        """Goes on: what was sent already arrives."""

    def resume_reading(self) -> None:
        """Never stopped."""


async def patient(_scope: Scope, receive: Receive, _send: Send) -> None:
    """An application that waits for the end of a body."""
    while (await receive()).get("more_body"):
        pass


async def read(start: bytes, piece: bytes, most: int) -> tuple[int, bytes]:
    """How much of an endless request is read, and what is answered."""
    config = make_server(patient, Settings()).config
    config.load()
    protocol, wire = BoundedProtocol(Connections(), config, ServerState(), {}), Wire()
    protocol.connection_made(wire)
    protocol.data_received(start)
    done = len(start)
    while done < most and not wire.closed:
        protocol.data_received(piece)
        done += len(piece)
    protocol.connection_lost(None)
    await asyncio.gather(*protocol.tasks)
    return done, wire.answer


@pytest.mark.parametrize(
    ("start", "piece"),
    [
        (b"GET /", b"a" * CHUNK),
        (b"GET /v1/surfaces?", b"a=1&" * (CHUNK // 4)),
        (FIRST + b"X-Long: ", b"a" * CHUNK),
        (FIRST + b"X", b"a" * CHUNK),
        (FIRST, b"X-Many: a\r\n" * 1000),
        (CHUNKED + b"\r\n0\r\n", b"X-Trailer: a\r\n" * 1000),
        (CHUNKED + b"\r\n0\r\nX-Trailer: ", b"a" * CHUNK),
        (CHUNKED + b"\r\n1;", b"extension" * 2000),
    ],
    ids=["path", "query", "value", "name", "headers", "trailers", "trailer", "extension"],
)
def test_a_head_that_does_not_end_is_refused(start: bytes, piece: bytes) -> None:
    done, answer = asyncio.run(read(start, piece, 20 * MAX_HEAD))
    assert MAX_HEAD < done <= 2 * MAX_HEAD + len(start) + len(piece)
    assert answer.startswith(b"HTTP/1.1 400 ")


def test_a_body_is_of_any_length_and_its_chunks_as_well() -> None:
    done, answer = asyncio.run(read(CHUNKED + b"\r\n", b"1;a=b\r\nx\r\n" * 1000, 20 * MAX_HEAD))
    assert (done >= 20 * MAX_HEAD, answer) == (True, b"")


def test_long_heads_and_longer_bodies_are_read(server: str) -> None:
    headers = {"X-Long": "a" * (MAX_HEAD - 2000), "Content-Type": "application/json"}
    body = b" " * (3 * MAX_HEAD) + b"{}"
    answer = httpx.post(f"{server}/v1/mesh", content=body, headers=headers)
    assert answer.json()["errors"][0]["code"] == "missing_field"


def test_every_request_of_a_connection_has_its_own_bound(server: str) -> None:
    with httpx.Client(base_url=server, headers={"X-Long": "a" * 30_000}) as client:
        for _ in range(5):
            assert client.get("/health/live").status_code == 200
