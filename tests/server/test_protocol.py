"""The HTTP protocol: requests that the server reads, refuses, or answers in order."""

import asyncio
import gc
import weakref
from typing import Any

import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from service.server.protocol import MAX_PIPELINED
from tools.hostile.heads import AMBIGUOUS, CHUNKED, HOST, POST
from tools.wire import Server, settle

pytestmark = pytest.mark.anyio
CHUNK = 1 << 14
MAX_HEAD = 1 << 16  # bytes, the default of the setting `max_head_bytes`
GET = b"GET /%d HTTP/1.1\r\n" + HOST + b"\r\n"


class Echo:
    """An application that responds with the body of the request.

    It records scopes and bodies, and counts requests whose body did not end.
    """

    def __init__(self) -> None:
        self.scopes: list[Scope] = []
        self.bodies: list[bytes] = []
        self.incomplete_bodies = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.scopes.append(scope)
        body, message = b"", await receive()
        while message["type"] == "http.request":
            body += message["body"]
            if not message["more_body"]:
                break
            message = await receive()
        else:  # the last message was `http.disconnect`
            self.incomplete_bodies += 1
            return
        self.bodies.append(body)
        await send_response(send, body)


async def send_response(send: Send, body: bytes) -> None:
    """Sends a response with status 200 and this body."""
    length = (b"content-length", b"%d" % len(body))
    await send({"type": "http.response.start", "status": 200, "headers": [length]})
    await send({"type": "http.response.body", "body": body})


async def respond_without_reading(_scope: Scope, _receive: Receive, send: Send) -> None:
    """An application that responds without reading the body."""
    await send_response(send, b"no")


class DelayedApp:
    """An application that responds after the test has set `may_respond`."""

    def __init__(self) -> None:
        self.may_respond = asyncio.Event()
        self.messages: list[Message] = []

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        await self.may_respond.wait()
        self.messages.append(await receive())
        await send_response(send, b"late")


@pytest.mark.parametrize(
    ("start", "piece"),
    [
        (b"GET /", b"a" * CHUNK),
        (b"GET /v1/surfaces?", b"a=1&" * (CHUNK // 4)),
        (POST + b"X-Long: ", b"a" * CHUNK),
        (POST + b"X", b"a" * CHUNK),
        (POST, b"X-Many: a\r\n" * 1000),
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
    sent_bytes = 0
    data = start
    while not client.wire.has_ended:
        await client.send(data)
        sent_bytes += len(data)
        assert sent_bytes <= 2 * MAX_HEAD + len(start) + len(piece)
        data = piece
    assert sent_bytes > MAX_HEAD
    assert client.problem["status"] == 431
    assert client.problem["errors"][0]["code"] == "head_too_large"
    assert server.refusals == ["head_too_large"]


async def test_a_body_may_have_any_number_of_chunks() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(CHUNKED + b"\r\n")
    for _ in range(200):
        await client.send(b"1;a=b\r\nx\r\n" * 1000)
    await client.send(b"0\r\n\r\n")
    assert echo.bodies == [b"x" * 200_000]


@pytest.mark.parametrize("in_one_piece", [True, False])
@pytest.mark.parametrize("data", AMBIGUOUS.values(), ids=AMBIGUOUS)
async def test_invalid_and_ambiguous_requests_are_refused(data: bytes, in_one_piece: bool) -> None:
    echo = Echo()
    server = Server(echo)
    client = server.connect()
    for piece in [data] if in_one_piece else [bytes([byte]) for byte in data]:
        client.protocol.data_received(piece)
    await settle()
    assert client.statuses == [400]
    assert client.problem["code"] == client.problem["errors"][0]["code"] == "malformed_request"
    assert server.refusals == ["malformed_request"]
    assert echo.bodies == []


ACCEPTED = {
    "version 1.0": (b"GET /a%20b?c=d HTTP/1.0\r\n\r\n", b""),
    "a whole URL": (b"GET http://y/a%20b?c=d HTTP/1.1\r\nHost: x\r\n\r\n", b""),
    "blank lines before": (b"\r\n\r\nGET /a%20b?c=d HTTP/1.1\r\nHost: x\r\n\r\n", b""),
    "extensions of chunks": (
        b"POST /a%20b?c=d HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: Chunked\r\n\r\n"
        b"3;a=b\r\nabc\r\n0\r\nX: trailer\r\n\r\n",
        b"abc",
    ),
    "an offer to upgrade": (
        b"GET /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, HTTP2-Settings\r\n"
        b"Upgrade: h2c\r\nHTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA\r\n\r\n",
        b"",
    ),
    "an offer to upgrade in version 1.0": (
        b"GET /a%20b?c=d HTTP/1.0\r\nConnection: Upgrade\r\nUpgrade: h2c\r\n\r\n",
        b"",
    ),
    "an offer to upgrade in the last request": (
        b"GET /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, close\r\n"
        b"Upgrade: websocket\r\n\r\n",
        b"",
    ),
    "an offer to upgrade with a body": (
        b"POST /a%%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade, HTTP2-Settings\r\n"
        b"Upgrade: h2c\r\nContent-Length: %d\r\n\r\n" % len(GET % 7) + GET % 7,
        GET % 7,
    ),
    "an offer to upgrade with chunks": (
        b"POST /a%20b?c=d HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n",
        b"abc",
    ),
}


@pytest.mark.parametrize("in_one_piece", [True, False])
@pytest.mark.parametrize(("data", "body"), ACCEPTED.values(), ids=ACCEPTED)
async def test_other_valid_spellings_of_a_request_are_read(
    data: bytes, body: bytes, in_one_piece: bool
) -> None:
    echo = Echo()
    client = Server(echo).connect()
    for piece in [data] if in_one_piece else [bytes([byte]) for byte in data]:
        client.protocol.data_received(piece)
    await settle()
    (scope,) = echo.scopes
    assert (scope["path"], scope["raw_path"]) == ("/a b", b"/a%20b")
    assert scope["query_string"] == b"c=d"
    assert b"x" not in dict(scope["headers"])
    assert echo.bodies == [body]
    assert client.wire.sent_bytes.startswith(b"HTTP/1.1 200 OK\r\n")
    is_last = b"1.0" in data or b"close" in data
    assert (b"connection: close" in client.wire.sent_bytes) is client.wire.has_ended is is_last


async def test_pipelined_requests_get_responses_in_their_order_up_to_a_limit() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(b"".join(GET % i for i in range(3)))
    await client.send(b"".join(GET % i for i in range(3, 6)))
    assert client.statuses == [200] * 6
    assert b"connection: close" not in client.wire.sent_bytes
    await client.send(b"".join(GET % i for i in range(6, 10_000)))
    for _ in range(MAX_PIPELINED):
        await settle()
    paths = [scope["path"] for scope in echo.scopes]
    # After the first 6 requests: the one that runs, and those that wait for it.
    assert paths == [f"/{i}" for i in range(6 + 1 + MAX_PIPELINED)]
    assert client.statuses == [200] * len(paths)
    assert client.wire.sent_bytes.count(b"connection: close") == 1
    assert client.wire.sent_bytes.rstrip().endswith(b"connection: close")
    assert client.wire.has_ended


async def test_the_error_of_an_invalid_request_is_sent_after_earlier_responses() -> None:
    app = DelayedApp()
    client = Server(app).connect()
    await client.send(GET % 1 + GET % 2 + b"BREW / HTTP/1.1\r\n")
    assert client.wire.sent_bytes == b""
    app.may_respond.set()
    await settle()
    assert client.statuses == [200, 200, 400]
    assert client.problem["code"] == "malformed_request"


async def test_a_waiting_request_with_an_invalid_body_does_not_reach_the_application() -> None:
    app = DelayedApp()
    client = Server(app).connect()
    await client.send(GET % 1 + CHUNKED + b"\r\nx\r\n")
    app.may_respond.set()
    await settle()
    assert client.statuses == [200, 400]
    assert client.problem["code"] == "malformed_request"
    assert len(app.messages) == 1


async def test_the_application_sees_that_a_body_is_incomplete() -> None:
    echo = Echo()
    client = Server(echo).connect()
    await client.send(CHUNKED + b"Expect: 100-continue\r\n\r\n")
    assert client.wire.sent_bytes == b"HTTP/1.1 100 Continue\r\n\r\n"
    await client.send(b"1\r\na\r\n")
    await client.send(b"x\r\n")
    assert (echo.incomplete_bodies, echo.bodies) == (1, [])
    assert client.problem["code"] == "malformed_request"


async def test_waiting_requests_of_a_client_that_disconnects_do_not_begin() -> None:
    app = DelayedApp()
    client = Server(app).connect()
    await client.send(GET % 1 + GET % 2)
    client.lose()
    app.may_respond.set()
    await settle()
    assert app.messages == [{"type": "http.disconnect"}]


@pytest.mark.parametrize("close_header", [b"", b"Connection: close\r\n"])
@pytest.mark.parametrize("length_header", [b"Content-Length: 5", b"Transfer-Encoding: chunked"])
async def test_after_an_early_response_the_rest_of_the_body_is_dropped(
    length_header: bytes, close_header: bytes
) -> None:
    """The server reads the rest of the body, so that the client can read the response."""
    server = Server(respond_without_reading)
    client = server.connect()
    await client.send(POST + close_header + length_header + b"\r\n\r\n")
    assert client.wire.sent_bytes.endswith(b"\r\n\r\nno")
    assert client.wire.has_ended is bool(close_header)
    await client.send(
        (b"5\r\nabcde\r\n0\r\n\r\n" if b"chunked" in length_header else b"abcde") + GET % 2
    )
    assert client.statuses == ([200] if close_header else [200, 200])
    server.wait(31)  # the default of `send_timeout` is 30 s
    assert client.wire.is_aborted is bool(close_header)


async def test_an_invalid_body_after_its_response_gets_no_second_response() -> None:
    # If the invalid chunk arrives before the application has responded, the error is the response.
    client = Server(respond_without_reading).connect()
    await client.send(CHUNKED + b"\r\n1\r\na\r\nx\r\n")
    assert client.statuses == [400]
    client = Server(respond_without_reading).connect()
    await client.send(CHUNKED + b"\r\n1\r\na\r\n")
    await client.send(b"x\r\n")
    assert client.statuses == [200]
    assert client.wire.has_ended


async def test_trailers_do_not_become_headers() -> None:
    echo = Echo()
    await Server(echo).connect().send(CHUNKED + b"\r\n0\r\nX-Trailer: a\r\n\r\n")
    assert [name for name, _ in echo.scopes[0]["headers"]] == [b"host", b"transfer-encoding"]


async def test_an_error_after_the_client_has_disconnected_leaves_no_state() -> None:
    async def fail_after_disconnect(_scope: Scope, receive: Receive, _send: Send) -> None:
        while (await receive())["type"] != "http.disconnect":
            pass
        raise RuntimeError("inside")

    server = Server(fail_after_disconnect)
    client = server.connect()
    await client.send(POST + b"Content-Length: 9\r\n\r\nabc")
    client.lose()
    await settle()
    assert not client.wire.has_ended
    assert not server.state.connections
    assert not server.state.tasks


async def test_a_closed_connection_is_freed_at_once() -> None:
    """A connection has no reference cycles, whose memory the garbage collector would free late."""
    gc.disable()
    try:
        for data in (b"", b"GET", GET % 1, b"BREW", GET % 1 + b"GET", GET % 1 + GET % 2):
            client = Server(Echo()).connect()
            await client.send(data)
            client.lose()
            await settle()
            reference = weakref.ref(client.protocol)
            del client
            assert reference() is None
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
async def test_an_application_that_fails_gets_a_problem_as_its_response(
    app: Any, status: int, code: str
) -> None:
    server = Server(app)
    client = server.connect()
    await client.send(GET % 1)
    assert (client.problem["status"], client.problem["code"]) == (status, code)
    assert ("retry-after" in client.problem["headers"]) is (status == 503)
    assert b"inside" not in client.wire.sent_bytes
    assert server.refusals == [code]


def test_long_heads_and_longer_bodies_are_read(server: str) -> None:
    headers = {"X-Long": "a" * (MAX_HEAD - 2000), "Content-Type": "application/json"}
    body = b" " * (3 * MAX_HEAD) + b"{}"
    response = httpx.post(f"{server}/v1/mesh", content=body, headers=headers)
    assert response.json()["errors"][0]["code"] == "missing_field"


def test_the_limit_of_heads_is_for_each_request_of_a_connection(server: str) -> None:
    with httpx.Client(base_url=server, headers={"X-Long": "a" * 30_000}) as client:
        for _ in range(5):
            assert client.get("/health/live").status_code == 200
