"""Attacks with the heads of requests, and with bytes that are not HTTP."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from itertools import cycle

from tools.attack.wire import (
    BUSY,
    Attack,
    Pieces,
    build_get,
    build_post,
    open_connection,
    repeat_requests,
    send_request,
    send_requests,
    summarize,
)
from tools.hostile.heads import AMBIGUOUS

SMALL_BODY = b'{"surface":{"control_net":[[[0,0,0],[0,1,1]],[[1,0,1],[1,1,2]]]},"resolution":1}'


def _list_header_floods() -> Iterator[Pieces]:
    """Requests with endless or folded headers, or endless targets, heads of chunks or trailers."""
    start = b"GET /health HTTP/1.1\r\nHost: x\r\n"
    yield [start, *(b"x%d: y\r\n" % k * 100 for k in range(1000))]
    yield [start, *(b"x: y\r\n" * 10_000 for _ in range(50))]
    yield [start + b"x: ", *(b"y" * 16_384 for _ in range(64))]
    yield [start, *(b"y" * 16_384 for _ in range(64))]
    yield [start + b"x: y\r\n", *(b" continued\r\n" * 1000 for _ in range(64))]
    yield [b"GET /", *(b"a" * 16_384 for _ in range(64))]
    yield [b"GET /?", *(b"a=1&" * 4096 for _ in range(64))]
    yield [b"A" * 16_384 for _ in range(64)]
    yield [start + b"Cookie: ", *(b"a=b; " * 4000 for _ in range(64))]
    chunked = b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n"
    chunked += b"Content-Type: application/json\r\n\r\n"
    yield [chunked, b"1;", *(b"e=1;" * 4096 for _ in range(64))]
    yield [chunked, b"1\r\n{\r\n0\r\n", *(b"t%d: x\r\n" % k * 500 for k in range(64))]
    yield [chunked, *(b"0" * 16_384 for _ in range(65))]


async def send_header_floods(port: int) -> Counter[str]:
    """Sends requests with too long heads, heads of chunks, or trailers, again and again."""
    return await send_requests(port, repeat_requests(_list_header_floods))


PATHS = (
    "..", "%2e%2e", "%252e%252e", "../../../etc/passwd", "..%2f..%2f..%2fetc%2fpasswd",
    "..%252f..%252fetc%252fpasswd", "%c0%ae%c0%ae%c0%afetc", "..%5c..%5cwindows%5cwin.ini",
    "..\\..\\etc\\passwd", "%00", "saddle%00", "saddle%00.json", "%ff%fe", "%u002e%u002e",
    "\u2025/etc", "%ef%bc%8f..%ef%bc%8fetc", "%2fetc%2fpasswd", "/etc/passwd", "con", "nul",
    "file:%2f%2f%2fetc%2fpasswd", "~root", "$HOME", "`id`", "%0d%0aSet-Cookie:x=y", "a" * 5000,
    "0" * 64, "0" * 63 + "/", "A" * 64, "\u0660" * 8, "%", "%zz", "." * 1000, "0" * 64 + "%2f..",
)  # fmt: skip


async def send_traversal_paths(port: int) -> Counter[str]:
    """Sends requests for paths that leave the folder of the service, or are unusual otherwise."""
    unencoded_urls = [
        pattern.format(path)
        for pattern in (
            "/v1/surfaces/{}",
            "/v1/surfaces/{}/mesh.glb",
            "/v1/surfaces/saddle/mesh.{}",
            "/docs/{}",
            "/page/{}",
            "/{}",
            "/v1/surfaces/saddle/mesh.glb/{}",
        )
        for path in PATHS
    ]
    # `build_get` encodes URLs as Latin-1; decoded like this, they are sent as UTF-8.
    urls = [url.encode("utf-8").decode("latin-1") for url in unencoded_urls]
    return await send_requests(
        port, cycle([build_get(a, method=m) for a in urls for m in ("GET", "DELETE")])
    )


_TAIL = b"\r\nHost: x\r\nConnection: close\r\n"
_JSON_HEADER = b"Content-Type: application/json\r\n"

MALFORMED_REQUESTS = (
    *AMBIGUOUS.values(),  # mostly requests that two programs could read differently
    b"GET / HTTP/1.1 extra" + _TAIL + b"\r\n",
    b"GET /\x00 HTTP/1.1" + _TAIL + b"\r\n",
    b"GET / HTTP/1.1" + _TAIL + b"bad header\r\n\r\n",
    b"GET / HTTP/1.1" + _TAIL + b"x\x00y: z\r\n\r\n",
    b"GET / HTTP/1.1" + _TAIL + b": y\r\n\r\n",
    b"G\xc3\x8bT / HTTP/1.1" + _TAIL + b"\r\n",
    b"\x00" * 2000,
    b"SSH-2.0-OpenSSH_9.6\r\n\r\n",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _JSON_HEADER + b"Content-Length: -1\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _JSON_HEADER + b"Content-Length: 1e3\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _JSON_HEADER + b"Content-Length: 0x10\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _JSON_HEADER + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _JSON_HEADER + b"Transfer-Encoding: chunked\r\n\r\n-1\r\n",
)  # fmt: skip


async def send_malformed(port: int) -> Counter[str]:
    """Sends requests that are not valid HTTP/1.1."""
    return await send_requests(port, cycle(MALFORMED_REQUESTS))


_HIDDEN_REQUEST = b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n"
_SMUGGLED_BODY = b"0\r\n\r\n" + _HIDDEN_REQUEST

SMUGGLING_REQUESTS = tuple(
    b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\n" + _JSON_HEADER + fields + b"\r\n" + body
    for fields, body in (
        (
            b"Content-Length: %d\r\nTransfer-Encoding: chunked\r\n" % len(_SMUGGLED_BODY),
            _SMUGGLED_BODY,
        ),
        (b"Transfer-Encoding: chunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
        (b"Transfer-Encoding: xchunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
        (b"Transfer-Encoding: identity, chunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
        (b"Transfer-Encoding: chunked, identity\r\n", _SMUGGLED_BODY),
        (b"Transfer-Encoding:\x0bchunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
        (b"Transfer-Encoding : chunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
        (b"Content-Length: 0\r\nContent-Length: %d\r\n" % len(_HIDDEN_REQUEST), _HIDDEN_REQUEST),
        (b"Content-Length: %d\r\nContent-Length: 0\r\n" % len(_HIDDEN_REQUEST), _HIDDEN_REQUEST),
        (b"Content-Length: +0\r\n", _HIDDEN_REQUEST),
        (b"Content-Length: 0\n\nGET /health HTTP/1.1\r\n", b""),
        (b"X: y\nTransfer-Encoding: chunked\r\nContent-Length: 4\r\n", _SMUGGLED_BODY),
    )
)


async def send_smuggled_requests(port: int) -> Counter[str]:
    """Sends requests of ambiguous length; the request hidden in each must get no response."""
    responses: Counter[str] = Counter()
    for request in SMUGGLING_REQUESTS * 4:
        received = b""
        with suppress(TimeoutError, OSError):
            async with asyncio.timeout(2), open_connection(port) as (reader, writer):
                writer.write(request)
                while piece := await reader.read(1 << 16):
                    received += piece
        # Only the response to the hidden request, GET /health, contains "ready".
        responses["smuggled" if b'"ready"' in received else summarize(received, len(received))] += 1
    return responses


METHODS = ("HEAD", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "PUT", "PATCH", "DELETE")


async def send_unusual_methods(port: int) -> Counter[str]:
    """Sends requests with methods other than GET and POST, or with a host in the request line."""
    requests: list[Pieces] = []
    for url in ("/", "/health", "/v1/mesh", "/v1/surfaces/saddle/mesh.glb", "*", "/none"):
        requests += [build_get(url, method=method) for method in METHODS]
    requests.append(build_get("http://example.org/health"))
    requests.append(build_get("example.org:80", method="CONNECT"))
    return await send_requests(port, cycle(requests))


async def send_upgrades(port: int) -> Counter[str]:
    """Asks the service to change to another protocol, which it must ignore."""
    headers = (
        "Upgrade: {}",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Version: 13",
    )
    requests = [
        build_get("/health", headers[0].format(kind), *headers[1:]).replace(
            b": close", b": Upgrade, close"
        )
        for kind in ("websocket", "h2c", "TLS/1.0", "websocket, h2c")
    ]
    return await send_requests(port, cycle(requests))


async def send_long_lists(port: int) -> Counter[str]:
    """Sends headers of almost the largest length, mostly those that the service reads."""
    url = "/v1/surfaces/saddle/mesh.glb?resolution=2"
    values = (
        "Accept: " + ",".join(["a/b;q=0.5"] * 6000),
        "Accept: " + "*/*;q=0.0001," * 4500,
        "Accept-Encoding: " + ",".join(f"x{k}" for k in range(9000)),
        "Accept-Encoding: " + "identity;q=0, " * 4000,
        "If-None-Match: " + ",".join([f'"{k}"' for k in range(8000)]),
        "If-None-Match: " + '"' * 60_000,
        "If-None-Match: " + "W/" * 30_000,
        "Range: bytes=" + ",".join(f"{k}-{k}" for k in range(5000)),
        "X-Forwarded-For: " + ",".join(["10.0.0.1"] * 6000),
        "Forwarded: " + "for=1;" * 9000,
        "traceparent: 00-" + "f" * 60_000,
        "tracestate: " + "a=b," * 15_000,
        "Authorization: Bearer " + "x" * 60_000,
        "Content-Type: " + "a/b; " * 11_000,
        'Content-Type: text/x-teapot; charset="' + "\\" * 60_000,
        "Access-Control-Request-Headers: " + "x," * 30_000,
        "Cookie: " + "a=b; " * 12_000,
    )
    requests: list[Pieces] = [build_get(url, value) for value in values]
    requests += [build_get("/v1/mesh?format=json", value, method="POST") for value in values]
    requests += [
        build_get("/v1/mesh", value, "Origin: http://x", method="OPTIONS") for value in values
    ]
    return await send_requests(port, cycle(requests))


async def send_slow_heads(port: int) -> Counter[str]:
    """Opens 300 connections, each of which sends one byte of a head every 0.8 s."""
    head = build_get("/health")
    pieces = [bytes([byte]) for byte in head]
    tasks = (send_request(port, pieces, seconds=40, pause=0.8) for _ in range(300))
    return Counter(await asyncio.gather(*tasks))


async def send_pipelines(port: int) -> Counter[str]:
    """Sends 500 to 5000 requests on each of 16 connections; reads responses only after 3 s."""
    kinds = (
        b"GET /health/live HTTP/1.1\r\nHost: x\r\n\r\n" * 5000,
        b"GET /v1/surfaces/utah-teapot/mesh.glb?resolution=16 HTTP/1.1\r\nHost: x\r\n\r\n" * 2000,
        b"".join(
            build_post("/v1/mesh?format=stl", SMALL_BODY).replace(b"Connection: close\r\n", b"")
            for _ in range(2000)
        ),
        b"GET /v1/surfaces/tea-service/mesh.json?resolution=%d HTTP/1.1\r\nHost: x\r\n\r\n"
        * 500
        % tuple(range(1, 501)),
    )
    counts = await asyncio.gather(*(_send_pipeline(port, kind) for kind in kinds * 4))
    return sum(counts, Counter())


async def _send_pipeline(port: int, requests: bytes) -> Counter[str]:
    """Counts the responses that arrive within 3 s, after not reading for 3 s."""
    responses: Counter[str] = Counter()
    with suppress(OSError, TimeoutError):
        async with asyncio.timeout(8), open_connection(port) as (reader, writer):
            writer.write(requests)
            await asyncio.sleep(3)
            async with asyncio.timeout(3):
                while piece := await reader.read(1 << 16):
                    for line in piece.split(b"HTTP/1.1 ")[1:]:
                        responses[line[:3].decode("latin-1")] += 1
    return responses or Counter({"closed": 1})


HEADS = (
    Attack(
        "header floods: many, long, folded",
        send_header_floods,
        "431 head_too_large|400 malformed_request",
    ),
    Attack(
        "path traversal in ids",
        send_traversal_paths,
        r"404 (not_found|unknown_surface|unknown_suffix)|405 method_not_allowed"
        r"|400 malformed_request|422 invalid_request",
    ),
    Attack("malformed HTTP", send_malformed, "400 malformed_request|closed"),
    Attack(
        "TE and CL smuggling",
        send_smuggled_requests,
        "400 (malformed_request|malformed_json)|closed",
    ),
    Attack(
        "HEAD, OPTIONS, TRACE, CONNECT floods",
        send_unusual_methods,
        "200|204|400 malformed_request|404|404 not_found|405|405 method_not_allowed",
    ),
    Attack("websocket and h2c upgrades", send_upgrades, "200"),
    Attack(
        "long lists in headers",
        send_long_lists,
        rf"200|400 (malformed_request|malformed_json)|405 method_not_allowed|406 not_acceptable"
        rf"|415 unsupported_media_type|431 head_too_large|{BUSY}",
    ),
    Attack("pipelining floods", send_pipelines, "200|429|503|431|closed"),
)

SLOW_HEADS = Attack("slow heads: 300 connections", send_slow_heads, "408 head_too_slow")
