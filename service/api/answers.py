"""Answers: JSON documents, and long bodies sent piece by piece."""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal
from urllib.parse import quote

import orjson
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from service.api.caching.entries import RawHeaders
from service.api.workers import Job
from service.encoders.format import FileFormat
from service.encoders.pieces import Content, Pieces
from service.engine.mesh.report import MeshReport

CHUNK = 1 << 19
"""Bytes handed to the server at a time: it waits for a slow client after each. They are not copied,
so that what a slow client leaves lying takes no memory beside the answer. Most answers are
one piece; pieces of 64 KiB take a tenth more of the processor."""

UNTRACKED = 1 << 16
"""Bytes that the server may hold of an answer that was sent, as it sees it; of shorter ones, it is
not waited for that a client has taken them."""

HEADERS = {"X-Content-Type-Options": "nosniff"}
"""On every answer: a browser shall not guess another type than the one that is said."""

PAGE_HEADERS = {
    "Referrer-Policy": "no-referrer",
    # What `frame-ancestors` says to newer browsers.
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
"""On pages: nobody frames them or holds on to their window, and they ask for nothing."""

_POST_HEADERS: RawHeaders = ((b"x-content-type-options", b"nosniff"), (b"vary", b"Accept"))
"""On answers whose format `Accept` chooses."""

BOUND_HEADER = "Surface-Deviation-Bound"
"""Header of every mesh whose distance from the surface is certified, whatever its format."""

VERTICES_HEADER, TRIANGLES_HEADER = "Surface-Vertices", "Surface-Triangles"
"""Headers of every mesh: the counts of its report."""

_BOUND, _VERTICES, _TRIANGLES = (
    name.lower().encode() for name in (BOUND_HEADER, VERTICES_HEADER, TRIANGLES_HEADER)
)
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_FORBIDDEN = re.compile(r'[/\\:*?"<>|]+')
"""What names of files cannot hold, here or there; they have no control characters anyway."""


class ChunkedResponse(Response):
    """A body of known length, sent in chunks; left out where only its head was asked for."""

    async def __call__(self, scope: Scope, _receive: Receive, send: Send) -> None:
        """Sends the head, then the body from one buffer without joining or copying the whole."""
        await send(
            {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        )
        body = b"" if scope["method"] == "HEAD" else self.body
        if len(body) <= UNTRACKED:
            await send({"type": "http.response.body", "body": body})
        else:
            await send_pieces(body, send)


class FileResponse(ChunkedResponse):
    """A file, or a 304, whose headers are there already, as the server sends them."""

    body: Any  # Content

    def __init__(self, body: Content, headers: RawHeaders, status: int = 200) -> None:
        self.body, self.status_code, self.background = body, status, None
        self.raw_headers = list(headers)


async def send_pieces(body: Content | memoryview, send: Send) -> None:
    """A body piece by piece, none of it copied: the server waits for a slow client after each."""
    for content in body if isinstance(body, Pieces) else (body,):
        whole = memoryview(content)
        for start in range(0, len(whole), CHUNK):
            piece = whole[start : start + CHUNK]
            await send({"type": "http.response.body", "body": piece, "more_body": True})
    await send(_END)


_END: Message = {"type": "http.response.body", "body": b"", "more_body": False}


def json_response(
    content: Mapping[str, Any],
    status: int = 200,
    headers: Mapping[str, str] = HEADERS,
    media_type: str = "application/json",
) -> Response:
    """A JSON document."""
    body = orjson.dumps(content)
    return ChunkedResponse(body, status, headers, media_type)


def bytes_response(content: bytes, job: Job, headers: Mapping[str, str] = HEADERS) -> Response:
    """A JSON document that a job has written; it says where its time went."""
    job.answered(len(content))
    timed = {**headers, "Server-Timing": str(job.timing)}
    return ChunkedResponse(content, 200, timed, "application/json")


def report_headers(report: MeshReport | None) -> RawHeaders:
    """Counts and bound of a mesh as headers, for formats that have no place for its report."""
    if report is None:
        return ()
    counts = (_VERTICES, b"%d" % report.vertices), (_TRIANGLES, b"%d" % report.triangles)
    if report.deviation_bound is None:
        return counts
    return (*counts, (_BOUND, repr(report.deviation_bound).encode()))


def file_response(
    content: Content, fmt: FileFormat, name: str, job: Job, report: MeshReport | None = None
) -> Response:
    """The file that a job has written; with a name to save it under, unless it is JSON."""
    job.answered(len(content))
    own = (b"content-length", b"%d" % len(content)), (b"server-timing", str(job.timing).encode())
    headers = (*_POST_HEADERS, *_kind_headers(fmt, name), *report_headers(report), *own)
    return FileResponse(content, headers)


@lru_cache(256)
def _kind_headers(fmt: FileFormat, name: str) -> RawHeaders:
    """The media type of a file, and the name to save it under."""
    media_type = (b"content-type", fmt.media_type.encode())
    if fmt.name == "json":
        return (media_type,)
    return media_type, (b"content-disposition", disposition("attachment", name, fmt).encode())


def disposition(kind: Literal["inline", "attachment"], name: str, fmt: FileFormat) -> str:
    """A name to save a file under (RFC 6266), of harmless characters.

    A browser shows what it can show of what is `inline`, and saves the rest under this name. Where
    letters were lost, those who can read it find them in a second form of the name (RFC 8187).
    """
    stem = _UNSAFE.sub("-", name).strip("-.") or "surface"
    said = f'{kind}; filename="{stem}.{fmt.suffix}"'
    letters = _FORBIDDEN.sub("-", name).strip("-. ")
    if name.isascii() or not letters:
        return said
    return f"{said}; filename*=UTF-8''{quote(letters, safe='')}.{fmt.suffix}"
