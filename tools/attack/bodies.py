"""Attacks by the contents of bodies."""

import gzip
import io
import json
import zlib
from collections import Counter
from collections.abc import Iterator
from itertools import cycle

import numpy as np

from tests.api.hostile import HOSTILE, NET, write_options
from tests.api.hostile_files import FILES, NPY, OOGL, TEAPOT, save_array
from tools.attack.wire import (
    BUSY,
    DONE,
    Attack,
    Pieces,
    ask,
    get,
    post,
    post_head,
    repeat,
    send_storm,
)

PIECE = 1 << 18
HUGE = 1 << 31
GIGABYTE = 1 << 30


def _chunked(piece: bytes, times: int) -> Iterator[bytes]:
    """A body in chunks: one piece, repeated."""
    chunk = b"%x\r\n%b\r\n" % (len(piece), piece)
    yield from (chunk for _ in range(times))
    yield b"0\r\n\r\n"


def _endless(media_type: str, piece: bytes) -> Iterator[bytes]:
    """A gigabyte without a length."""
    yield post_head("/v1/mesh", "Transfer-Encoding: chunked", media_type=media_type)
    yield from _chunked(piece, GIGABYTE // PIECE)


async def declared(port: int) -> Counter[str]:
    head = post_head("/v1/mesh", f"Content-Length: {GIGABYTE}")
    lied = post_head("/v1/mesh", f"Content-Length: {10**30}", media_type="application/json")
    return await send_storm(port, cycle((head, lied)))


async def in_chunks(port: int) -> Counter[str]:
    kinds = ((NPY, b"\0"), ("application/json", b"[0,1"), (OOGL, b"BBP "), (TEAPOT, b"1,2\n"))

    def bodies() -> Iterator[Pieces]:
        return (_endless(kind, text * (PIECE // len(text))) for kind, text in kinds)

    alone = await send_storm(port, bodies(), together=1, seconds=6)
    return alone + await send_storm(port, repeat(bodies), seconds=6)


async def brackets(port: int) -> Counter[str]:
    nested = ("[" * 100_000, '{"a":' * 100_000, "[" * 100_000 + "]" * 100_000, "[{" * 50_000)
    bodies = [post("/v1/mesh", text.encode()) for text in nested]
    inside = [post("/v1/mesh", write_options(f'"x":{text}').encode()) for text in nested]
    return await send_storm(port, cycle(bodies + inside))


async def wide(port: int) -> Counter[str]:
    row = ",".join(["[0,0,0]"] * 900_000)
    keys = ",".join(f'"k{k}":{k}' for k in range(40_000))
    texts = (
        f'{{"surface":{{"control_net":[[{row}]]}}}}',
        f'{{"surface":{{"control_net":[[{"0," * 1_500_000}0]]}}}}',
        f'{{"surface":{{"control_net":{NET},"attributes":{{{keys}}}}}}}',
        write_options(keys),
        '{"surface":"' + "x" * (16 << 20) + '"}',
        '{"surface":{"name":"' + "\\u0000" * 150_000 + '"}}',
        "[" + "1e999999999," * 80_000 + "1]",
        write_options('"resolution":' + "1" * 1_000_000),
        " " * (32 << 20),
    )
    bodies = [post("/v1/mesh", text.encode()) for text in texts]
    return await send_storm(port, cycle(bodies), together=3, seconds=8)


async def bombs(port: int) -> Counter[str]:
    zeros = bytes(32 << 20)
    bombs = {"gzip": gzip.compress(zeros), "deflate": zlib.compress(zeros), "x-gzip": b"\x1f\x8b"}
    many = {"gzip, gzip, gzip": bombs["gzip"], "br": b"x", "zstd": b"(\xb5/\xfd", "": b"{}"}
    sent = [
        post("/v1/mesh", body, f"Content-Encoding: {coding}", media_type=kind)
        for coding, body in (bombs | many).items()
        for kind in ("application/json", NPY, TEAPOT)
    ]
    return await send_storm(port, cycle(sent))


async def nothing_finite(port: int) -> Counter[str]:
    """All hostile bodies of the tests; each must get exactly the status that the tests expect."""
    answers: Counter[str] = Counter()
    for case in HOSTILE:
        got = await ask(port, post("/v1/mesh", case.build()))
        answers[_as_foreseen(got, case.status)] += 1
    for file in FILES:
        sent = post(f"/v1/mesh?{file.query}", file.build(), media_type=file.media_type)
        answers[_as_foreseen(await ask(port, sent), file.status)] += 1
    return answers


def _as_foreseen(got: str, status: int) -> str:
    # A body may be too long for the server; the tests without a server do not see that.
    as_it_is = got.startswith(str(status)) or got in (
        "413 body_too_large",
        "422 result_too_large",
        "429 busy",
    )
    return got if as_it_is else f"{got} for {status}"


def _document(**values: object) -> bytes:
    surface = {"control_net": json.loads(NET)}
    return json.dumps({"surface": surface} | values).encode()


def _huge() -> Iterator[Pieces]:
    for number in (HUGE, HUGE + 1, 1 << 63, 1 << 64, 10**30, 1e300, -HUGE, 0.1, 1e-300, 5e-324):
        names = ["resolution", "isocurves", "wire_sides"]
        # Large budgets are valid: then the service computes the mesh, for some seconds.
        names += ["max_triangles", "max_bytes"] if number in (HUGE, 1 << 64, 0.1, -HUGE) else []
        for name in names:
            yield post("/v1/mesh", _document(**{name: number}))
            yield post("/v1/estimate", _document(**{name: number}))
            yield get(f"/v1/surfaces/utah-teapot/mesh.glb?{name}={number}")
        for name in ("tolerance", "relative_tolerance", "angle_tolerance", "crease_angle"):
            yield post("/v1/mesh", _document(**{name: number}))
            yield get(f"/v1/surfaces/utah-teapot/mesh.glb?{name}={number}")
        spline = {"type": "bspline", "control_net": json.loads(NET), "degree": number}
        yield post("/v1/mesh", json.dumps({"surface": spline}).encode())
        elevated = [{"op": "elevate", "degree": [number, number]}]
        yield post("/v1/convert", _document(operations=elevated))
        yield post("/v1/points", _document(uv=[[0, 0]], patch=number))
        yield post("/v1/points", _document(uv=[[0, 0]], derivatives=number))
        curve = {"control_points": [[0, 0], [1, 1]]}
        yield post("/v1/curve", json.dumps({"curve": curve, "resolution": number}).encode())
    for text, media_type in (
        (b"BEZ992147483648", OOGL),
        (b"BBP" + b" 1" * 100, OOGL),
        (b"2147483648\n1,2\n", TEAPOT),
        (b"1\n1,2,3,2147483648\n3\n0,0,0\n", TEAPOT),
        (_shape("(2147483648, 2147483648, 3)"), NPY),
        (_shape("(2147483648, 0, 3)"), NPY),
        (_shape("(1, 2147483648, 3)"), NPY),
        (save_array(np.zeros((0, 1 << 31, 3))), NPY),
    ):
        yield post("/v1/mesh", text, media_type=media_type)


def _shape(text: str) -> bytes:
    """A .npy file whose header states this shape."""
    file = io.BytesIO()
    np.save(file, np.zeros((2, 2, 3)))
    return file.getvalue().replace(b"(2, 2, 3)", text.encode())


async def huge_numbers(port: int) -> Counter[str]:
    return await send_storm(port, _huge(), seconds=60)


async def keys(port: int) -> Counter[str]:
    """Keys that collide in a hash table without a secret, and repeated keys."""
    equal = ",".join(f'"{k * (2**61 - 1)}":1' for k in range(20_000))
    repeated = ",".join(['"resolution":1'] * 20_000)
    named = ",".join(f'"{k * (2**61 - 1)}":[[[0]]]' for k in range(15_000))
    texts = (
        write_options(equal),
        write_options(repeated),
        f'{{"surface":{{"control_net":{NET},"attributes":{{{named}}}}}}}',
    )
    return await send_storm(port, cycle([post("/v1/mesh", text.encode()) for text in texts]))


BODIES = (
    Attack("a body of 1 GB, declared", declared, "413 body_too_large|400 malformed_request"),
    Attack(
        "a body of 1 GB, in chunks",
        in_chunks,
        rf"413 body_too_large|422 (invalid_request|result_too_large)|{BUSY}",
    ),
    Attack(
        "100 000 nested brackets",
        brackets,
        rf"422 (invalid_request|result_too_large)|400 malformed_json|{BUSY}",
    ),
    Attack(
        "wide, sparse and long JSON",
        wide,
        rf"400 malformed_json|413 body_too_large|422 (invalid_request|result_too_large)|{BUSY}",
        parses=True,
    ),
    Attack("gzip bombs", bombs, "415 unsupported_media_type"),
    Attack("NaN everywhere: all hostile bodies", nothing_finite, r"4\d\d \w+", parses=True),
    Attack("2³¹ resolutions, degrees, counts", huge_numbers, rf"200|400 malformed_body|{DONE}"),
    Attack("hash-flooded and repeated keys", keys, rf"422 invalid_request|{BUSY}", parses=True),
)
