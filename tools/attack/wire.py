"""The type of an attack, and plain sockets that send bytes of requests and read the responses."""

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
"""Seconds until a response must be complete: 60 s in which the service may compute, and some more
in which it sends the response."""

KEPT_BYTES = 1 << 14
"""Number of first bytes of a response that are kept; further bytes are only counted."""

Pieces = bytes | Iterable[bytes]
"""The bytes of a request, in one piece or in pieces that are sent one after the other."""


def build_get(url: str, *headers: str, method: str = "GET") -> bytes:
    """A request without a body."""
    lines = (f"{method} {url} HTTP/1.1", "Host: x", "Connection: close", *headers, "", "")
    return "\r\n".join(lines).encode("latin-1")


def build_post(url: str, body: bytes, *headers: str, media_type: str = "application/json") -> bytes:
    """A request with a body."""
    lines = f"Content-Type: {media_type}", f"Content-Length: {len(body)}", *headers
    return build_get(url, *lines, method="POST") + body


def build_post_head(url: str, *headers: str, media_type: str = "application/x-npy") -> bytes:
    """The head of a POST request; the caller sends the body."""
    return build_get(url, f"Content-Type: {media_type}", *headers, method="POST")


@asynccontextmanager
async def open_connection(
    port: int, source: str = HOST
) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """A connection to the port from the address `source`; it is aborted at the end of the block."""
    reader, writer = await asyncio.open_connection(
        HOST, port, limit=1 << 16, local_addr=(source, 0)
    )
    try:
        yield reader, writer
    finally:
        writer.transport.abort()


def reset_connection(writer: asyncio.StreamWriter) -> None:
    """Ends a connection with RST, as an operating system does when a client process crashes."""
    connection: socket.socket = writer.get_extra_info("socket")
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()


async def send_request(
    port: int, request: Pieces, seconds: float = PATIENCE, pause: float = 0
) -> str:
    """Sends one request; returns a short form of the response (see `summarize`).

    The response is read while the pieces of the request are sent, with `pause` seconds after each
    piece. Without a complete response after `seconds` the result is `no answer`.
    """
    try:
        async with asyncio.timeout(seconds), open_connection(port) as (reader, writer):
            send_task = asyncio.create_task(_send_pieces(writer, request, pause))
            try:
                first_bytes, count = await _read_response(reader)
                has_body = not (isinstance(request, bytes) and request.startswith(b"HEAD "))
                return summarize(first_bytes, count, has_body=has_body)
            finally:
                send_task.cancel()
                with suppress(asyncio.CancelledError, OSError):
                    await send_task
    except TimeoutError:
        return "no answer"
    except OSError:
        return "closed"


async def _send_pieces(writer: asyncio.StreamWriter, request: Pieces, pause: float) -> None:
    for piece in [request] if isinstance(request, bytes) else request:
        writer.write(piece)
        await writer.drain()
        if pause:
            await asyncio.sleep(pause)


async def _read_response(reader: asyncio.StreamReader) -> tuple[bytes, int]:
    """The first bytes of a response, and the number of its bytes."""
    first_bytes, count = b"", 0
    with suppress(OSError):
        while piece := await reader.read(1 << 16):
            first_bytes += piece[: KEPT_BYTES - len(first_bytes)]
            count += len(piece)
    return first_bytes, count


def summarize(first_bytes: bytes, count: int, *, has_body: bool = True) -> str:
    """The short form of a response, of which `first_bytes` are the first of `count` bytes.

    It is the status, followed by the code if the response is a problem. `closed` means that there
    are no bytes, `no HTTP` that they are not HTTP/1.1, `torn` that the response is incomplete, and
    `two answers` that a second response follows.
    """
    if not first_bytes:
        return "closed"
    head, separator, body = first_bytes.partition(b"\r\n\r\n")
    if not separator or not head.startswith(b"HTTP/1.1 "):
        return "no HTTP"
    status = head[9:12].decode()
    fields = {
        name.strip().lower(): value.strip()
        for name, _, value in (line.partition(b":") for line in head.split(b"\r\n")[1:])
    }
    length = int(fields.get(b"content-length", b"-1"))
    body_bytes = count - len(head) - 4
    if 0 <= length < body_bytes:
        return f"{status}, two answers"
    if has_body and body_bytes < length and status != "304":
        return f"{status}, torn"
    if b"problem+json" in fields.get(b"content-type", b""):
        with suppress(ValueError):
            document = json.loads(body)
            return f"{status} {document['code']}"
    return status


async def send_requests(
    port: int, requests: Iterable[Pieces], together: int = 4, seconds: float = 4
) -> Counter[str]:
    """Sends requests, `together` at a time, and none after `seconds`.

    Returns the numbers of responses by their short form.
    """
    next_requests, responses = iter(requests), Counter[str]()
    end = asyncio.get_running_loop().time() + seconds

    async def send_one_by_one() -> None:
        for request in next_requests:
            if asyncio.get_running_loop().time() > end:
                break
            responses[await send_request(port, request)] += 1

    await asyncio.gather(*(send_one_by_one() for _ in range(together)))
    return responses


def repeat_requests(build_requests: Callable[[], Iterable[Pieces]]) -> Iterator[Pieces]:
    """The requests that `build_requests` returns, again and again: an endless attack."""
    while True:
        yield from build_requests()


@dataclass(frozen=True, slots=True)
class Attack:
    """One attack, which is one row of the table.

    Attributes
    ----------
    name : str
    run : function
        Attacks the service at a port; returns the numbers of responses by their short form.
    expected : str
        A regular expression for the short forms of documented responses.
    sends_largest_json : bool
        Whether the attack sends the largest JSON. Python runs no other thread while it parses JSON,
        so the client may wait longer.
    """

    name: str
    run: Callable[[int], Awaitable[Counter[str]]]
    expected: str
    sends_largest_json: bool = False

    def find_faults(self, responses: Mapping[str, int]) -> list[str]:
        """The responses that are not documented, or `nothing happened` without any response."""
        if not responses:
            return ["nothing happened"]
        return [response for response in responses if not re.fullmatch(self.expected, response)]


BUSY = r"429 busy|503 out_of_time"
"""Responses that are always allowed when the service is busy."""

DONE = rf"200|422 (result_too_large|invalid_request|unsupported_by_format)|{BUSY}"
"""Responses to work that the service does or refuses."""
