"""Requests that offer to go on in another protocol, as some clients do with each: HTTP/2, say.

The offer may be ignored (RFC 9110, section 7.8). But httptools stops where the request's head ends,
and would read a body as the next request; it is told where the body ends by a parser of its own.
"""

from collections.abc import Callable, Iterable
from typing import Protocol

import httptools

_FRAMING = (b"content-length", b"transfer-encoding")


class _Reader(Protocol):
    def on_body(self, body: bytes) -> None:
        """Bytes of the body."""

    def on_message_complete(self) -> None:
        """The end."""


class _BodyOnly:
    """What a parser tells of a body alone."""

    def __init__(self, reader: _Reader) -> None:
        self.on_body: Callable[[bytes], None] = reader.on_body
        self.on_message_complete: Callable[[], None] = reader.on_message_complete


def body_parser(
    reader: _Reader, headers: Iterable[tuple[bytes, bytes]]
) -> httptools.HttpRequestParser | None:
    """What reads the body that these headers announce, if there is one, and nothing after it."""
    framing = [name + b": " + value for name, value in headers if name in _FRAMING]
    if not framing or framing == [b"content-length: 0"]:
        return None
    parser = httptools.HttpRequestParser(_BodyOnly(reader))
    parser.feed_data(b"\r\n".join((b"POST / HTTP/1.1", *framing, b"", b"")))
    return parser
