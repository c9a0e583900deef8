"""The first inputs of the fuzzer: valid requests, and invalid requests from the tests."""

import json
from collections.abc import Callable, Iterator
from itertools import chain

from service.api.guard.keys import format_entry
from service.api.openapi.parameters import REQUESTS
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.pipeline.mesh import render
from service.storage.canonical import canonical_content
from service.surface.examples.catalogue import EXAMPLES, find
from tools.hostile.calls import CALLS
from tools.hostile.files import (
    FILES,
    GEOMDL,
    GEOMDL_SQUARE,
    NPY,
    OBJ,
    OBJ_SQUARE,
    OOGL,
    TEAPOT,
    build_net,
    save_array,
)

MAX_INPUT_BYTES = 1 << 16
"""The largest number of bytes of an input. Longer inputs are slower and find no other faults."""

TEAPOT_TEXT = b"2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"

OBJ_SPLINE = (
    b"v 0 0 0\nv 1 0 0 .5\nv 2 0 1\nv 0 1 0\nv 1 1 0\nv 2 1 1 2\nvp 0 0\nvp 1 0\nvp 1 1\nvp 0 1\n"
    b"cstype bezier\ndeg 1\ncurv2 1 2 3 -1 1\nparm u 0 1 2 3 4\nend\ncstype rat bspline\ndeg 2 1\n"
    b"g both\nsurf 0 1 0 1 1/1/1 2/2 3 4 \\\n5 6\nparm u 0 0 0 1 1 1\nparm v 0 0 1 1\n"
    b"trim 0 4 1\nend\nsurf 0 .5 0 1 1 2 3 4 5 6\nparm u 0 0 0 1 1 1\nparm v 0 0 1 1\nend\n"
)
"""A trimmed surface, and a part of a surface."""

VALID_BODIES = tuple(
    json.dumps(example["value"]).encode()
    for examples in REQUESTS.values()
    for example in examples.values()
)
"""The examples of the OpenAPI document: all kinds of surfaces, and all kinds of operations."""


def list_bodies() -> Iterator[bytes]:
    """Bodies of requests in JSON."""
    yield from VALID_BODIES
    for case in chain.from_iterable(CALLS.values()):
        # Bodies that `build_long_case` names `long: …` have megabytes, too much for an input.
        if not case.name.startswith("long"):
            yield case.build()


def list_files(media_type: str) -> Iterator[bytes]:
    """Files of one media type."""
    yield from (case.build() for case in FILES if case.media_type == media_type)
    if media_type == NPY:
        yield from (
            save_array(build_net()),
            save_array(build_net(dimension=4)),
            save_array(build_net()[None].astype(">f4")),
        )
    elif media_type == TEAPOT:
        yield TEAPOT_TEXT
    elif media_type == OBJ:
        yield from (OBJ_SQUARE, OBJ_SPLINE)
    elif media_type == GEOMDL:
        yield GEOMDL_SQUARE
    elif media_type == OOGL:
        for name in EXAMPLES:
            options = EncodeOptions(oogl="bez")
            try:
                yield render(find(name).surface(), MeshOptions(), BY_NAME["oogl"], options)
            except SurfaceError:
                continue  # tubes and ribbons have no patches


def list_contents() -> Iterator[bytes]:
    """Contents of stored surfaces."""
    for name in EXAMPLES:
        yield canonical_content(find(name).surface())


def list_queries() -> Iterator[bytes]:
    """Queries of URLs."""
    yield b"resolution=16,32&faces=quads&overlays=control_net,boundary&engine=2&normals=false"
    yield b"tolerance=1e-3&angle_tolerance=.2&max_triangles=2000&two_sided=true&isocurves=4"
    yield b"type=bspline&degree=3,2&knots=clamped,periodic&up=z&name=sail&format=glb"
    yield b"quantize=true&compression=meshopt&wires=tubes&wire_width=0.02&method=de_casteljau"
    yield from (case.query.encode() for case in FILES if case.query)


def list_headers() -> Iterator[bytes]:
    """A value of each header in `list_requests`, in their order."""
    yield from (
        b"model/gltf-binary;q=0.5, application/json;q=0.1, */*;q=0",
        b'W/"x", "3q2-7wEAAAAAAAAAAAAAAA", *',
        b"gzip;q=1.0, zstd, *;q=0, identity;q=0.001",
        b"bytes=0-1,-5",
        b"00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        b"rojo=00f067aa0ba902b7,congo=t61rcWkgMzE",
        b"Bearer sfk_" + b"0123456789abcdef" * 4,
        b"10.0.0.1, ::1, 192.168.0.1:80, unknown",
        b'text/x-teapot; charset="utf-8"; x=y',
        b"application/json;charset=utf-8",
    )


def list_keys() -> Iterator[bytes]:
    """Files of API keys."""
    line = format_entry("fuzzer", "sfk_" + "0" * 64).encode()
    yield from (line, line + b"\n# old\n\n" + line.upper(), b"a:", b":" + b"0" * 64)


def list_signed_queries() -> Iterator[bytes]:
    """Queries with invalid signatures."""
    signature = b"expires=1999999999&signature=" + b"A" * 43
    yield from (
        signature,
        b"resolution=2&" + signature,
        signature + b"&" + signature,
        b"%65xpires=1&signature=%41",
    )


def list_requests() -> Iterator[bytes]:
    """Bytes of connections: one request, or several requests."""
    names = (
        b"Accept", b"If-None-Match", b"Accept-Encoding", b"Range", b"traceparent", b"tracestate",
        b"Authorization", b"X-Forwarded-For", b"Content-Type", b"X-Forwarded-Proto",
    )  # fmt: skip
    start = b"GET /v1/surfaces/saddle/mesh.glb?resolution=2 HTTP/1.1\r\nHost: x\r\n"
    for name, value in zip(names, list_headers(), strict=True):
        yield start + name + b": " + value + b"\r\n\r\n"
    key = b"Authorization: Bearer sfk_" + b"0123456789abcdef" * 4 + b"\r\n"
    for path in (
        b"/v1/surfaces/%2e%2e%2fetc/mesh.json", b"/v1/surfaces/" + b"0" * 64, b"//", b"/docs/../",
        b"*", b"http://x/health", b"/v1/surfaces/%00/mesh.%c0%af", b"/page/..%5c", b"/metrics",
        b"/v1/surfaces/saddle/mesh.glb?engine=2&expires=1&signature=AA&key=1",
    ):  # fmt: skip
        yield b"GET " + path + b" HTTP/1.1\r\nHost: x\r\n\r\n"
    for body in VALID_BODIES[:3]:
        head = b"POST /v1/mesh HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n" + key
        yield head + b"Content-Length: %d\r\n\r\n" % len(body) + body
        yield head + b"Transfer-Encoding: chunked\r\n\r\n%x;e=1\r\n%b\r\n0\r\nT: 1\r\n\r\n" % (
            len(body),
            body,
        )
    yield b"OPTIONS * HTTP/1.1\r\nHost: x\r\n\r\nHEAD /health HTTP/1.0\r\n\r\n"
    for lines in (
        (b"OPTIONS /v1/mesh", b"Origin: http://x", b"Access-Control-Request-Method: POST"),
        (b"GET /health", b"Upgrade: websocket", b"Connection: Upgrade", b"Sec-WebSocket-Key: x"),
        (b"PUT /health", b"Expect: 100-continue", b"Content-Length: 1", b"Transfer-Encoding: x"),
    ):
        yield b"\r\n".join((lines[0] + b" HTTP/1.1", *lines[1:], b"", b""))


SEEDS: dict[str, Callable[[], Iterator[bytes]]] = {
    "json": list_bodies,
    "npy": lambda: list_files(NPY),
    "oogl": lambda: list_files(OOGL),
    "teapot": lambda: list_files(TEAPOT),
    "obj": lambda: list_files(OBJ),
    "geomdl": lambda: list_files(GEOMDL),
    "query": list_queries,
    "content": list_contents,
    "header": list_headers,
    "keys": list_keys,
    "signed": list_signed_queries,
    "protocol": list_requests,
}
"""Functions that return the first inputs, by name of the target."""
