"""Static files: the service reads and compresses each once, and serves it with an entity tag."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from service.api.caching.cached_response import FOR_EVER, entity_tag, find_match, matches_all
from service.api.caching.codings import Coding, compress
from service.api.negotiation import accepts_brotli, codings_of, condition_of
from service.api.responses import HEADERS, ChunkedResponse


@dataclass(slots=True)
class StaticFile:
    """A file: how to read it, its media type, extra headers, and whether its name has its hash.

    `brotli` is the same file compressed by Brotli, if that was done when the file was built.
    Once it is loaded, it has its content, its hash in hexadecimal, and its bodies by coding. A
    compressed body is None if it is not much smaller than the content.
    """

    read: Callable[[], bytes]
    media_type: str
    headers: Mapping[str, str] = field(default_factory=dict)
    is_immutable: bool = False
    brotli: "StaticFile | None" = None
    content: bytes = b""
    hash: str = ""
    bodies: dict[Coding, bytes | None] = field(default_factory=dict)


class StaticFiles:
    """The files that the service serves, by name.

    Entity tags are hashes of the bytes. Clients keep files whose names have their hashes for ever;
    `Cache-Control: no-cache` makes them revalidate all others every time, so that they never mix
    the files of two releases.
    """

    def __init__(self, files: Mapping[str, StaticFile]) -> None:
        self._files = files

    def __contains__(self, name: str) -> bool:
        return name in self._files

    async def respond(self, request: Request, name: str, tags: str = "") -> Response:
        """The response to GET or HEAD for the file of this name.

        `tags` are inserted at the end of the head of a page.

        Raises
        ------
        HTTPException
            404 if no file has this name, or the file is missing.
        """
        accepted, condition = codings_of(request), condition_of(request)
        file = self._files.get(name)
        if file is None:
            raise HTTPException(404)
        if tags:
            file = await _insert_tags(file, tags)
        is_brotli = file.brotli is not None and accepts_brotli(request)
        if file.brotli is not None and is_brotli:
            file, accepted = file.brotli, ("identity",)
        await _load(file)
        coding, body = await self._encode_file(file, accepted[0])
        unchanged_coding = find_match(condition, accepted, partial(entity_tag, file.hash))
        if condition is not None and matches_all(condition):
            unchanged_coding = coding
        headers = {
            **HEADERS,
            **file.headers,
            "ETag": entity_tag(file.hash, unchanged_coding or coding).decode(),
            "Cache-Control": FOR_EVER if file.is_immutable else "no-cache",
            "Vary": "Accept-Encoding",
        }
        if unchanged_coding is not None:
            return Response(status_code=304, headers=headers)
        if is_brotli or coding != "identity":
            headers["Content-Encoding"] = "br" if is_brotli else coding
        return ChunkedResponse(body, 200, headers, file.media_type)

    async def _encode_file(self, file: StaticFile, coding: Coding) -> tuple[Coding, bytes]:
        """The file in a coding, or unchanged if the coding hardly makes it smaller."""
        if coding == "identity":
            return coding, file.content
        if coding not in file.bodies:
            # Two requests at the same time may both compress the file: their bytes are the same.
            file.bodies[coding] = await asyncio.to_thread(compress, coding, file.content)
        body = file.bodies[coding]
        return ("identity", file.content) if body is None else (coding, body)


async def _insert_tags(file: StaticFile, tags: str) -> StaticFile:
    """A page with more tags in its head. Its entity tag depends on them, too."""
    await _load(file)
    content = file.content.replace(b"</head>", tags.encode() + b"</head>", 1)
    return StaticFile(lambda: content, file.media_type, file.headers)


async def _load(file: StaticFile) -> None:
    """Reads a file that has not been read; raises 404 if it is missing."""
    if file.hash:
        return
    try:
        file.content = await asyncio.to_thread(file.read)
    except FileNotFoundError:
        raise HTTPException(404) from None
    file.hash = sha256(file.content).hexdigest()
