"""How long a connection may do nothing, and how many there may be."""

import socket
import struct
import time
from collections.abc import Callable

import pytest
from starlette.types import ASGIApp, Receive, Scope, Send

from service.server.connections import MIB, REFUSED_AT_ONCE
from service.server.listening import listen, notice_the_vanished
from service.settings.values import Settings
from tests.live import running_service
from tests.server.wire import Server, play, settle

GET = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"


async def quick(_scope: Scope, _receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body", "body": b""})


async def waiting(_scope: Scope, receive: Receive, send: Send) -> None:
    """An application that answers once the body is there."""
    while (await receive()).get("more_body"):
        pass
    await quick(_scope, receive, send)


def test_a_connection_on_which_nothing_arrives_is_closed_without_a_word() -> None:
    async def scene() -> None:
        server = Server(quick, head_timeout=10)
        client = server.connect()
        server.wait(9)
        assert not client.wire.closed
        server.wait(2)
        assert (client.wire.closed, client.wire.answer) == (True, b"")

    play(scene)


@pytest.mark.parametrize("before", [b"", GET], ids=["the first", "a later one"])
@pytest.mark.parametrize("head", [b"GET /long HTTP/1.1\r\nX: ", b"\r\n"])
def test_a_head_that_comes_byte_by_byte_has_its_time_from_its_first(
    before: bytes, head: bytes
) -> None:
    async def scene() -> None:
        server = Server(quick, head_timeout=10, keep_alive=1000)
        client = server.connect()
        await client.send(before)
        server.wait(8)
        await client.send(head)
        for _ in range(9):
            server.wait(1)
            await client.send(b"\r\n" if head == b"\r\n" else b"a")
        assert not client.wire.ended
        server.wait(2)
        assert client.problem["status"] == 408
        assert client.problem["code"] == "head_too_slow"
        assert server.refused == ["head_too_slow"]

    play(scene)


def test_a_head_that_begins_during_an_answer_has_its_time_from_its_end() -> None:
    async def scene() -> None:
        server = Server(waiting, head_timeout=10)
        client = server.connect()
        await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
        server.wait(100)
        assert not client.wire.closed
        await client.send(b"xGET / HT")
        server.wait(9)
        assert client.statuses == [204]
        server.wait(2)
        assert client.statuses == [204, 408]

    play(scene)


def test_an_idle_connection_is_closed_without_a_word() -> None:
    async def scene() -> None:
        server = Server(quick, head_timeout=10, keep_alive=75)
        client = server.connect()
        for _ in range(3):
            await client.send(GET)
            server.wait(74)
        assert not client.wire.closed
        server.wait(2)
        assert (client.wire.closed, client.statuses) == (True, [204] * 3)

    play(scene)


def test_a_body_that_was_not_waited_for_must_come_as_well() -> None:
    async def scene() -> None:
        server = Server(quick, head_timeout=10)
        client = server.connect()
        await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n")
        server.wait(5)
        await client.send(b"x")
        server.wait(6)
        assert (client.wire.closed, client.statuses) == (True, [204])

    play(scene)


def test_the_longest_idle_connection_goes_for_a_newcomer() -> None:
    async def scene() -> None:
        server = Server(quick, max_connections=3)
        clients = [server.connect() for _ in range(3)]
        server.clock.now += 1
        for client in clients:
            await client.send(GET)
            server.clock.now += 1
        await clients[0].send(GET)  # now the second one has been idle for longest
        newcomers = [server.connect()]
        assert [client.wire.closed for client in clients] == [False, True, False]
        clients[1].lose()
        await clients[0].send(b"GET / ")
        await clients[2].send(b"GET / ")
        server.clock.now += 1
        newcomers.append(server.connect())
        assert [each.wire.closed for each in newcomers] == [True, False]
        assert server.refused == []

    play(scene)


def test_where_none_is_idle_the_newcomer_is_refused() -> None:
    async def scene() -> None:
        server = Server(waiting, max_connections=2)
        clients = [server.connect() for _ in range(2)]
        for client in clients:
            await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
        newcomers = [server.connect() for _ in range(REFUSED_AT_ONCE)]
        await newcomers[0].send(GET)
        for each in newcomers:
            assert each.statuses == [503]
            assert each.problem["code"] == "too_many_connections"
            assert each.problem["headers"]["retry-after"] == "1"
        assert server.refused == ["too_many_connections"] * REFUSED_AT_ONCE
        last = server.connect()
        assert (last.wire.aborted, last.wire.answer) == (True, b"")
        for client in clients:
            await client.send(b"x")
            assert client.statuses == [204]

    play(scene)


@pytest.mark.parametrize(("unsent", "seconds"), [(70_000, 30), (3 * MIB, 90), (3 * MIB + 1, 120)])
def test_an_answer_must_be_taken_in_its_time(unsent: int, seconds: int) -> None:
    async def scene() -> None:
        server = Server(waiting, send_timeout=30)
        client = server.connect()
        await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
        for is_taken in (True, False):
            client.wire.unsent = unsent
            client.protocol.pause_writing()
            server.wait(seconds - 1)
            assert not client.wire.closed
            if is_taken:
                client.wire.unsent = 0
                client.protocol.resume_writing()
                server.wait(60)
                assert not client.wire.closed
        server.wait(2)
        assert client.wire.aborted

    play(scene)


def test_the_short_rest_of_an_answer_must_be_taken_too() -> None:
    async def scene() -> None:
        server = Server(quick, send_timeout=30, keep_alive=75)
        client = server.connect()
        await client.send(GET)
        client.wire.unsent = 1
        server.wait(29)
        assert not client.wire.closed
        server.wait(2)
        assert client.wire.aborted

    play(scene)


def test_who_is_closed_must_take_the_rest_as_well() -> None:
    async def scene() -> None:
        server = Server(quick, send_timeout=30)
        client = server.connect()
        client.wire.unsent = 100
        client.protocol.eof_received()
        client.protocol.close()
        server.wait(29)
        assert not client.wire.aborted
        server.wait(2)
        assert client.wire.aborted

    play(scene)


def test_when_the_process_ends_who_waits_is_told() -> None:
    async def scene() -> None:
        server = Server(waiting)
        client, idle = server.connect(), server.connect()
        await client.send(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n")
        server.connections.give_up()
        await settle()
        assert (client.problem["status"], client.problem["code"]) == (503, "draining")
        assert client.problem["headers"]["retry-after"] == "1"
        assert (idle.wire.aborted, idle.wire.answer) == (True, b"")

    play(scene)


def test_nothing_is_kept_of_connections_that_are_closed() -> None:
    async def scene() -> None:
        server = Server(quick)
        for data in (b"", b"GET", GET, b"BREW", GET + b"GET"):
            client = server.connect()
            await client.send(data)
            client.lose()
        connections = server.connections
        assert len(connections) == 0
        queues = (connections.silent, connections.arriving, connections.idle, connections.taking)
        assert not any(queues)

    play(scene)


async def large(_scope: Scope, _receive: Receive, send: Send) -> None:
    """More than the system keeps for a connection."""
    await send({"type": "http.response.start", "status": 200, "headers": []})
    for _ in range(40):
        await send({"type": "http.response.body", "body": bytes(MIB), "more_body": True})
    await send({"type": "http.response.body", "body": b""})


def test_a_client_that_does_not_read_loses_its_connection() -> None:
    settings = Settings(send_timeout=0.1)
    around = beside(large, "/large")
    with running_service(settings, around) as url, socket.socket() as stalled:
        stalled.connect(("127.0.0.1", int(url.rsplit(":", 1)[1])))
        stalled.sendall(GET.replace(b"/", b"/large", 1))
        assert stalled.recv(15, socket.MSG_WAITALL) == b"HTTP/1.1 200 OK"
        # Whoever sends to a connection that has gone is told so, sooner or later.
        with pytest.raises(OSError, match=r"reset|pipe"):
            send_for_ever(stalled)


def send_for_ever(client: socket.socket) -> None:
    while True:
        client.sendall(b"\r\n")
        time.sleep(0.01)


def beside(app: ASGIApp, path: str) -> Callable[[ASGIApp], ASGIApp]:
    """Puts an application beside the service, under one path."""

    def around(service: ASGIApp) -> ASGIApp:
        async def both(scope: Scope, receive: Receive, send: Send) -> None:
            await (app if scope.get("path") == path else service)(scope, receive, send)

        return both

    return around


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="no such option here")
def test_connections_inherit_what_notices_the_vanished() -> None:
    (sock,) = listen("127.0.0.1", 0)
    with sock:
        notice_the_vanished([sock], 2.5)
        with socket.create_connection(sock.getsockname()), sock.accept()[0] as accepted:
            assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 2500


def test_a_refused_body_does_not_lose_its_answer() -> None:
    settings = Settings(max_body_bytes=1024)
    with running_service(settings) as url, socket.socket() as client:
        client.connect(("127.0.0.1", int(url.rsplit(":", 1)[1])))
        # Whoever closes with this set says so at once, and forgets what it has not read.
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.settimeout(30)
        client.sendall(
            b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
            b"Content-Length: 8000000\r\n\r\n"
        )
        for _ in range(8):
            client.sendall(b" " * 1_000_000)
        answer = b""
        while piece := client.recv(1 << 16):
            answer += piece
        assert answer.startswith(b"HTTP/1.1 413 ")
        assert b'"code":"body_too_large"' in answer
        assert b"\r\nconnection: close\r\n" in answer
