"""The cache middleware sends cached responses, and passes all other requests on."""

import asyncio
from collections.abc import Mapping

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.api.cache_middleware import CacheMiddleware
from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CachedResponse, Subject
from service.api.computation import MAX_BUFFERED
from service.api.cors import Origins
from service.api.record import NO_ROUTE, SCOPE_ITEM, RequestRecord
from service.api.responses import CHUNK
from service.api.unread import UnreadBytes
from service.storage.address import open_store

PATH, QUERY = "/v1/surfaces/saddle/mesh.glb", b"engine=4"


def send_request(
    body: bytes = b"a body",
    method: str = "GET",
    headers: tuple[tuple[bytes, bytes], ...] = (),
    scope: Mapping[str, object] | None = None,
) -> tuple[list[Message], int]:
    """The messages of the response to a request, and the number of requests passed on, 0 or 1.

    `body` is in the cache, under `PATH` and `QUERY`.
    """
    cache, messages = ResponseCache(1 << 30), list[Message]()
    passed_scopes: list[Scope] = []
    entry = CachedResponse(Subject(f"{PATH}?engine=4", "saddle", "name", False), body, ())
    assert cache.put(entry, cache.generation)
    cache.add(entry, "gzip", b"packed")
    cache.alias(entry, PATH, QUERY, has_engine=True)
    record = RequestRecord(method, NO_ROUTE, "1", "1", "1")
    request = {
        "type": "http",
        "method": method,
        "path": PATH,
        "query_string": QUERY,
        SCOPE_ITEM: record,
    }

    async def record_scope(scope: Scope, _receive: Receive, _send: Send) -> None:
        passed_scopes.append(scope)

    async def send(message: Message) -> None:
        messages.append(message)

    async def receive() -> Message:
        raise AssertionError("a body was read")

    async def call_middleware() -> None:
        middleware = CacheMiddleware(
            record_scope,
            cache,
            open_store("memory://", 0),
            UnreadBytes(1 << 30, lambda: None),
            Origins(["*"]),
        )
        await middleware({**request, "headers": list(headers), **(scope or {})}, receive, send)

    asyncio.run(call_middleware())
    assert cache.hits == bool(messages) == (record.cache == "hit")
    return messages, len(passed_scopes)


def test_a_cached_response_is_two_messages() -> None:
    (start, body), passed_requests = send_request()
    assert (start["status"], body["body"], passed_requests) == (200, b"a body", 0)
    assert dict(start["headers"])[b"content-length"] == b"6"
    assert not body.get("more_body")


def test_the_response_to_head_has_no_body() -> None:
    (start, end), _ = send_request(method="HEAD")
    assert dict(start["headers"])[b"content-length"] == b"6"
    assert end == {"type": "http.response.body", "body": b""}


def test_a_long_body_is_sent_in_pieces() -> None:
    content = bytes(range(256)) * (5 * CHUNK // 512)  # 2.5 chunks
    (start, *pieces), _ = send_request(content)
    assert dict(start["headers"])[b"content-length"] == str(len(content)).encode()
    assert b"".join(piece["body"] for piece in pieces) == content
    assert max(len(piece["body"]) for piece in pieces) == CHUNK
    # The last of the four messages is empty.
    assert [bool(piece.get("more_body")) for piece in pieces] == [True] * 3 + [False]


def test_a_short_body_is_one_message_and_a_longer_body_two() -> None:
    """The service sends the second, empty message once a slow client has received the first."""
    for size, count in ((MAX_BUFFERED, 1), (MAX_BUFFERED + 1, 2), (CHUNK, 2)):
        (_, *pieces), _ = send_request(bytes(size))
        assert [bool(piece.get("more_body")) for piece in pieces] == [True] * (count - 1) + [False]
        assert sum(len(piece["body"]) for piece in pieces) == size


def test_repeated_headers_are_read_as_one_list() -> None:
    lines = ((b"accept-encoding", b"br"), (b"accept-encoding", b"gzip"))
    (start, body), _ = send_request(headers=lines)
    assert (dict(start["headers"])[b"content-encoding"], body["body"]) == (b"gzip", b"packed")
    tag = dict(start["headers"])[b"etag"]
    conditions = ((b"if-none-match", b'"x"'), (b"if-none-match", tag))
    (start, end), _ = send_request(headers=(*lines, *conditions))
    assert (start["status"], end["body"]) == (304, b"")


@pytest.mark.parametrize(
    ("headers", "scope"),
    [
        ((), {"method": "POST"}),
        ((), {"method": "DELETE"}),
        ((), {"path": "/v1/surfaces/saddle/mesh.stl"}),
        ((), {"query_string": b"engine=4&"}),
        (((b"accept-encoding", b"zstd"),), {}),
        # For a client that refuses a plain body, the route compresses even if this saves nothing.
        (((b"accept-encoding", b"gzip, identity;q=0"),), {}),
        (((b"accept-encoding", b"*;q=0"),), {}),
    ],
)
def test_requests_without_a_cached_response_are_passed_on(
    headers: tuple[tuple[bytes, bytes], ...], scope: dict[str, object]
) -> None:
    assert send_request(headers=headers, scope=scope) == ([], 1)
