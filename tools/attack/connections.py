"""Attacks with connections that are idle, slow or closed by the client."""

import asyncio
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

from tools.attack.wire import (
    BUSY,
    HOST,
    PATIENCE,
    Attack,
    Pieces,
    build_get,
    build_post,
    build_post_head,
    open_connection,
    reset_connection,
    send_request,
    send_requests,
    summarize,
)
from tools.attack.work import LARGE_MESH_REQUEST, UNCACHED_URLS, build_grid_body

IDLE_CONNECTIONS = 1000
HALF_BODY_CONNECTIONS = 8

MAX_BODY_BYTES = 64 << 20
"""The default of SURFACE_MAX_BODY_BYTES."""


async def open_idle_connections(port: int, source: str = HOST) -> Counter[str]:
    """1000 connections that send nothing, or send nothing more after one response."""
    responses = await asyncio.gather(
        *(_wait_idle(port, k % 2 == 0, source) for k in range(IDLE_CONNECTIONS))
    )
    return Counter(responses)


async def _wait_idle(port: int, sends_request: bool, source: str) -> str:
    """How a connection that sends nothing for 8 s ends: `open`, or how the service closes it."""
    try:
        async with open_connection(port, source) as (reader, writer):
            if sends_request:
                writer.write(b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n")
                await reader.readuntil(b"}")  # the end of the response
            try:
                async with asyncio.timeout(8):
                    received = await reader.read(1 << 16)
            except TimeoutError:
                return "open"
            return summarize(received, len(received))
    except (OSError, asyncio.IncompleteReadError):
        return "closed"


async def send_slow_bodies(port: int) -> Counter[str]:
    """Sends bodies with one byte every two seconds, with a declared length or in chunks."""
    tasks = []
    for k in range(100):
        if k % 2:
            head, byte = build_post_head("/v1/mesh", "Content-Length: 1000000"), b"0"
        else:
            head, byte = build_post_head("/v1/mesh", "Transfer-Encoding: chunked"), b"1\r\n0\r\n"
        pieces = [head, *([byte] * 60)]
        tasks.append(send_request(port, pieces, seconds=80, pause=2))
    return Counter(await asyncio.gather(*tasks))


async def send_half_bodies(port: int) -> Counter[str]:
    """Sends half of a body of the largest allowed length at once, and then one byte at a time."""
    head = build_post_head("/v1/mesh", f"Content-Length: {MAX_BODY_BYTES}")
    tasks = (
        send_request(port, _list_half_body(head), seconds=80, pause=0.02)
        for _ in range(HALF_BODY_CONNECTIONS)
    )
    return Counter(await asyncio.gather(*tasks))


def _list_half_body(head: bytes) -> Iterator[bytes]:
    """The head with half of the body in one piece, and 200 pieces of one byte."""
    yield head + bytes(MAX_BODY_BYTES // 2)
    yield from [b"0"] * 200


async def disconnect_in_body(port: int) -> Counter[str]:
    """Disconnects after the first half of a body."""
    body = build_post("/v1/mesh", build_grid_body(300, 300))
    return await _disconnect(port, body[: len(body) // 2], delay=0.01, times=200)


async def disconnect_in_response(port: int) -> Counter[str]:
    """Disconnects after the first 1000 bytes of a large response."""
    return await _disconnect(port, LARGE_MESH_REQUEST, delay=0.5, times=16, max_read_bytes=1000)


async def disconnect_while_waiting(port: int) -> Counter[str]:
    """Requests work of seconds, and disconnects before it is done."""
    return await _disconnect(port, LARGE_MESH_REQUEST, delay=0.05, times=96)


async def _disconnect(
    port: int, content: bytes, delay: float, times: int, max_read_bytes: int = 0
) -> Counter[str]:
    """Sends these bytes and disconnects after `delay` seconds, `times` times, for at most 5 s.

    Before it disconnects, it reads at most `max_read_bytes` bytes of the response.
    """
    responses: Counter[str] = Counter()
    end = asyncio.get_running_loop().time() + 5

    async def connect_one_by_one(count: int) -> None:
        for _ in range(count):
            if asyncio.get_running_loop().time() > end:
                break
            with suppress(OSError, TimeoutError):
                async with asyncio.timeout(3), open_connection(port) as (reader, writer):
                    writer.write(content)
                    await writer.drain()
                    await asyncio.sleep(delay)
                    if max_read_bytes:
                        await reader.read(max_read_bytes)
                    reset_connection(writer)
            responses["gone"] += 1

    await asyncio.gather(*(connect_one_by_one(times // 8) for _ in range(8)))
    return responses


async def send_half_closed(port: int) -> Counter[str]:
    """Closes the sending direction after a request or a part of one, and reads the response."""
    responses: Counter[str] = Counter()
    request_bytes = build_post("/v1/mesh?format=stl", build_grid_body(30, 30))
    for request in (
        build_get("/health"),
        request_bytes,
        request_bytes[:500],
        build_get("/health")[:20],
    ) * 10:
        try:
            async with asyncio.timeout(5), open_connection(port) as (reader, writer):
                writer.write(request)
                writer.write_eof()
                received = await reader.read(-1)
            responses[summarize(received, len(received))] += 1
        except TimeoutError:
            responses["no answer"] += 1
        except OSError:
            responses["closed"] += 1
    return responses


async def read_large_responses_slowly(port: int) -> Counter[str]:
    """Requests large responses, of which it reads only a little before it disconnects."""
    tasks = [read_slowly(port, LARGE_MESH_REQUEST) for _ in range(16)]
    cached_request = build_get("/v1/surfaces/tea-service/mesh.json?resolution=24")
    tasks += [read_slowly(port, cached_request) for _ in range(64)]
    return Counter(await asyncio.gather(*tasks))


async def read_slowly(port: int, request: bytes) -> str:
    """The status of a response, of which 1000 bytes are read every 0.5 s, for 6 s."""
    try:
        async with asyncio.timeout(PATIENCE):
            reader, writer = await _open_narrow_connection(port)
            try:
                writer.write(request)
                head = await reader.readuntil(b"\r\n\r\n")
                for _ in range(12):
                    await asyncio.sleep(0.5)
                    if not await reader.read(1000):
                        return "closed"
            finally:
                reset_connection(writer)
            status = head[9:12].decode()  # the 200 in `HTTP/1.1 200 OK`
            # The body of the problem is not read. These are the only ones without a rate limit and
            # with a store that works.
            return {"429": "429 busy", "503": "503 out_of_time"}.get(status, status)
    except TimeoutError:  # a subclass of OSError, so it comes first
        return "no answer"
    except (OSError, asyncio.IncompleteReadError):
        return "closed"


async def _open_narrow_connection(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A connection with a small receive buffer, so that the service cannot send much in advance."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.setblocking(False)
    await asyncio.get_running_loop().sock_connect(client, ("127.0.0.1", port))
    return await asyncio.open_connection(sock=client, limit=4096)


async def open_and_close(port: int) -> Counter[str]:
    """Opens and closes connections without a request."""
    responses: Counter[str] = Counter()

    async def connect_one_by_one() -> None:
        for _ in range(500):
            with suppress(OSError):
                async with open_connection(port):
                    responses["gone"] += 1

    await asyncio.gather(*(connect_one_by_one() for _ in range(4)))
    return responses


async def run_worst_attacks(port: int) -> Counter[str]:
    """Runs the worst attacks of all modules at the same time."""
    large_requests: list[Pieces] = [LARGE_MESH_REQUEST] * 200
    # The URLs may be cached since an earlier attack; with `weld=false` they are not.
    uncached_requests: list[Pieces] = [
        build_get(url.replace("?", "?weld=false&")) for url in UNCACHED_URLS
    ]
    counts = await asyncio.gather(
        send_requests(port, large_requests, together=8, seconds=12),
        send_requests(port, uncached_requests, together=4, seconds=12),
        read_large_responses_slowly(port),
        disconnect_while_waiting(port),
        disconnect_in_response(port),
        _send_half_bodies_for(port, 10),
        open_idle_connections(port),
    )
    return sum(counts, Counter())


async def _send_half_bodies_for(port: int, seconds: float) -> Counter[str]:
    """Sends half bodies, and disconnects after some seconds."""
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            return await send_half_bodies(port)
    return Counter({"gone": HALF_BODY_CONNECTIONS})


CONNECTIONS = (
    Attack("connections without a request", open_and_close, "gone"),
    Attack("1000 idle connections", open_idle_connections, "open|408 head_too_slow|closed"),
    Attack("disconnected in the body", disconnect_in_body, "gone"),
    Attack("disconnected in the response", disconnect_in_response, "gone"),
    Attack("disconnected while waiting", disconnect_while_waiting, "gone"),
    Attack("half closed", send_half_closed, "200|closed|400 malformed_request|408 .*"),
    Attack("slow readers of large responses", read_large_responses_slowly, rf"200|closed|{BUSY}"),
)

IDLE_FROM_ONE_ADDRESS = partial(open_idle_connections, source="127.0.0.2")
"""Idle connections from an address that is not that of the well-behaved client."""

PROXIED = (Attack("1000 connections of one address", IDLE_FROM_ONE_ADDRESS, "open|closed|408"),)
"""Attacks that only the shipped HAProxy withstands, because it counts connections by address."""

TOO_SLOW = rf"408 body_too_slow|closed|{BUSY}"
SLOW_BODIES = Attack("slow bodies: 100 connections", send_slow_bodies, TOO_SLOW)
HALF_BODIES = Attack("half of 64 MiB, then slowly", send_half_bodies, rf"{TOO_SLOW}|4\d\d .*")

ANY_DOCUMENTED = rf"200|open|closed|gone|408 .*|422 .*|{BUSY}"
WORST = Attack("the worst of these at once", run_worst_attacks, ANY_DOCUMENTED)
