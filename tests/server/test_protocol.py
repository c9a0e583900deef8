"""Requests that the server reads, and those that it refuses before the application sees them."""

import asyncio
import gc
import weakref
from typing import Any

import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from service.server.protocol import MAX_PIPELINED
from tests.server.wire import Server, settle

pytestmark = pytest.mark.anyio
CHUNK = 1 << 14
MAX_HEAD = 1 << 16
HOST = b"Host: x\r\n"
FIRST = b"POST /v1/mesh HTTP/1.1\r\n" + HOST
CHUNKED = FIRST + b"Transfer-Encoding: chunked\r\n"
GET = b"GET /%d HTTP/1.1\r\n" + HOST + b"\r\n"


class Echo:
    """Responds with the body of the request; stores scopes and bodies."""

    def __init__(self) -> None:
        self.scopes: list[Scope] = []
        self.bodies: list[bytes] = []
        self.gone = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.scopes.append(scope)
        body, message = b"", await receive()
        while message["type"] == "http.request":
            body += message["body"]
            if not message["more_body"]:
                break
            message = await receive()
        else:
            self.gone += 1
            return
        self.bodies.append(body)
        await send_response(send, body)


async def send_response(send: Send, body: bytes) -> None:
    length = (b"content-length", b"%d" % len(body))
    await send({"type": "http.response.start", "status": 200, "headers": [length]})
    await send({"type": "http.response.body", "body": body})


async def respond_without_reading(_scope: Scope, _receive: Receive, send: Send) -> None:
    """An application that responds without reading the body."""
    await send_response(send, b"no")


class Later:
    """Responds after the test has set `may`."""

    def __init__(self) -> None:
        self.may = asyncio.Event()
        self.received: list[Message] = []

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        await self.may.wait()
        self.received.append(await receive())
        await send_response(send, b"late")


@pytest.mark.parametrize(
    ("start", "piece"),
    [
        (b"GET /", b"a" * CHUNK),
        (b"GET /v1/surfaces?", b"a=1&" * (CHUNK // 4)),
        (FIRST + b"X-Long: ", b"a" * CHUNK),
        (FIRST + b"X", b"a" * CHUNK),
        (FIRST, b"X-Many: a\r\n" * 1000),
        (b"", b"\r\n" * (CHUNK // 2)),
        (CHUNKED + b"\r\n0\r\n", b"X-Trailer: a\r\n" * 1000),
        (CHUNKED + b"\r\n0\r\nX-Trailer: ", b"a" * CHUNK),
        (CHUNKED + b"\r\n1;", b"extension" * 2000),
    ],
    ids=["path", "query", "value", "name", "headers", "blank", "trailers", "trailer", "extension"],
)
async def test_a_head_that_does_not_end_is_refused(start: bytes, piece: bytes) -> None:
    server = Server(Echo())
    client = server.connect()
    done = 0
    data = start
    while not client.wire.ended:
        await client.send(data)
        done += len(data)
        assert done <= 2 * MAX_HEAD + len(start) + len(piece)
        data = piece
    assert done > MAX_HEAD
    assert client.problem["status"] == 431
    assert client.problem["errors"][0]["code"] == "head_too_large"
    assert server.refused == ["head_too_large"]


async def test_a_body_is_of_any_length_and_its_chunks_as_well() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(CHUNKED + b"\r\n")
    for _ in range(200):
        await client.send(b"1;a=b\r\nx\r\n" * 1000)
    await client.send(b"0\r\n\r\n")
    assert echo.bodies == [b"x" * 200_000]


AMBIGUOUS = {
    "two framings": CHUNKED + b"Content-Length: 3\r\n\r\n0\r\n\r\n",
    "the other way round": FIRST + b"Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n",
    "two lengths": FIRST + b"Content-Length: 3\r\nContent-Length: 3\r\n\r\nabc",
    "a list of lengths": FIRST + b"Content-Length: 3, 3\r\n\r\nabc",
    "a signed length": FIRST + b"Content-Length: +3\r\n\r\nabc",
    "an endless length": FIRST + b"Content-Length: 99999999999999999999999\r\n\r\n",
    "coded twice": FIRST + b"Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
    "not chunked": FIRST + b"Transfer-Encoding: identity\r\n\r\n0\r\n\r\n",
    "two codings": CHUNKED + b"Transfer-Encoding: identity\r\n\r\n0\r\n\r\n",
    "chunks in 1.0": b"POST / HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "a space before the colon": FIRST + b"Transfer-Encoding : chunked\r\n\r\n0\r\n\r\n",
    "a folded line": FIRST + b"X: a\r\n b\r\n\r\n",
    "a bare CR": FIRST + b"X: a\rb\r\n\r\n",
    "bare LF": b"GET / HTTP/1.1\nHost: x\n\n",
    "NUL": FIRST + b"X: a\0b\r\n\r\n",
    "a strange chunk": CHUNKED + b"\r\n0x3\r\nabc\r\n0\r\n\r\n",
    "an endless chunk": CHUNKED + b"\r\nfffffffffffffffff\r\nabc\r\n",
    "a longer chunk than said": CHUNKED + b"\r\n3\r\nabcd\r\n0\r\n\r\n",
    "no host": b"GET / HTTP/1.1\r\n\r\n",
    "two hosts": b"GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n",
    "two hosts in 1.0": b"GET / HTTP/1.0\r\nHost: x\r\nHost: y\r\n\r\n",
    "version 2": b"GET / HTTP/2.0\r\nHost: x\r\n\r\n",
    "the preface of version 2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "version 0.9": b"GET /\r\n\r\n",
    "a tunnel": b"CONNECT x:443 HTTP/1.1\r\nHost: x\r\n\r\n",
    "an unknown method": b"BREW / HTTP/1.1\r\nHost: x\r\n\r\n",
    "letters": "GET /é HTTP/1.1\r\nHost: x\r\n\r\n".encode(),
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
}


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize("data", AMBIGUOUS.values(), ids=AMBIGUOUS)
async def test_invalid_and_ambiguous_requests_are_refused(data: bytes, at_once: bool) -> None:
    echo = Echo()
    server = Server(echo)
    client = server.connect()
    for piece in [data] if at_once else [bytes([byte]) for byte in data]:
        client.protocol.data_received(piece)
    await settle()
    assert client.statuses == [400]
    assert client.problem["code"] == client.problem["errors"][0]["code"] == "malformed_request"
    assert server.refused == ["malformed_request"]
    assert echo.bodies == []


ACCEPTED = {
    "an old version": (b"GET /a%20b?c=d HTTP/1.0\r\n\r\n", b""),
    "a whole URL": (b"GET http://y/a%20b?c=d HTTP/1.1\r\nHost: x\r\n\r\n", b""),
    "blank lines before": (b"\r\n\r\nGET /a%20b?c=d HTTP/1.1\r\nHost: x\r\n\r\n", b""),
    "extensions of chunks": (
        b"POST /a%20b?c=d HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: Chunked\r\n\r\n"
        b"3;a=b\r\nabc\r\n0\r\nX: trailer\r\n\r\n",
        b"abc",
    ),
    "an offer": (
        b"GET /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, HTTP2-Settings\r\n"
        b"Upgrade: h2c\r\nHTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA\r\n\r\n",
        b"",
    ),
    "an offer, the last request": (
        b"GET /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, close\r\n"
        b"Upgrade: websocket\r\n\r\n",
        b"",
    ),
    "an offer with a body": (
        b"POST /a%%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, HTTP2-Settings\r\n"
        b"Upgrade: h2c\r\nContent-Length: %d\r\n\r\n" % len(GET % 7) + GET % 7,
        GET % 7,
    ),
    "an offer with chunks": (
        b"POST /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n",
        b"abc",
    ),
}


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize(("data", "body"), ACCEPTED.values(), ids=ACCEPTED)
async def test_other_valid_spellings_of_a_request_are_read(
    data: bytes, body: bytes, at_once: bool
) -> None:
    echo = Echo()
    client = Server(echo).connect()
    for piece in [data] if at_once else [bytes([byte]) for byte in data]:
        client.protocol.data_received(piece)
    await settle()
    (scope,) = echo.scopes
    assert (scope["path"], scope["raw_path"]) == ("/a b", b"/a%20b")
    assert scope["query_string"] == b"c=d"
    assert b"x" not in dict(scope["headers"])
    assert echo.bodies == [body]
    assert client.wire.answer.startswith(b"HTTP/1.1 200 OK\r\n")
    last = b"1.0" in data or b"close" in data
    assert (b"connection: close" in client.wire.answer) is client.wire.ended is last


async def test_requests_that_come_together_are_answered_in_their_order_up_to_a_number() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(b"".join(GET % i for i in range(3)))
    await client.send(b"".join(GET % i for i in range(3, 6)))
    assert client.statuses == [200] * 6
    assert b"connection: close" not in client.wire.answer
    await client.send(b"".join(GET % i for i in range(6, 10_000)))
    for _ in range(MAX_PIPELINED):
        await settle()
    seen = [scope["path"] for scope in echo.scopes]
    assert seen == [f"/{i}" for i in range(6 + 1 + MAX_PIPELINED)]
    assert client.statuses == [200] * len(seen)
    assert client.wire.answer.count(b"connection: close") == 1
    assert client.wire.answer.rstrip().endswith(b"connection: close")
    assert client.wire.ended


async def test_the_error_of_an_invalid_request_comes_after_earlier_responses() -> None:
    later = Later()
    client = Server(later).connect()
    await client.send(GET % 1 + GET % 2 + b"BREW / HTTP/1.1\r\n")
    assert client.wire.answer == b""
    later.may.set()
    await settle()
    assert client.statuses == [200, 200, 400]
    assert client.problem["code"] == "malformed_request"


async def test_a_waiting_request_whose_body_cannot_be_read_is_not_begun() -> None:
    later = Later()
    client = Server(later).connect()
    await client.send(GET % 1 + CHUNKED + b"\r\nx\r\n")
    later.may.set()
    await settle()
    assert client.statuses == [200, 400]
    assert client.problem["code"] == "malformed_request"
    assert len(later.received) == 1


async def test_the_application_sees_that_a_body_breaks_off() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(CHUNKED + b"Expect: 100-continue\r\n\r\n")
    assert client.wire.answer == b"HTTP/1.1 100 Continue\r\n\r\n"
    await client.send(b"1\r\na\r\n")
    await client.send(b"x\r\n")
    assert (echo.gone, echo.bodies) == (1, [])
    assert client.problem["code"] == "malformed_request"


async def test_all_requests_of_a_client_see_that_it_has_gone() -> None:
    later = Later()
    client = Server(later).connect()
    await client.send(GET % 1 + GET % 2)
    client.lose()
    later.may.set()
    await settle()
    assert later.received == [{"type": "http.disconnect"}]


@pytest.mark.parametrize("last", [b"", b"Connection: close\r\n"])
@pytest.mark.parametrize("length", [b"Content-Length: 5", b"Transfer-Encoding: chunked"])
async def test_a_response_that_is_sent_before_the_body(length: bytes, last: bytes) -> None:
    """The rest of the body is read and dropped, so that the client can read the response."""

    server = Server(respond_without_reading)
    client = server.connect()
    await client.send(FIRST + last + length + b"\r\n\r\n")
    assert client.wire.answer.endswith(b"\r\n\r\nno")
    assert client.wire.ended is bool(last)
    await client.send((b"5\r\nabcde\r\n0\r\n\r\n" if b"chunked" in length else b"abcde") + GET % 2)
    assert client.statuses == ([200] if last else [200, 200])
    server.wait(31)
    assert client.wire.aborted is bool(last)


async def test_a_body_that_breaks_off_after_its_response_gets_no_second_one() -> None:
    client = Server(respond_without_reading).connect()
    await client.send(CHUNKED + b"\r\n1\r\na\r\nx\r\n")
    assert client.statuses == [400]
    client = Server(respond_without_reading).connect()
    await client.send(CHUNKED + b"\r\n1\r\na\r\n")
    await client.send(b"x\r\n")
    assert client.statuses == [200]
    assert client.wire.ended


async def test_trailers_are_no_headers() -> None:
    echo = Echo()
    await Server(echo).connect().send(CHUNKED + b"\r\n0\r\nX-Trailer: a\r\n\r\n")
    assert [name for name, _ in echo.scopes[0]["headers"]] == [b"host", b"transfer-encoding"]


async def test_a_failure_after_the_client_has_gone_leaves_nothing() -> None:
    async def fail_after_disconnect(_scope: Scope, receive: Receive, _send: Send) -> None:
        while (await receive())["type"] != "http.disconnect":
            pass
        raise RuntimeError("inside")

    server = Server(fail_after_disconnect)
    client = server.connect()
    await client.send(FIRST + b"Content-Length: 9\r\n\r\nabc")
    client.lose()
    await settle()
    assert not client.wire.ended
    assert not server.state.connections
    assert not server.state.tasks


async def test_a_closed_connection_is_freed_at_once() -> None:
    """The service looks for reference cycles rarely."""

    gc.disable()
    try:
        for data in (b"", b"GET", GET % 1, b"BREW", GET % 1 + b"GET", GET % 1 + GET % 2):
            client = Server(Echo()).connect()
            await client.send(data)
            client.lose()
            await settle()
            kept = weakref.ref(client.protocol)
            del client
            assert kept() is None
    finally:
        gc.enable()


async def raise_error(_scope: Scope, _receive: Receive, _send: Send) -> None:
    raise RuntimeError("inside")


async def raise_cancelled(_scope: Scope, _receive: Receive, _send: Send) -> None:
    raise asyncio.CancelledError


@pytest.mark.parametrize(
    ("app", "status", "code"),
    [(raise_error, 500, "internal_error"), (raise_cancelled, 503, "draining")],
)
async def test_an_application_without_a_response(app: Any, status: int, code: str) -> None:
    server = Server(app)
    client = server.connect()
    await client.send(GET % 1)
    assert (client.problem["status"], client.problem["code"]) == (status, code)
    assert ("retry-after" in client.problem["headers"]) is (status == 503)
    assert b"inside" not in client.wire.answer
    assert server.refused == [code]


def test_long_heads_and_longer_bodies_are_read(server: str) -> None:
    headers = {"X-Long": "a" * (MAX_HEAD - 2000), "Content-Type": "application/json"}
    body = b" " * (3 * MAX_HEAD) + b"{}"
    response = httpx.post(f"{server}/v1/mesh", content=body, headers=headers)
    assert response.json()["errors"][0]["code"] == "missing_field"


def test_every_request_of_a_connection_has_its_own_bound(server: str) -> None:
    with httpx.Client(base_url=server, headers={"X-Long": "a" * 30_000}) as client:
        for _ in range(5):
            assert client.get("/health/live").status_code == 200
