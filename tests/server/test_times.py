"""Timeouts of connections, and the limit of their number."""

import socket
import time

import pytest
from starlette.types import Receive, Scope, Send

from service.settings.values import Settings
from tools.live import run_service
from tools.wire import Server, settle

pytestmark = pytest.mark.anyio
MIB = 1 << 20
GET = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"


async def respond_at_once(_scope: Scope, _receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body", "body": b""})


async def respond_after_body(_scope: Scope, receive: Receive, send: Send) -> None:
    """An application that responds after it has received the whole body."""
    while (await receive()).get("more_body"):
        pass
    await respond_at_once(_scope, receive, send)


async def test_a_connection_without_input_is_closed_without_a_response() -> None:
    server = Server(respond_at_once, head_timeout=10)
    client = server.connect()
    server.wait(9)
    assert not client.wire.is_closed
    server.wait(2)
    assert (client.wire.is_closed, client.wire.sent_bytes) == (True, b"")


@pytest.mark.parametrize("earlier_request", [b"", GET], ids=["first request", "later request"])
@pytest.mark.parametrize("head", [b"GET /long HTTP/1.1\r\nX: ", b"\r\n"])
async def test_a_head_that_is_sent_byte_by_byte_is_too_slow(
    earlier_request: bytes, head: bytes
) -> None:
    """The time of the first head begins with the connection, the time of a later head with its
    first byte."""
    server = Server(respond_at_once, head_timeout=10, keep_alive=1000)
    client = server.connect()
    if earlier_request:
        await client.send(earlier_request)
        server.wait(8)
    await client.send(head)
    for _ in range(9):
        server.wait(1)
        await client.send(b"\r\n" if head == b"\r\n" else b"a")
    assert not client.wire.has_ended
    server.wait(2)
    await settle()
    assert client.problem["status"] == 408
    assert client.problem["code"] == "head_too_slow"
    assert server.refusals == ["head_too_slow"]


async def test_the_time_of_a_head_that_begins_during_a_response_begins_with_its_next_byte() -> None:
    server = Server(respond_after_body, head_timeout=10)
    client = server.connect()
    await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
    server.wait(100)
    assert not client.wire.is_closed
    await client.send(b"xGET / HT")
    await client.send(b"T")
    server.wait(9)
    assert client.statuses == [204]
    server.wait(2)
    await settle()
    assert client.statuses == [204, 408]


async def test_connections_above_the_limit_are_refused() -> None:
    server = Server(respond_after_body, max_connections=2)
    clients = [server.connect() for _ in range(2)]
    for client in clients:
        await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
    refused_client = server.connect()
    await refused_client.send(GET)
    assert refused_client.statuses == [503]
    assert refused_client.problem["code"] == "too_many_connections"
    assert refused_client.problem["headers"]["retry-after"] == "1"
    assert refused_client.wire.is_closed
    assert server.refusals == ["too_many_connections"]
    for client in clients:
        await client.send(b"x")
        assert client.statuses == [204]


def test_an_idle_connection_is_closed_without_a_response() -> None:
    with run_service(Settings(keep_alive=0.2)) as url, connect(url) as client:
        client.sendall(GET)
        data = read(client)
    assert data.startswith(b"HTTP/1.1 200 OK")
    assert data.count(b"HTTP/1.1 ") == 1


@pytest.mark.parametrize(
    ("unsent_count", "seconds"), [(70_000, 30), (3 * MIB - 1, 90), (3 * MIB, 120)]
)
async def test_a_client_must_read_a_response_before_its_deadline(
    unsent_count: int, seconds: int
) -> None:
    """The client has `send_timeout` seconds, and as many again for each whole MiB unsent."""
    server = Server(respond_after_body, send_timeout=30)
    client = server.connect()
    await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
    for is_read in (True, False):
        client.wire.unsent_count = unsent_count
        client.protocol.pause_writing()
        server.wait(seconds - 1)
        assert not client.wire.is_closed
        if is_read:
            client.wire.unsent_count = 0
            client.protocol.resume_writing()
            server.wait(60)
            assert not client.wire.is_closed
    server.wait(2)
    assert client.wire.is_aborted
    client.lose()


def test_the_connection_of_a_client_that_does_not_read_is_closed() -> None:
    """The response has 36 MB, more than fits into the buffers of the connection."""
    with run_service(Settings(send_timeout=0.1)) as url, connect(url) as client:
        client.sendall(GET.replace(b"/", b"/v1/surfaces/saddle/mesh.stl?resolution=600", 1))
        assert client.recv(15, socket.MSG_WAITALL) == b"HTTP/1.1 200 OK"
        # Sending to a closed connection fails after some time.
        with pytest.raises(OSError, match=r"reset|pipe"):
            send_for_ever(client)


def send_for_ever(client: socket.socket) -> None:
    while True:
        client.sendall(b"\r\n")
        time.sleep(0.01)


@pytest.mark.parametrize("close_header", [b"", b"Connection: close\r\n"])
def test_a_client_reads_the_response_although_its_body_is_refused(close_header: bytes) -> None:
    settings = Settings(max_body_bytes=1024, keep_alive=1)
    with run_service(settings) as url, connect(url) as client:
        client.sendall(
            b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
            b"Content-Length: 8000000\r\n" + close_header + b"\r\n"
        )
        for _ in range(8):
            client.sendall(b" " * 1_000_000)
        response = read(client)
    assert response.startswith(b"HTTP/1.1 413 ")
    assert b'"code":"body_too_large"' in response


def connect(url: str) -> socket.socket:
    return socket.create_connection(("127.0.0.1", int(url.rsplit(":", 1)[1])), timeout=30)


def read(client: socket.socket) -> bytes:
    """All bytes until the connection is closed."""
    response = b""
    while piece := client.recv(1 << 16):
        response += piece
    return response
