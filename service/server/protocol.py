"""HTTP/1.1 as it is spoken here: uvicorn's own protocol, with bounds and without doubts.

What could be read in two ways is refused, since whatever is in front might read it in the other:
RFC 9112, section 11.2. Most of it is what httptools does by itself.
"""

import asyncio
import socket
import struct
from contextlib import suppress
from typing import Any
from urllib.parse import unquote

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from service.server.connections import LINGERING, Connection, Connections
from service.server.cycle import Cycle, Wire
from service.server.refusals import (
    Refusal,
    draining,
    head_too_large,
    head_too_slow,
    malformed,
    too_many_connections,
)
from service.server.upgrades import body_parser

PIPELINED = 16
"""Requests that may wait for the answers to those before them on the same connection."""

DISCARDED = 1 << 26
"""Bytes that are read of what nobody wants, so that its sender sees the answer."""

_LOOKED_AT = frozenset({b"host", b"expect", b"transfer-encoding"})
_AT_ONCE = struct.pack("ii", 1, 0)


class BoundedProtocol(HttpToolsProtocol):
    """A connection, of which everything has its bound: heads, waiting requests, times.

    A client that ends its half of the connection is taken to have gone.

    Parameters
    ----------
    connections : Connections
        All those of the server, with their settings.
    """

    def __init__(self, connections: Connections, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._connections = connections
        self._most = connections.settings.max_head_bytes
        self._queue: dict[Connection, float] | None = None
        self._last: Cycle | None = None  # the request that was read last, answered or not
        self._running: Cycle | None = None
        self._wire: Wire | None = None
        self._refusal: Refusal | None = None
        self._head = self._hosts = self._unread = self._discarded = 0
        self._within = self._headed = False  # where the parser is: in a request, behind its head
        self._deaf = self._left = False  # what arrives is of no interest; the last was said

    # A connection comes and goes.

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client has come."""
        super().connection_made(transport)
        self._wire = Wire(transport, self._leave)
        if self._connections.add(self, self.loop):
            self._wait_in(self._connections.silent)
        elif self._connections.is_crowded:
            self.abort()
        else:
            self._refuse(too_many_connections(self._connections.settings.max_connections))

    def connection_lost(self, exc: Exception | None) -> None:
        """A client has gone: all its requests are told, not only the last."""
        self._wait_in(None)
        self._connections.remove(self)
        for cycle in (self._running, *(waiting for waiting, _ in self.pipeline)):
            if cycle is not None:
                _tell(cycle)
        self.pipeline.clear()
        self._deaf = self._left = True  # a request that fails only now has nothing to end
        super().connection_lost(exc)
        # What holds on to itself stays until Python looks for it, which it is told to do rarely.
        self.cycle = None  # type: ignore[assignment]
        self._running = self._last = self._wire = self._refusal = None

    def eof_received(self) -> None:
        """A client will send nothing more; what was written to it, it may still take."""
        self._expect_to_be_taken()

    # What arrives.

    def data_received(self, data: bytes) -> None:
        """Some bytes: whatever ends within them sets the number of the unread ones to zero."""
        if self._deaf:
            self._discarded += len(data)
            if self._discarded > DISCARDED:
                self.abort()
            return
        self._unread += len(data)
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade as offer:
            self._ignore(data[offer.args[0] :])
        except httptools.HttpParserError:
            self._stumble()
        if self._unread > self._most and not self._deaf:
            self._refuse(head_too_large(self._most))
        self._settle()

    def on_message_begin(self) -> None:
        """A request begins."""
        if len(self.pipeline) >= PIPELINED:
            raise _TooManyWaiting
        super().on_message_begin()
        self._head = self._hosts = 0
        self._within, self._headed = True, False

    def on_url(self, url: bytes) -> None:
        """The address, or a piece of it."""
        self._count(len(url))
        self.url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """A header, or a trailer, of which nothing is known here."""
        self._count(len(name) + len(value))
        if self._headed:
            return
        name = name.lower()
        if name in _LOOKED_AT:
            self._look_at(name, value.lower())
        self.headers.append((name, value))

    def on_headers_complete(self) -> None:
        """The head of a request has been read: it is answered, or waits for those before it."""
        version = self.parser.get_http_version()
        if version != "1.1":
            if version != "1.0":
                self._stop(malformed("version 1.1 or 1.0 of HTTP"))
            self.scope["http_version"] = version
        if self._hosts != 1 and (self._hosts or version == "1.1"):
            self._stop(malformed("one Host header"))
        method = self.parser.get_method()
        if method == b"CONNECT":
            self._stop(malformed("another method than CONNECT"))
        target = httptools.parse_url(self.url)
        raw = target.path or b"/"
        path = raw.decode("ascii")
        scope = self.scope
        scope["method"] = method.decode("ascii")
        scope["path"] = unquote(path) if "%" in path else path
        scope["raw_path"] = raw
        scope["query_string"] = target.query or b""
        self._headed = True
        before = self._last
        self._last = self.cycle = cycle = Cycle(
            self._connections,
            scope=scope,
            transport=self._wire,
            flow=self.flow,
            logger=self.logger,
            access_logger=self.access_logger,
            access_log=self.access_log,
            default_headers=self.server_state.default_headers,
            message_event=asyncio.Event(),
            expect_100_continue=self.expect_100_continue,
            keep_alive=version == "1.1" and self.parser.should_keep_alive(),
            on_response=self.on_response_complete,
        )
        if before is None or before.response_complete:
            self._start_asgi_task(cycle, self.app)
        else:
            self.flow.pause_reading()
            self.pipeline.appendleft((cycle, self.app))

    def on_body(self, body: bytes) -> None:
        """Bytes of the body, which the application bounds."""
        self._unread = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The request has been read."""
        self._unread = 0
        self._within = False
        super().on_message_complete()

    def _count(self, length: int) -> None:
        self._unread = 0
        self._head += length
        if self._head > self._most:
            self._stop(head_too_large(self._most))

    def _look_at(self, name: bytes, value: bytes) -> None:
        if name == b"host":
            self._hosts += 1
        elif name == b"expect":
            self.expect_100_continue = value == b"100-continue" and self._is_1_1()
        elif value != b"chunked" or not self._is_1_1():
            self._stop(malformed("no transfer coding but chunked, in HTTP/1.1"))

    def _is_1_1(self) -> bool:
        return bool(self.parser.get_http_version() == "1.1")

    def _stop(self, refusal: Refusal) -> None:
        """Makes the parser stop: for it, this is a request that it cannot read."""
        self._refusal = refusal
        raise refusal

    def _stumble(self) -> None:
        """The parser has stopped, and cannot go on."""
        if self._last is not None and len(self.pipeline) >= PIPELINED:
            # Those that were read are answered; the client knows which were not.
            self._deaf = self._within = True
            self._last.keep_alive = False
        else:
            self._refuse(self._refusal or malformed())

    def _ignore(self, rest: bytes) -> None:
        """Goes on with HTTP/1.1, though another protocol was offered: the answer is the last."""
        cycle = self._last
        assert cycle is not None
        cycle.keep_alive = False
        parser = body_parser(self, cycle.scope["headers"])
        if parser is None:
            self._deaf = True
            return
        # The parser took the body for something of the other protocol.
        cycle.more_body = self._within = True
        self.parser = parser
        if rest:
            self.data_received(rest)

    # What is answered.

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: Any) -> None:
        assert isinstance(cycle, Cycle)
        self._running = cycle
        super()._start_asgi_task(cycle, app)

    def on_response_complete(self) -> None:
        """An answer has been written."""
        self.server_state.total_requests += 1
        if self._left or self.transport.is_closing():
            return
        self.flow.resume_reading()
        if self.pipeline:
            self._start_asgi_task(*self.pipeline.pop())
        elif self._refusal is not None:
            self._say(self._refusal)
        else:
            self._settle()

    def _refuse(self, refusal: Refusal) -> None:
        """Makes this the last answer of the connection, after those to earlier requests."""
        self._connections.refused(refusal.problem.code)
        self._deaf = True
        self._refusal = refusal
        own = self._last if self._within and self._headed else None
        if own is not None:
            if self.pipeline and self.pipeline[0][0] is own:
                self.pipeline.popleft()
            elif own.response_started:
                # An answer that has begun cannot become another one.
                _tell(own)
                self._leave()
                return
            else:
                _tell(own)
                self._say(refusal)
                return
        if self._running is None or self._running.response_complete:
            self._say(refusal)

    def _say(self, refusal: Refusal) -> None:
        """Writes the last answer."""
        self.transport.write(refusal.answer(self.server_state.default_headers))
        self._within = True  # who was refused may go on
        self._leave()

    def _leave(self) -> None:
        """Ends the connection after its last answer.

        While its client still sends, the connection is read for a while, and what comes is thrown
        away: were it closed, the system would tell the client so before it has seen the answer
        (RFC 9112, section 9.6).
        """
        if self._left:
            return
        self._deaf = self._left = True
        if not self._within and not self.pipeline:
            self.close()
            return
        self._wait_in(None)
        unsent = self.unsent()
        seconds = LINGERING + (self._connections.time_to_take(unsent) if unsent else 0)
        self._connections.taking[self] = self.loop.time() + seconds
        self.transport.write_eof()
        self.flow.resume_reading()

    # Times.

    def _settle(self) -> None:
        """Finds out what is waited for."""
        last = self._last
        if self._deaf or (last is not None and not last.response_complete):
            self._wait_in(None)
        elif self._within or self._unread:
            self._wait_in(self._connections.arriving)
        else:
            self._wait_in(self._connections.silent if last is None else self._connections.idle)

    def _wait_in(self, queue: dict[Connection, float] | None) -> None:
        """Changes the queue; who is in it already stays in its place."""
        if queue is not self._queue:
            if self._queue is not None:
                del self._queue[self]
            if queue is not None:
                queue[self] = self.loop.time()
            self._queue = queue

    def time_is_up(self) -> None:
        """It has been in its queue for as long as it may."""
        if self._queue is self._connections.arriving and not (self._within and self._headed):
            self._refuse(head_too_slow(self._connections.settings.head_timeout))
        else:
            self.close()

    def pause_writing(self) -> None:
        """The client is slower than we are."""
        super().pause_writing()
        self._expect_to_be_taken()

    def resume_writing(self) -> None:
        """The client has taken all."""
        super().resume_writing()
        if not self._left and not self.transport.is_closing():
            self._connections.taking.pop(self, None)

    def _expect_to_be_taken(self) -> None:
        unsent = self.unsent()
        if unsent:
            end = self.loop.time() + self._connections.time_to_take(unsent)
            self._connections.taking.setdefault(self, end)

    @property
    def is_answering(self) -> bool:
        """Whether an answer is awaited, or has not been taken as a whole."""
        running = self._running
        awaited = running is not None and not (running.response_complete or running.disconnected)
        return awaited or self.unsent() > 0

    def unsent(self) -> int:
        """Bytes that were written and have not been taken."""
        return self.transport.get_write_buffer_size()

    # Ends.

    def close(self) -> None:
        """Ends the connection, once what was written has been taken."""
        self._deaf = self._left = True
        self._wait_in(None)
        self._expect_to_be_taken()
        self.transport.close()

    def give_up(self) -> None:
        """Ends the connection because the process does, with an answer if none has begun."""
        running = self._running
        if running is None or running.response_complete or running.response_started or self._left:
            self.abort()
        else:
            _tell(running)
            self._connections.refused("draining")
            self._say(draining())

    def abort(self) -> None:
        """Ends the connection, and makes the system forget what was written, too."""
        sock = self.transport.get_extra_info("socket")
        if sock is not None:
            with suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)
        self.transport.abort()


class _TooManyWaiting(Exception):
    """More requests than are kept waiting."""


def _tell(cycle: RequestResponseCycle) -> None:
    """Tells the application that nobody waits for its answer."""
    cycle.disconnected = True
    cycle.waiting_for_100_continue = False
    cycle.message_event.set()
