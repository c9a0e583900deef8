"""Attacks with connections that are idle, slow or broken."""

import asyncio
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

from tools.attack.bodies import PIECE
from tools.attack.wire import (
    BUSY,
    HOST,
    PATIENCE,
    Attack,
    Pieces,
    ask,
    get,
    open_connection,
    post,
    post_head,
    reset,
    send_storm,
    summarize,
)
from tools.attack.work import COLD, LARGE_ANSWER, grid

IDLE = 1000


async def idle(port: int, source: str = HOST) -> Counter[str]:
    """1000 connections that send nothing, or send nothing more after one response."""
    answers = await asyncio.gather(*(_idle(port, k % 2 == 0, source) for k in range(IDLE)))
    return Counter(answers)


async def _idle(port: int, asks: bool, source: str) -> str:
    try:
        async with open_connection(port, source) as (reader, writer):
            if asks:
                writer.write(b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n")
                await reader.readuntil(b"}")
            try:
                async with asyncio.timeout(8):
                    seen = await reader.read(1 << 16)
            except TimeoutError:
                return "open"
            return summarize(seen, len(seen))
    except (OSError, asyncio.IncompleteReadError):
        return "closed"


async def slow_bodies(port: int) -> Counter[str]:
    """Bodies that arrive with one byte every two seconds, with a declared length and in chunks."""
    tasks = []
    for k in range(100):
        if k % 2:
            head, byte = post_head("/v1/mesh", "Content-Length: 100000000"[:-2]), b"0"
        else:
            head, byte = post_head("/v1/mesh", "Transfer-Encoding: chunked"), b"1\r\n0\r\n"
        pieces = [head, *([byte] * 60)]
        tasks.append(ask(port, pieces, seconds=80, pause=2))
    return Counter(await asyncio.gather(*tasks))


async def large_and_slow(port: int) -> Counter[str]:
    """Bodies of the largest allowed length, of which the client sends half at once, and then
    waits."""
    head = post_head("/v1/mesh", f"Content-Length: {64 << 20}")
    pieces = [head, *([bytes(PIECE)] * 128), *([b"0"] * 200)]
    tasks = (ask(port, _then_slowly(pieces, 129), seconds=80, pause=0.02) for _ in range(8))
    return Counter(await asyncio.gather(*tasks))


def _then_slowly(pieces: list[bytes], fast: int) -> Iterator[bytes]:
    yield b"".join(pieces[:fast])
    yield from pieces[fast:]


async def gone_in_body(port: int) -> Counter[str]:
    body = post("/v1/mesh", grid(300, 300))
    return await _gone(port, body[: len(body) // 2], 0.01, 200)


async def gone_in_answer(port: int) -> Counter[str]:
    return await _gone(port, LARGE_ANSWER, 0.5, 16, reads=1000)


async def gone_in_queue(port: int) -> Counter[str]:
    """Work for seconds for clients that disconnect."""
    return await _gone(port, LARGE_ANSWER, 0.05, 100)


async def _gone(port: int, sent: bytes, after: float, times: int, reads: int = 0) -> Counter[str]:
    answers: Counter[str] = Counter()
    end = asyncio.get_running_loop().time() + 5

    async def one_by_one(count: int) -> None:
        for _ in range(count):
            if asyncio.get_running_loop().time() > end:
                break
            with suppress(OSError, TimeoutError):
                async with asyncio.timeout(3), open_connection(port) as (reader, writer):
                    writer.write(sent)
                    await writer.drain()
                    await asyncio.sleep(after)
                    if reads:
                        await reader.read(reads)
                    reset(writer)
            answers["gone"] += 1

    await asyncio.gather(*(one_by_one(times // 8) for _ in range(8)))
    return answers


async def half_closed(port: int) -> Counter[str]:
    """Half-closed connections: the service answers complete requests and waits for no more."""
    answers: Counter[str] = Counter()
    request_bytes = post("/v1/mesh?format=stl", grid(30, 30))
    for request in (get("/health"), request_bytes, request_bytes[:500], get("/health")[:20]) * 10:
        try:
            async with asyncio.timeout(5), open_connection(port) as (reader, writer):
                writer.write(request)
                writer.write_eof()
                seen = await reader.read(-1)
            answers[summarize(seen, len(seen))] += 1
        except TimeoutError:
            answers["no answer"] += 1
        except OSError:
            answers["closed"] += 1
    return answers


async def slow_readers(port: int) -> Counter[str]:
    """Large responses to clients that read only a little, and later hang up."""
    tasks = [_reads_slowly(port, LARGE_ANSWER) for _ in range(16)]
    hit = get("/v1/surfaces/tea-service/mesh.json?resolution=24")
    tasks += [_reads_slowly(port, hit) for _ in range(64)]
    return Counter(await asyncio.gather(*tasks))


async def _reads_slowly(port: int, request: bytes) -> str:
    try:
        async with asyncio.timeout(PATIENCE):
            reader, writer = await _narrow(port)
            try:
                writer.write(request)
                head = await reader.readuntil(b"\r\n\r\n")
                for _ in range(12):
                    await asyncio.sleep(0.5)
                    if not await reader.read(1000):
                        return "closed"
            finally:
                reset(writer)
            status = head[9:12].decode()
            return "429 busy" if status == "429" else status
    except TimeoutError:  # an OSError, too
        return "no answer"
    except (OSError, asyncio.IncompleteReadError):
        return "closed"


async def _narrow(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A connection with a small receive buffer, which the client does not read."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.setblocking(False)
    await asyncio.get_running_loop().sock_connect(client, ("127.0.0.1", port))
    return await asyncio.open_connection(sock=client, limit=4096)


async def in_and_out(port: int) -> Counter[str]:
    """Connections that are opened and closed without a request."""
    answers: Counter[str] = Counter()

    async def one_by_one() -> None:
        for _ in range(500):
            with suppress(OSError):
                async with open_connection(port):
                    answers["gone"] += 1

    await asyncio.gather(*(one_by_one() for _ in range(4)))
    return answers


async def worst(port: int) -> Counter[str]:
    """The worst attacks of all modules, at the same time."""
    large: list[Pieces] = [LARGE_ANSWER] * 200
    cold: list[Pieces] = [get(url.replace("?", "?weld=false&")) for url in COLD]
    done = await asyncio.gather(
        send_storm(port, large, together=8, seconds=12),
        send_storm(port, cold, together=4, seconds=12),
        slow_readers(port),
        gone_in_queue(port),
        gone_in_answer(port),
        _large_and_slow_for(port, 10),
        idle(port),
    )
    return sum(done, Counter())


async def _large_and_slow_for(port: int, seconds: float) -> Counter[str]:
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            return await large_and_slow(port)
    return Counter({"gone": 8})


CONNECTIONS = (
    Attack("connections in and out", in_and_out, "gone"),
    Attack("1000 idle connections", idle, "open|408 head_too_slow|closed"),
    Attack("gone in mid-body", gone_in_body, "gone"),
    Attack("gone in mid-answer", gone_in_answer, "gone"),
    Attack("gone while waiting", gone_in_queue, "gone"),
    Attack("half closed", half_closed, "200|closed|400 malformed_request|408 .*"),
    Attack("slow readers of large answers", slow_readers, rf"200|closed|{BUSY}"),
)

ONE_ADDRESS = partial(idle, source="127.0.0.2")
"""The idle connections from another address than that of the well-behaved client."""

PROXIED = (Attack("1000 connections of one address", ONE_ADDRESS, "open|closed|408"),)
"""Attacks that only the shipped HAProxy withstands, because it counts connections by address."""

LATE = rf"408 body_too_slow|closed|{BUSY}"
SLOW_BODIES = Attack("slow bodies: 100 connections", slow_bodies, LATE)
HALF_BODIES = Attack("half of 64 MiB, then slowly", large_and_slow, rf"{LATE}|4\d\d .*")

ALL = rf"200|open|closed|gone|408 .*|422 .*|{BUSY}"
WORST = Attack("the worst of these at once", worst, ALL)
