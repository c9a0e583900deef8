"""The type of an attack, and plain sockets that send its bytes and read the responses."""

import asyncio
import json
import re
import socket
import struct
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

HOST = "127.0.0.1"

PATIENCE = 75
"""Seconds until a response must arrive: the service may compute for 60 s, and needs some more to
send it."""

KEPT = 1 << 14
"""Bytes of a response that are kept; further bytes are only counted."""

Pieces = bytes | Iterable[bytes]


def get(url: str, *headers: str, method: str = "GET") -> bytes:
    """A request without a body."""
    lines = (f"{method} {url} HTTP/1.1", "Host: x", "Connection: close", *headers, "", "")
    return "\r\n".join(lines).encode("latin-1")


def post(url: str, body: bytes, *headers: str, media_type: str = "application/json") -> bytes:
    """A request with a body."""
    lines = f"Content-Type: {media_type}", f"Content-Length: {len(body)}", *headers
    return get(url, *lines, method="POST") + body


def post_head(url: str, *headers: str, media_type: str = "application/x-npy") -> bytes:
    """The beginning of a request whose body is sent by hand."""
    return get(url, f"Content-Type: {media_type}", *headers, method="POST")


@asynccontextmanager
async def open_connection(
    port: int, source: str = HOST
) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """A connection from an address of this machine; it is reset at the end."""
    reader, writer = await asyncio.open_connection(
        HOST, port, limit=1 << 16, local_addr=(source, 0)
    )
    try:
        yield reader, writer
    finally:
        writer.transport.abort()


def reset(writer: asyncio.StreamWriter) -> None:
    """Ends a connection with RST, as the system of a client that crashed does."""
    connection: socket.socket = writer.get_extra_info("socket")
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()


async def ask(port: int, request: Pieces, seconds: float = PATIENCE, pause: float = 0) -> str:
    """The response to one request, in the words of `summarize`.

    The response is read while pieces of the request are being sent, with a pause before each.
    """
    try:
        async with asyncio.timeout(seconds), open_connection(port) as (reader, writer):
            sending = asyncio.create_task(_send(writer, request, pause))
            try:
                kept, count = await _read(reader)
                has_body = not (isinstance(request, bytes) and request.startswith(b"HEAD "))
                return summarize(kept, count, has_body=has_body)
            finally:
                sending.cancel()
                with suppress(asyncio.CancelledError, OSError):
                    await sending
    except TimeoutError:
        return "no answer"
    except OSError:
        return "closed"


async def _send(writer: asyncio.StreamWriter, request: Pieces, pause: float) -> None:
    for piece in [request] if isinstance(request, bytes) else request:
        writer.write(piece)
        await writer.drain()
        if pause:
            await asyncio.sleep(pause)


async def _read(reader: asyncio.StreamReader) -> tuple[bytes, int]:
    """The first bytes of a response, and the number of its bytes."""
    kept, count = b"", 0
    with suppress(OSError):
        while piece := await reader.read(1 << 16):
            kept += piece[: KEPT - len(kept)]
            count += len(piece)
    return kept, count


def summarize(kept: bytes, count: int, *, has_body: bool = True) -> str:
    """The status and the code of a problem; `closed` without a response; `torn` if the response is
    incomplete; `two answers` if a second response follows the first.
    """
    if not kept:
        return "closed"
    head, separator, body = kept.partition(b"\r\n\r\n")
    if not separator or not head.startswith(b"HTTP/1.1 "):
        return "no HTTP"
    status = head[9:12].decode()
    fields = {
        name.strip().lower(): value.strip()
        for name, _, value in (line.partition(b":") for line in head.split(b"\r\n")[1:])
    }
    length = int(fields.get(b"content-length", b"-1"))
    got = count - len(head) - 4
    if 0 <= length < got:
        return f"{status}, two answers"
    if has_body and got < length and status != "304":
        return f"{status}, torn"
    if b"problem+json" in fields.get(b"content-type", b""):
        with suppress(ValueError):
            document = json.loads(body)
            return f"{status} {document['code']}"
    return status


async def send_storm(
    port: int, requests: Iterable[Pieces], together: int = 4, seconds: float = 4, pause: float = 0
) -> Counter[str]:
    """The responses to requests, `together` at a time; no request begins after `seconds`."""
    waiting, answers = iter(requests), Counter[str]()
    end = asyncio.get_running_loop().time() + seconds

    async def one_by_one() -> None:
        for request in waiting:
            if asyncio.get_running_loop().time() > end:
                break
            answers[await ask(port, request, pause=pause)] += 1

    await asyncio.gather(*(one_by_one() for _ in range(together)))
    return answers


def repeat(make: Callable[[], Iterable[Pieces]]) -> Iterator[Pieces]:
    """All requests, repeated without end, so that the client can be measured for long enough."""
    while True:
        yield from make()


@dataclass(frozen=True, slots=True)
class Attack:
    """One row of the table.

    Attributes
    ----------
    name : str
    run : function
        Attacks the service at a port; returns the number of responses by their short form.
    answers : str
        A regular expression of the documented responses.
    parses : bool
        Whether the attack sends the largest JSON: Python does nothing else while it parses that.
    """

    name: str
    run: Callable[[int], Awaitable[Counter[str]]]
    answers: str
    parses: bool = False

    def wrong(self, answers: Mapping[str, int]) -> list[str]:
        """The responses that are not documented, or `nothing happened` without any response."""
        if not answers:
            return ["nothing happened"]
        return [response for response in answers if not re.fullmatch(self.answers, response)]


BUSY = r"429 busy|503 out_of_time"
"""Statuses that a busy service may always answer."""

DONE = rf"200|422 (result_too_large|invalid_request|unsupported_by_format)|{BUSY}"
"""Statuses of work that the service accepts or refuses."""
