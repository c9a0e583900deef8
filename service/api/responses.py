"""Responses: JSON documents and files; long bodies are sent in chunks."""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Literal
from urllib.parse import quote

import orjson
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from service.api.caching.cached_response import RawHeaders
from service.api.computation import MAX_BUFFERED, Computation
from service.encoders.cad.format import WritingReport
from service.encoders.format import Content, FileFormat, SplitContent
from service.engine.mesh.mesh import MeshReport
from service.jobs.results import Result
from service.pipeline.cad_files import count_writing
from service.pipeline.files import count_reading

CHUNK = 1 << 19
"""Bytes handed to the server at a time: the server waits for a slow client after each chunk. Chunks
are views, not copies, so a slow client takes no memory beside the response. Most responses are one
chunk; smaller chunks, of 64 KiB, take 10 percent more processor time than these."""

HEADERS = {"X-Content-Type-Options": "nosniff"}
"""Headers of every response: they forbid a browser to guess another media type."""

PAGE_HEADERS = {
    "Referrer-Policy": "no-referrer",
    # For browsers that do not know `frame-ancestors`.
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
"""Headers of pages: no other site may frame them or get their window; they use no device."""

_POST_HEADERS: RawHeaders = ((b"x-content-type-options", b"nosniff"), (b"vary", b"Accept"))
"""Headers of responses whose format `Accept` chooses."""

BOUND_HEADER = "Surface-Deviation-Bound"
"""Header of every mesh with a certified deviation, in every format."""

GAP_HEADER = "Surface-Gap-Bound"
"""Header of every mesh of breps, in every format."""

VERTICES_HEADER, TRIANGLES_HEADER = "Surface-Vertices", "Surface-Triangles"
"""Headers of every mesh, with the counts of its report."""

READING_HEADER = "Surface-Reading"
"""Header of results that were made straight from a CAD file, with the counts of its faces."""

WRITING_HEADER = "Surface-Writing"
"""Header of every file of definitions, with the counts and the unit of its report."""

_BOUND, _GAP, _VERTICES, _TRIANGLES = (
    name.lower().encode() for name in (BOUND_HEADER, GAP_HEADER, VERTICES_HEADER, TRIANGLES_HEADER)
)
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_FORBIDDEN = re.compile(r'[/\\:*?"<>|]+')
"""Characters that file names cannot have on some system. (Names of surfaces have no control
characters: the schemas refuse them.)"""


class ChunkedResponse(Response):
    """A response whose body is sent in chunks; for HEAD, only its head is sent."""

    async def __call__(self, scope: Scope, _receive: Receive, send: Send) -> None:
        """Sends the head, then views of the body, without copying it."""
        await send(
            {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        )
        body = b"" if scope["method"] == "HEAD" else self.body
        if len(body) <= MAX_BUFFERED:
            await send({"type": "http.response.body", "body": body})
        else:
            self.body = b""  # so that each buffer can be freed once it is sent
            buffers = _list_buffers(body)
            del body
            await send_buffers(buffers, send, _find_release(scope))


class FileResponse(ChunkedResponse):
    """A file, or a 304, with headers in the form the server sends."""

    body: Any  # Content

    def __init__(self, body: Content | memoryview, headers: RawHeaders, status: int = 200) -> None:
        self.body, self.status_code, self.background = body, status, None
        self.raw_headers = list(headers)


def _list_buffers(body: Content | memoryview) -> list[Any]:
    """The buffers of a body, in order.

    Joins neighbouring buffers of a `SplitContent` that are shorter than a chunk: sending each costs
    more than copying it.
    """
    return list(body.join_short(CHUNK)) if isinstance(body, SplitContent) else [body]


def _find_release(scope: Scope) -> Callable[[int], None]:
    """The function that gives back the memory of sent bytes: that of the request's computation."""
    computation: Computation | None = scope.get("state", {}).get("computation")
    return _release_nothing if computation is None else computation.release_sent


def _release_nothing(_: int) -> None:
    """For bodies that no computation holds, such as cached responses."""


async def send_buffers(
    buffers: list[Any], send: Send, release: Callable[[int], None] = _release_nothing
) -> None:
    """Sends a body in chunks: the server waits for a slow client after each chunk.

    Empties the list, and calls `release` with the length of each buffer when it is sent: when the
    server has taken the chunk after it, for which it waits until it has sent the buffer.
    """
    sent_bytes = 0
    buffers.reverse()
    while buffers:
        view = memoryview(buffers.pop())
        for start in range(0, len(view), CHUNK):
            chunk = view[start : start + CHUNK]
            await send({"type": "http.response.body", "body": chunk, "more_body": True})
            del chunk
            if sent_bytes:
                release(sent_bytes)
                sent_bytes = 0
        sent_bytes = len(view)
    await send(_END)


_END: Message = {"type": "http.response.body", "body": b"", "more_body": False}


def json_response(
    content: Mapping[str, Any],
    status: int = 200,
    headers: Mapping[str, str] = HEADERS,
    media_type: str = "application/json",
) -> Response:
    """The response with a JSON document."""
    return ChunkedResponse(orjson.dumps(content), status, headers, media_type)


def bytes_response(
    content: bytes, computation: Computation, headers: Mapping[str, str] = HEADERS
) -> Response:
    """The response with a JSON document that a computation wrote, and with `Server-Timing`."""
    computation.finish_work(len(content))
    timed_headers = {**headers, "Server-Timing": str(computation.timing)}
    return ChunkedResponse(content, 200, timed_headers, "application/json")


def report_headers(report: MeshReport | Result | None) -> RawHeaders:
    """Counts and bounds of a mesh as headers: many formats cannot store a report.

    The result of a part of a job has them too, if it is a mesh.
    """
    if report is None or report.vertices is None or report.triangles is None:
        return ()
    counts = (_VERTICES, b"%d" % report.vertices), (_TRIANGLES, b"%d" % report.triangles)
    bounds = (_BOUND, report.deviation_bound), (_GAP, report.gap_bound)
    return (
        *counts,
        *((name, repr(bound).encode()) for name, bound in bounds if bound is not None),
    )


def reading_headers(reading: Mapping[str, Any] | None) -> dict[str, str]:
    """The header with the counts of a report of reading; none without a report."""
    return {} if reading is None else {READING_HEADER: count_reading(reading)}


def writing_headers(report: WritingReport | None) -> dict[str, str]:
    """The header with the counts of a file of definitions, which has no place for a report."""
    return {} if report is None else {WRITING_HEADER: count_writing(report)}


def file_response(
    content: Content,
    fmt: FileFormat,
    name: str,
    computation: Computation,
    report: MeshReport | None = None,
    *,
    reading: Mapping[str, Any] | None = None,
    writing: WritingReport | None = None,
) -> Response:
    """The response with a file. Unless the file is JSON, it is sent with a file name.

    `reading` is the report of reading the CAD file that the file was made of, `writing` that of
    writing a file of definitions.
    """
    computation.finish_work(len(content))
    body_headers = (
        (b"content-length", b"%d" % len(content)),
        (b"server-timing", str(computation.timing).encode()),
    )
    about = (*_POST_HEADERS, *_type_headers(fmt, name), *report_headers(report))
    if reading is not None or writing is not None:
        counts = reading_headers(reading) | writing_headers(writing)
        about += tuple((each.lower().encode(), text.encode()) for each, text in counts.items())
    return FileResponse(content, (*about, *body_headers))


@lru_cache(256)
def _type_headers(fmt: FileFormat, name: str) -> RawHeaders:
    """Headers of a file: its media type, and the name to save it under."""
    media_type = (b"content-type", fmt.media_type.encode())
    if fmt.name == "json":
        return (media_type,)
    return media_type, (
        b"content-disposition",
        disposition("attachment", name, fmt.suffix).encode(),
    )


def disposition(kind: Literal["inline", "attachment"], name: str, suffix: str) -> str:
    """A Content-Disposition header with a safe file name (RFC 6266).

    A browser shows an `inline` file if it can, and saves others under this name. A name with other
    letters than ASCII is added in a second form (RFC 8187), for clients that read it.
    """
    stem = _UNSAFE.sub("-", name).strip("-.") or "surface"
    value = f'{kind}; filename="{stem}.{suffix}"'
    unicode_stem = _FORBIDDEN.sub("-", name).strip("-. ")
    if name.isascii() or not unicode_stem:
        return value
    return f"{value}; filename*=UTF-8''{quote(unicode_stem, safe='')}.{suffix}"
