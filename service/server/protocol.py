"""HTTP/1.1 by uvicorn, with deadlines, limits and problem documents added."""

import asyncio
from contextlib import suppress
from math import inf
from typing import Any

import httptools
import orjson
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from service.api import problems
from service.api.problems import ProblemKind
from service.errors import Issue
from service.settings.values import Settings

MAX_PIPELINED = 16
"""Most requests of a connection that wait for the response to an earlier request."""


def build_refusal(problem: ProblemKind, settings: Settings) -> Response:
    """The response with a problem document. It tells the client that the connection closes."""
    needed = {
        problems.HEAD_TOO_LARGE.code: f"at most {settings.max_head_bytes} bytes",
        problems.HEAD_TOO_SLOW.code: f"all of it within {settings.head_timeout:g} s",
        problems.TOO_MANY_CONNECTIONS.code: f"at most {settings.max_connections} connections",
    }
    issue = Issue(problem.code, problem.detail, needed=needed.get(problem.code, ""))
    issues = () if problem is problems.INTERNAL_ERROR else (issue,)
    headers = {**problems.PROBLEM_HEADERS, "Connection": "close"}
    if problem.status == 503:
        headers["Retry-After"] = "1"
    content = orjson.dumps(problems.problem_document(problem, issues))
    return Response(content, problem.status, headers, problems.MEDIA_TYPE)


def add_failure_response(app: ASGIApp, settings: Settings, state: Any) -> ASGIApp:
    """Wraps an application: sends a problem if it fails, or if uvicorn cancels it at shutdown."""

    async def respond(scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await app(scope, receive, send)
        except (asyncio.CancelledError, Exception) as error:
            problem = problems.INTERNAL_ERROR if isinstance(error, Exception) else problems.DRAINING
            if scope["type"] == "http":
                with suppress(RuntimeError):  # a response has begun
                    await build_refusal(problem, settings)(scope, receive, send)
                    state.count_refusal(problem.code)
            if problem is problems.INTERNAL_ERROR:
                raise  # for uvicorn's log

    return respond


class StopParsing(Exception):
    """Ends the parsing of a request, for a problem or because too many requests wait."""

    def __init__(self, problem: ProblemKind = problems.MALFORMED_REQUEST) -> None:
        self.problem = problem


class BoundedProtocol(HttpToolsProtocol):
    """A connection with limits: the size of heads, and deadlines for heads and responses."""

    def __init__(self, settings: Settings, state: Any, **uvicorn: Any) -> None:
        super().__init__(**uvicorn)
        self._settings, self._state = settings, state
        # The newest request for which the application was called, and its response.
        self._running: RequestResponseCycle | None = None
        # Deadlines for the next head, and for the client to read; on the clock of the event loop.
        self._head_due = self._response_due = inf
        self._unread = 0  # bytes since the last head, chunk of a body, or message ended
        self._in_body = self._ignores_input = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        # `on_headers_complete` makes this connection the transport of uvicorn's cycles, so that
        # they call `close` below; they also need these two methods of the transport.
        self.write, self.is_closing = transport.write, transport.is_closing
        self._head_due = self.loop.time() + self._settings.head_timeout
        if len(self.connections) > self._settings.max_connections:
            self._refuse(problems.TOO_MANY_CONNECTIONS)

    def connection_lost(self, exc: Exception | None) -> None:
        self._disconnect()
        self._unset_keepalive_if_required()
        super().connection_lost(exc)
        self._running = self.cycle = None  # type: ignore[assignment]  # breaks reference cycles

    def data_received(self, data: bytes) -> None:
        if self._ignores_input:
            return
        self._unread += len(data)
        try:
            self.parser.feed_data(data)
            if self._unread > self._settings.max_head_bytes:
                self._refuse(problems.HEAD_TOO_LARGE)
        except httptools.HttpParserUpgrade as upgrade:
            # The service ignores the offer: a new parser reads the request again without it.
            head_and_rest = head_without_upgrade(self) + data[upgrade.args[0] :]
            self._unread, self.parser = 0, httptools.HttpRequestParser(self)
            self.data_received(head_and_rest)
        except httptools.HttpParserError as error:
            if not self._ignores_input:
                # If a callback raised `StopParsing`, it is the context of the error of httptools.
                self._refuse(getattr(error.__context__, "problem", problems.MALFORMED_REQUEST))
        # The deadline of the next head starts with its first bytes, or when the connection opens.
        is_idle = self._running is None or self._running.response_complete
        if self._unread and is_idle and self._head_due == inf:
            self._head_due = self.loop.time() + self._settings.head_timeout

    def on_headers_complete(self) -> None:
        if len(self.pipeline) >= MAX_PIPELINED and not self._ignores_input:
            # The connection ends after the response to the newest request. The error only stops the
            # parser: `data_received` sends no response to it, because the input is ignored.
            self._ignores_input, self.cycle.keep_alive = True, False
            raise StopParsing
        check_head(self, self._settings.max_head_bytes)
        if not self.parser.should_upgrade():
            # uvicorn stops its timer for idle connections whenever data arrive. Here the timer runs
            # until a head is complete, so that it also ends a connection whose input is ignored.
            self._unset_keepalive_if_required()
            super().on_headers_complete()
            self.headers = []  # uvicorn adds trailers to this list; the request keeps the old list
            self.cycle.transport = self  # type: ignore[assignment]  # so that it calls `close` below
            stays = self._state.ready and not self._state.is_retiring
            self.cycle.keep_alive = self.cycle.keep_alive and stays
            self._in_body, self._unread, self._head_due = True, 0, inf

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: Any) -> None:
        self._running = cycle
        super()._start_asgi_task(cycle, app)

    def on_body(self, body: bytes) -> None:
        self._unread = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        if not self.parser.should_upgrade():
            self._in_body, self._unread = False, 0
            super().on_message_complete()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._response_due = self._send_deadline()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._response_due = inf

    def end_if_late(self, now: float) -> None:
        """Ends the connection after a deadline; the server calls this 10 times a second."""
        if now > self._response_due:
            self.transport.abort()
        elif now > self._head_due:
            # After a part of a head the client gets a problem; an idle connection only closes.
            self._refuse(problems.HEAD_TOO_SLOW) if self._unread else self.transport.close()

    def close_after_response(self) -> None:
        """Closes the connection after the response to its newest request, which says so.

        If the response has begun without saying so, the next one closes the connection.
        """
        if not getattr(self.cycle, "response_started", True):  # None before the first request
            self.cycle.keep_alive = False

    def close(self) -> None:
        """Closes the direction to the client; the other closes with the client, or at a deadline.

        If both were closed at once while the client still sends a body, the system would reset the
        connection, and the client could lose the response.
        """
        self._disconnect()
        self._ignores_input, self._head_due = True, inf
        is_crowded = len(self.connections) > self._settings.max_connections
        if self.transport.is_closing() or is_crowded or not self._state.ready:
            # Both directions at once: no connection is left that would wait for the client.
            self.transport.close()
        else:
            self.flow.resume_reading()  # so that the loop sees when the client closes
            self.transport.write_eof()
            self._response_due = self._send_deadline()

    def _refuse(self, problem: ProblemKind) -> None:
        """Responds with a problem, after the responses to earlier requests, and then closes."""
        self._state.count_refusal(problem.code)
        if self._in_body and self.pipeline:
            # The request with the incomplete body is the newest one, and has not started: it is
            # removed, and the responses to earlier requests are still sent.
            self.pipeline.popleft()
        elif self._in_body and self.cycle.response_started:
            # The client already has the beginning of a response, which a problem cannot replace.
            return self.close()
        elif self._in_body:
            # The request has started, but its response has not: the request ends, and its response
            # is the problem.
            self._disconnect()
            self.cycle = None  # type: ignore[assignment]
        # uvicorn sends responses in the order of requests. So the parser reads one more request,
        # which the client did not send, and the response to it is the problem.
        self.app, self._ignores_input = build_refusal(problem, self._settings), True
        self.parser = httptools.HttpRequestParser(self)
        self.parser.feed_data(b"GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")

    def _disconnect(self) -> None:
        """Drops waiting requests, and tells the running one that its client has disconnected."""
        self.pipeline.clear()
        if self._running is not None and not self._running.response_complete:
            self._running.disconnected, self._running.waiting_for_100_continue = True, False
            self._running.message_event.set()

    def _send_deadline(self) -> float:
        """The time until which the client must have read the bytes that wait to be sent."""
        mebibytes = 1 + (self.transport.get_write_buffer_size() >> 20)
        return self.loop.time() + self._settings.send_timeout * mebibytes


def check_head(connection: HttpToolsProtocol, max_bytes: int) -> None:
    """Raises `StopParsing` for a head that is too long or ambiguous but that httptools accepts."""
    method, version = connection.parser.get_method(), connection.parser.get_http_version()
    size, host_count = len(connection.url), 0
    is_clear = method != b"CONNECT" and version in ("1.0", "1.1")
    for name, value in connection.headers:
        size += len(name) + len(value)
        host_count += name == b"host"
        if name == b"transfer-encoding":
            is_clear = is_clear and version == "1.1" and value.lower() == b"chunked"
    if size > max_bytes:
        raise StopParsing(problems.HEAD_TOO_LARGE)
    # HTTP/1.1 requires one Host header, and HTTP/1.0 allows one.
    if not is_clear or (host_count != 1 and (host_count or version == "1.1")):
        raise StopParsing(problems.MALFORMED_REQUEST)


def head_without_upgrade(connection: HttpToolsProtocol) -> bytes:
    """The head that was read last, without its Upgrade header.

    The service may ignore this header (RFC 9110, section 7.8), but with it httptools would not read
    the body.
    """
    version = f"HTTP/{connection.parser.get_http_version()}".encode()
    line = b" ".join((connection.parser.get_method(), connection.url, version))
    fields = (b": ".join(field) for field in connection.headers if field[0] != b"upgrade")
    return b"\r\n".join((line, *fields, b"", b""))
