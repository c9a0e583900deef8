"""Reads a body of lines of JSON (`application/x-ndjson`) while it arrives, in batches of lines.

The body has limits of its own: its bytes in all, the bytes of a line, and its speed. Only the lines
of one batch, and the beginning of the next line, are in memory.
"""

import time
from asyncio import timeout
from collections.abc import AsyncGenerator, Mapping
from dataclasses import dataclass, field

from fastapi import Request
from starlette.requests import ClientDisconnect

from service.api.errors import BodyTooLarge, BodyTooSlow
from service.api.intake import GROUP_PARTS
from service.api.receiving import refuse_coding
from service.api.services import Context
from service.errors import InvalidRequest, Issue
from service.schemas.budget import DocumentBudget
from service.schemas.document import DocumentLimits
from service.settings.values import Settings

MEDIA_TYPE = "application/x-ndjson"

BATCH_BYTES = 1 << 18
"""Bytes after which a batch of lines is complete; also after `GROUP_PARTS` lines."""

PACE_BYTES = 1 << 20
"""The client has `SURFACE_BODY_TIMEOUT` to send each of this many bytes."""


@dataclass(slots=True)
class _Batch:
    """The lines that have arrived since the last batch, and the beginning of the next line.

    Attributes
    ----------
    lines : list of bytes
        Complete lines, without their line feeds.
    pieces : list of bytes
        The beginning of the next line.
    budget : DocumentBudget
        Counts the values of the next line.
    memory : int
        The most bytes that the lines and their objects in Python take.
    size : int
        Bytes of the lines.
    """

    limits: DocumentLimits
    lines: list[bytes] = field(default_factory=list)
    pieces: list[bytes] = field(default_factory=list)
    budget: DocumentBudget = field(init=False)
    memory: int = 0
    size: int = 0

    def __post_init__(self) -> None:
        self.budget = DocumentBudget(self.limits)

    def add(self, piece: bytes) -> None:
        """Add a piece of the next line."""
        self.budget.take(piece)
        self.pieces.append(piece)

    def end_line(self) -> None:
        """The next line is complete."""
        line = b"".join(self.pieces)
        self.lines.append(line)
        self.memory += self.budget.memory
        self.size += len(line)
        self.pieces, self.budget = [], DocumentBudget(self.limits)

    @property
    def is_full(self) -> bool:
        return len(self.lines) >= GROUP_PARTS or self.size >= BATCH_BYTES

    def take_lines(self) -> list[bytes]:
        """The complete lines, which the batch then forgets."""
        lines, self.lines, self.memory, self.size = self.lines, [], 0, 0
        return lines


async def read_lines(
    context: Context, headers: Mapping[bytes, bytes]
) -> AsyncGenerator[tuple[int, list[bytes]]]:
    """Yields batches of lines, each with the number of lines before it.

    The line feed after the last line may be missing. An empty line counts as a line. Between two
    batches nothing is read: so a client that sends faster than its parts are checked must wait.

    Raises
    ------
    UnsupportedMediaType, BodyTooLarge, BodyTooSlow, InvalidRequest, TooLarge, Busy,
    ClientDisconnect
        The pointer of an error in a line is that of its part, `/parts/3`.
    """
    services, computation, request, _ = context
    settings = services.settings
    refuse_coding(headers)
    max_line = min(settings.max_json_bytes, settings.max_job_bytes)
    declared_length = headers.get(b"content-length", b"")
    if declared_length.isdigit() and int(declared_length[:20]) > settings.max_job_bytes:
        raise lines_too_large(settings)
    batch = _Batch(services.document_limits)
    first, received_bytes, is_complete, seconds = 0, 0, False, settings.body_timeout
    while not is_complete:
        start = time.monotonic()
        try:
            with computation.timing.step("read"):
                async with timeout(seconds):
                    chunk, is_complete = await _receive(request)
        except TimeoutError:
            raise lines_too_slow(received_bytes, settings) from None
        seconds -= time.monotonic() - start
        if (received_bytes + len(chunk)) // PACE_BYTES > received_bytes // PACE_BYTES:
            seconds = settings.body_timeout
        received_bytes += len(chunk)
        if received_bytes > settings.max_job_bytes:
            raise lines_too_large(settings)
        *ends, rest = chunk.split(b"\n")
        for piece in ends:
            _add(batch, piece, first, max_line)
            batch.end_line()
            if batch.is_full:
                computation.hold_body(batch.memory + len(chunk))
                lines = batch.take_lines()
                yield first, lines
                first += len(lines)
        _add(batch, rest, first, max_line)
        computation.hold_body(batch.memory + batch.budget.memory)
    if b"".join(batch.pieces).strip():
        batch.end_line()
    if batch.lines:
        yield first, batch.take_lines()


async def _receive(request: Request) -> tuple[bytes, bool]:
    """The next bytes of the body, and whether they are the last."""
    event = await request.receive()
    if event["type"] == "http.disconnect":
        raise ClientDisconnect
    return event.get("body", b""), not event.get("more_body", False)


def _add(batch: _Batch, piece: bytes, first: int, max_line: int) -> None:
    """Adds a piece of a line; refuses a line that is too long or has too many values."""
    where = f"/parts/{first + len(batch.lines)}"
    if batch.budget.received + len(piece) > max_line:
        raise line_too_long(where, max_line)
    try:
        batch.add(piece)
    except InvalidRequest as error:
        raise error.within(where) from None


def line_too_long(where: str, max_bytes: int) -> BodyTooLarge:
    """The error of a line with more than `max_bytes` bytes; `where` is the pointer of its part."""
    return BodyTooLarge(
        Issue(
            "body_too_large",
            "A line of the body is longer than this service reads.",
            where,
            got=f"a line of more than {max_bytes} bytes",
            needed=f"at most {max_bytes} bytes a line",
        )
    )


def lines_too_large(settings: Settings) -> BodyTooLarge:
    """The error of a body with more bytes than those of a job."""
    return BodyTooLarge(
        Issue(
            "body_too_large",
            "The body is longer than this service reads.",
            got=f"more than {settings.max_job_bytes} bytes",
            needed=f"at most {settings.max_job_bytes} bytes; or several jobs",
        )
    )


def lines_too_slow(received_bytes: int, settings: Settings) -> BodyTooSlow:
    """The error of a body whose next bytes did not arrive in time."""
    return BodyTooSlow(
        Issue(
            "body_too_slow",
            "The body did not arrive in time.",
            got=f"{received_bytes} bytes",
            needed=f"each {PACE_BYTES} bytes within {settings.body_timeout:g} s",
        )
    )
