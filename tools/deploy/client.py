"""HTTP/1.1 by hand: whatever is no whole and well-formed answer is an error, and none is retried.

Clients that people use hide a connection that was closed under them by asking once more; this one
counts it.
"""

import asyncio
import gzip
from contextlib import suppress
from dataclasses import dataclass

LINE = 1 << 16
"""Bytes of the longest line that is read."""


class Broken(Exception):
    """The connection broke, or what came over it is no whole answer."""


@dataclass(frozen=True)
class Answer:
    """What a server said; the body is whole, and decoded."""

    status: int
    headers: dict[str, str]
    body: bytes


class Connection:
    """One connection at a time to a server, opened when it is needed."""

    def __init__(self, host: str, port: int) -> None:
        self._host = host
        self._port = port
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def ask(
        self, method: str, target: str, headers: dict[str, str], body: bytes = b""
    ) -> Answer:
        """Sends a request and reads the answer.

        Raises
        ------
        Broken
        """
        try:
            if self._streams is None:
                self._streams = await asyncio.open_connection(self._host, self._port, limit=LINE)
            reader, writer = self._streams
            lines = [f"{method} {target} HTTP/1.1", f"Host: {self._host}:{self._port}"]
            lines += [f"{name}: {value}" for name, value in headers.items()]
            if body or method == "POST":
                lines.append(f"Content-Length: {len(body)}")
            writer.write("\r\n".join((*lines, "", "")).encode("ascii") + body)
            await writer.drain()
            answer = await _read(reader, method)
        except (OSError, EOFError, ValueError) as error:
            await self.close()
            raise Broken(f"{type(error).__name__}: {error}") from None
        if answer.headers.get("connection", "").lower() == "close":
            await self.close()
        return answer

    async def close(self) -> None:
        """Ends the connection, if there is one; the next request opens another."""
        if self._streams is not None:
            writer, self._streams = self._streams[1], None
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()


async def _read(reader: asyncio.StreamReader, method: str) -> Answer:
    status_line = await _line(reader)
    version, status, *_ = status_line.split(" ")
    if version != "HTTP/1.1":
        raise ValueError(f"not a status line: {status_line!r}")
    headers: dict[str, str] = {}
    while line := await _line(reader):
        name, colon, value = line.partition(":")
        if not colon:
            raise ValueError(f"not a header: {line!r}")
        headers[name.strip().lower()] = value.strip()
    if method == "HEAD" or status in ("204", "304"):
        body = b""
    elif headers.get("transfer-encoding") == "chunked":
        body = await _chunks(reader)
    else:
        body = await reader.readexactly(int(headers["content-length"]))
    if headers.get("content-encoding") == "gzip":
        body = gzip.decompress(body)
    return Answer(int(status), headers, body)


async def _chunks(reader: asyncio.StreamReader) -> bytes:
    pieces = []
    while length := int(await _line(reader), 16):
        pieces.append(await reader.readexactly(length))
        await reader.readexactly(2)
    while await _line(reader):
        pass
    return b"".join(pieces)


async def _line(reader: asyncio.StreamReader) -> str:
    line = await reader.readuntil(b"\r\n")
    return line[:-2].decode("latin-1")
