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
