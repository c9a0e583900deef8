"""Compresses responses that are made for one request, if its client accepts that: so, quickly."""

from functools import partial
from typing import Any, cast

from starlette.responses import Response

from service.api.caching.codings import (
    MIN_BYTES,
    Coding,
    compress_fast,
    parse_accepted_codings,
)
from service.api.computation import Computation
from service.api.responses import ChunkedResponse
from service.encoders.format import Content
from service.pipeline.cost import Work, fast_compression_cost

MAX_BYTES = 32 << 20
"""Longer responses stay as they are: compression would take a thread for a second by gzip, and
delay the first byte by as long."""


MAX_GZIP_FILE = 1 << 16
"""By gzip, longer files of numbers stay as they are: they hardly become smaller, and gzip takes
longer for them than a network of 100 Mbit/s saves. Many HTTP libraries accept gzip unasked."""


async def compress_response(
    response: Response, accept_encoding: bytes, computation: Computation
) -> Response:
    """The response in the coding that an Accept-Encoding header prefers.

    It stays as it is if it is short, long, or hardly smaller in that coding, or if compression
    would have to wait for a thread or for memory. A header that accepts no coding is ignored:
    these responses always exist without.
    """
    if (
        not isinstance(response, ChunkedResponse)
        or not MIN_BYTES <= len(response.body) <= MAX_BYTES
    ):
        return response
    coding: Coding = next(iter(parse_accepted_codings(accept_encoding)), "identity")
    if coding == "identity":
        return response
    if coding == "gzip" and len(response.body) > MAX_GZIP_FILE and not _is_text(response):
        return response
    content: Content = cast(Any, response.body)
    cost = fast_compression_cost(len(content), is_gzip=coding == "gzip")
    work: Work[Content | None] = Work(cost, partial(compress_fast, coding, content))
    body = await computation.run_at_once(work, "compress")
    computation.finish_work(len(content if body is None else body))
    if body is not None:
        changed = {
            b"content-length": b"%d" % len(body),
            b"server-timing": str(computation.timing).encode(),
        }
        headers = [(name, changed.get(name, value)) for name, value in response.raw_headers]
        headers += (b"content-encoding", coding.encode()), (b"vary", b"Accept-Encoding")
        response.body, response.raw_headers = cast(Any, body), headers
    return response


def _is_text(response: Response) -> bool:
    """Whether the body is text, by its media type."""
    media_type = dict(response.raw_headers).get(b"content-type", b"").partition(b";")[0]
    return media_type.startswith(b"text/") or media_type.endswith((b"json", b"xml"))
