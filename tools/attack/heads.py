"""Attacks with the heads of requests, and with bytes that are not HTTP."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from itertools import cycle

from tests.server.test_protocol import AMBIGUOUS
from tools.attack.wire import (
    BUSY,
    Attack,
    Pieces,
    ask,
    get,
    open_connection,
    post,
    repeat,
    send_storm,
    summarize,
)

SMALL = b'{"surface":{"control_net":[[[0,0,0],[0,1,1]],[[1,0,1],[1,1,2]]]},"resolution":1}'


def _floods() -> Iterator[Pieces]:
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
    yield [chunked, b"0" * 16_384, *(b"0" * 16_384 for _ in range(64))]


async def floods(port: int) -> Counter[str]:
    return await send_storm(port, repeat(_floods))


PATHS = (
    "..", "%2e%2e", "%252e%252e", "../../../etc/passwd", "..%2f..%2f..%2fetc%2fpasswd",
    "..%252f..%252fetc%252fpasswd", "%c0%ae%c0%ae%c0%afetc", "..%5c..%5cwindows%5cwin.ini",
    "..\\..\\etc\\passwd", "%00", "saddle%00", "saddle%00.json", "%ff%fe", "%u002e%u002e",
    "\xe2\x80\xa5/etc", "%ef%bc%8f..%ef%bc%8fetc", "%2fetc%2fpasswd", "/etc/passwd", "con", "nul",
    "file:%2f%2f%2fetc%2fpasswd", "~root", "$HOME", "`id`", "%0d%0aSet-Cookie:x=y", "a" * 5000,
    "0" * 64, "0" * 63 + "/", "A" * 64, "\u0660" * 8, "%", "%zz", "." * 1000, "0" * 64 + "%2f..",
)  # fmt: skip


async def traversal(port: int) -> Counter[str]:
    addresses = [
        place.format(path)
        for place in (
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
    encoded = [url.encode("utf-8").decode("latin-1") for url in addresses]
    return await send_storm(
        port, cycle([get(a, method=m) for a in encoded for m in ("GET", "DELETE")])
    )


_TAIL = b"\r\nHost: x\r\nConnection: close\r\n"
_BODY = b"Content-Type: application/json\r\n"

MALFORMED = (
    *AMBIGUOUS.values(),
    b"GET / HTTP/1.1 extra" + _TAIL + b"\r\n",
    b"GET /\x00 HTTP/1.1" + _TAIL + b"\r\n",
    b"GET / HTTP/1.1" + _TAIL + b"bad header\r\n\r\n",
    b"GET / HTTP/1.1" + _TAIL + b"x\x00y: z\r\n\r\n",
    b"GET / HTTP/1.1" + _TAIL + b": y\r\n\r\n",
    b"G\xc3\x8bT / HTTP/1.1" + _TAIL + b"\r\n",
    b"\x00" * 2000,
    b"SSH-2.0-OpenSSH_9.6\r\n\r\n",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _BODY + b"Content-Length: -1\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _BODY + b"Content-Length: 1e3\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _BODY + b"Content-Length: 0x10\r\n\r\n{}",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _BODY + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    b"POST /v1/mesh HTTP/1.1" + _TAIL + _BODY + b"Transfer-Encoding: chunked\r\n\r\n-1\r\n",
)  # fmt: skip


async def malformed(port: int) -> Counter[str]:
    return await send_storm(port, cycle(MALFORMED))


_HIDDEN = b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n"
_SMUGGLED = b"0\r\n\r\n" + _HIDDEN

SMUGGLING = tuple(
    b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\n" + _BODY + fields + b"\r\n" + body
    for fields, body in (
        (b"Content-Length: %d\r\nTransfer-Encoding: chunked\r\n" % len(_SMUGGLED), _SMUGGLED),
        (b"Transfer-Encoding: chunked\r\nContent-Length: 4\r\n", _SMUGGLED),
        (b"Transfer-Encoding: xchunked\r\nContent-Length: 4\r\n", _SMUGGLED),
        (b"Transfer-Encoding: identity, chunked\r\nContent-Length: 4\r\n", _SMUGGLED),
        (b"Transfer-Encoding: chunked, identity\r\n", _SMUGGLED),
        (b"Transfer-Encoding:\x0bchunked\r\nContent-Length: 4\r\n", _SMUGGLED),
        (b"Transfer-Encoding : chunked\r\nContent-Length: 4\r\n", _SMUGGLED),
        (b"Content-Length: 0\r\nContent-Length: %d\r\n" % len(_HIDDEN), _HIDDEN),
        (b"Content-Length: %d\r\nContent-Length: 0\r\n" % len(_HIDDEN), _HIDDEN),
        (b"Content-Length: +0\r\n", _HIDDEN),
        (b"Content-Length: 0\n\nGET /health HTTP/1.1\r\n", b""),
        (b"X: y\nTransfer-Encoding: chunked\r\nContent-Length: 4\r\n", _SMUGGLED),
    )
)


async def smuggling(port: int) -> Counter[str]:
    """Requests with two lengths: the request that is hidden in the body must get no response."""
    answers: Counter[str] = Counter()
    for request in SMUGGLING * 4:
        seen = b""
        with suppress(TimeoutError, OSError):
            async with asyncio.timeout(2), open_connection(port) as (reader, writer):
                writer.write(request)
                while piece := await reader.read(1 << 16):
                    seen += piece
        answers["smuggled" if b'"ready"' in seen else summarize(seen, len(seen))] += 1
    return answers


METHODS = ("HEAD", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "PUT", "PATCH", "DELETE")


async def methods(port: int) -> Counter[str]:
    sent: list[Pieces] = []
    for url in ("/", "/health", "/v1/mesh", "/v1/surfaces/saddle/mesh.glb", "*", "/none"):
        sent += [get(url, method=method) for method in METHODS]
    sent.append(get("http://example.org/health"))
    sent.append(get("example.org:80", method="CONNECT"))
    return await send_storm(port, cycle(sent))


async def upgrades(port: int) -> Counter[str]:
    headers = (
        "Upgrade: {}",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Version: 13",
    )
    sent = [
        get("/health", headers[0].format(kind), *headers[1:]).replace(
            b": close", b": Upgrade, close"
        )
        for kind in ("websocket", "h2c", "TLS/1.0", "websocket, h2c")
    ]
    return await send_storm(port, cycle(sent))


async def long_lists(port: int) -> Counter[str]:
    """Headers that the service reads, of almost the largest length."""
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
    sent: list[Pieces] = [get(url, value) for value in values]
    sent += [get("/v1/mesh?format=json", value, method="POST") for value in values]
    sent += [get("/v1/mesh", value, "Origin: http://x", method="OPTIONS") for value in values]
    return await send_storm(port, cycle(sent))


async def slow_heads(port: int) -> Counter[str]:
    """Many connections that send a byte every 0.8 s."""
    head = get("/health")
    slowly = [bytes([byte]) for byte in head]
    tasks = (ask(port, slowly, seconds=40, pause=0.8) for _ in range(300))
    return Counter(await asyncio.gather(*tasks))


async def pipelines(port: int) -> Counter[str]:
    """Thousands of requests on a connection, whose responses are read only after 3 s."""
    kinds = (
        b"GET /health/live HTTP/1.1\r\nHost: x\r\n\r\n" * 5000,
        b"GET /v1/surfaces/utah-teapot/mesh.glb?resolution=16 HTTP/1.1\r\nHost: x\r\n\r\n" * 2000,
        b"".join(
            post("/v1/mesh?format=stl", SMALL).replace(b"Connection: close\r\n", b"")
            for _ in range(2000)
        ),
        b"GET /v1/surfaces/tea-service/mesh.json?resolution=%d HTTP/1.1\r\nHost: x\r\n\r\n"
        * 500
        % tuple(range(1, 501)),
    )
    done = await asyncio.gather(*(_pipeline(port, kind) for kind in kinds * 4))
    return sum(done, Counter())


async def _pipeline(port: int, requests: bytes) -> Counter[str]:
    """The first responses of many on one connection; does not wait for all."""
    answers: Counter[str] = Counter()
    with suppress(OSError, TimeoutError):
        async with asyncio.timeout(8), open_connection(port) as (reader, writer):
            writer.write(requests)
            await asyncio.sleep(3)
            async with asyncio.timeout(3):
                while piece := await reader.read(1 << 16):
                    for line in piece.split(b"HTTP/1.1 ")[1:]:
                        answers[line[:3].decode("latin-1")] += 1
    return answers or Counter({"closed": 1})


HEADS = (
    Attack("header floods: many, long, folded", floods, "431 head_too_large|400 malformed_request"),
    Attack(
        "path traversal in ids",
        traversal,
        r"404 (not_found|unknown_surface|unknown_suffix)|405 method_not_allowed"
        r"|400 malformed_request|422 invalid_request",
    ),
    Attack("malformed HTTP", malformed, "400 malformed_request|closed"),
    Attack("TE and CL smuggling", smuggling, "400 (malformed_request|malformed_json)|closed"),
    Attack(
        "HEAD, OPTIONS, TRACE, CONNECT floods",
        methods,
        "200|204|400 malformed_request|404|404 not_found|405|405 method_not_allowed",
    ),
    Attack("websocket and h2c upgrades", upgrades, "200"),
    Attack(
        "long lists in headers",
        long_lists,
        rf"200|400 (malformed_request|malformed_json)|405 method_not_allowed|406 not_acceptable"
        rf"|415 unsupported_media_type|431 head_too_large|{BUSY}",
    ),
    Attack("pipelining floods", pipelines, "200|429|503|431|closed"),
)

SLOW_HEADS = Attack("slow heads: 300 connections", slow_heads, "408 head_too_slow")
