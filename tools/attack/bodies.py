"""Attacks with the contents of bodies: too long, too deep, compressed, with invalid numbers."""

import gzip
import io
import json
import zlib
from collections import Counter
from collections.abc import Iterator
from itertools import cycle

import numpy as np

from tools.attack.wire import (
    BUSY,
    DONE,
    Attack,
    Pieces,
    build_get,
    build_post,
    build_post_head,
    repeat_requests,
    send_request,
    send_requests,
)
from tools.hostile.files import FILES, NPY, OOGL, TEAPOT, save_array
from tools.hostile.requests import HOSTILE, NET, write_options

PIECE_BYTES = 1 << 18
TWO_TO_31 = 1 << 31
GIBIBYTE = 1 << 30
LINES = "application/x-ndjson"


def _list_chunks(piece: bytes, times: int) -> Iterator[bytes]:
    """The chunks of a body that consists of one piece, repeated `times` times."""
    chunk = b"%x\r\n%b\r\n" % (len(piece), piece)
    yield from (chunk for _ in range(times))
    yield b"0\r\n\r\n"


def _list_gibibyte(media_type: str, piece: bytes, url: str = "/v1/mesh") -> Iterator[bytes]:
    """The pieces of a request whose body of 1 GiB has no declared length."""
    yield build_post_head(url, "Transfer-Encoding: chunked", media_type=media_type)
    yield from _list_chunks(piece, GIBIBYTE // PIECE_BYTES)


async def send_declared_length(port: int) -> Counter[str]:
    """Sends heads that declare bodies of 1 GiB, and of 10^30 bytes."""
    head = build_post_head("/v1/mesh", f"Content-Length: {GIBIBYTE}")
    impossible_head = build_post_head(
        "/v1/mesh", f"Content-Length: {10**30}", media_type="application/json"
    )
    return await send_requests(port, cycle((head, impossible_head)))


async def send_in_chunks(port: int) -> Counter[str]:
    """Sends bodies of 1 GiB in chunks, alone and at once."""
    kinds = ((NPY, b"\0"), ("application/json", b"[0,1"), (OOGL, b"BBP "), (TEAPOT, b"1,2\n"))

    def bodies() -> Iterator[Pieces]:
        return (_list_gibibyte(kind, text * (PIECE_BYTES // len(text))) for kind, text in kinds)

    first_responses = await send_requests(port, bodies(), together=1, seconds=6)
    return first_responses + await send_requests(port, repeat_requests(bodies), seconds=6)


async def send_endless_lines(port: int) -> Counter[str]:
    """Sends jobs of 1 GiB of lines: one line that does not end, empty lines, and false parts."""
    part = b'{"path":"/v1/surfaces/saddle/mesh.glb?resolution=0"}\n'
    texts = (b"[", b'"', b'{"path":"', b"\n", part)

    def jobs() -> Iterator[Pieces]:
        pieces = (text * (PIECE_BYTES // len(text)) for text in texts)
        return (_list_gibibyte(LINES, piece, "/v1/jobs") for piece in pieces)

    return await send_requests(port, repeat_requests(jobs), seconds=6)


async def send_nested_brackets(port: int) -> Counter[str]:
    """Sends JSON that is nested 100 000 levels deep."""
    texts = ("[" * 100_000, '{"a":' * 100_000, "[" * 100_000 + "]" * 100_000, "[{" * 50_000)
    bodies = [build_post("/v1/mesh", text.encode()) for text in texts]
    bodies_with_surface = [
        build_post("/v1/mesh", write_options(f'"x":{text}').encode()) for text in texts
    ]
    return await send_requests(port, cycle(bodies + bodies_with_surface))


async def send_long_json(port: int) -> Counter[str]:
    """Sends JSON with very long lists, objects, texts and numbers."""
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
    bodies = [build_post("/v1/mesh", text.encode()) for text in texts]
    return await send_requests(port, cycle(bodies), together=3, seconds=8)


async def send_bombs(port: int) -> Counter[str]:
    """Sends compressed bodies of 32 MiB of zeros, and bodies with other content codings."""
    zeros = bytes(32 << 20)
    bombs = {"gzip": gzip.compress(zeros), "deflate": zlib.compress(zeros)}
    other_bodies = {
        "x-gzip": b"\x1f\x8b",
        "gzip, gzip, gzip": bombs["gzip"],
        "br": b"x",
        "zstd": b"(\xb5/\xfd",
        "": b"{}",
    }
    requests = [
        build_post("/v1/mesh", body, f"Content-Encoding: {coding}", media_type=kind)
        for coding, body in (bombs | other_bodies).items()
        for kind in ("application/json", NPY, TEAPOT)
    ]
    return await send_requests(port, cycle(requests))


async def send_hostile_bodies(port: int) -> Counter[str]:
    """Sends all hostile bodies of the tests; each must get the status that the tests expect."""
    responses: Counter[str] = Counter()
    for case in HOSTILE:
        response = await send_request(port, build_post("/v1/mesh", case.build()))
        responses[_compare_status(response, case.status)] += 1
    for file in FILES:
        request = build_post(f"/v1/mesh?{file.query}", file.build(), media_type=file.media_type)
        responses[_compare_status(await send_request(port, request), file.status)] += 1
    return responses


def _compare_status(response: str, status: int) -> str:
    """The response, with the expected status added if its own status is another."""
    # In the tests no server refuses bodies by their declared length, the service is never busy, and
    # its memory is not as small as that of the attacked service.
    is_expected = response.startswith(str(status)) or response in (
        "413 body_too_large",
        "422 result_too_large",
        "429 busy",
    )
    return response if is_expected else f"{response} for {status}"


def _build_document(**values: object) -> bytes:
    """The JSON body of a request with a valid surface and these fields."""
    surface = {"control_net": json.loads(NET)}
    return json.dumps({"surface": surface} | values).encode()


def _list_huge_numbers() -> Iterator[Pieces]:
    """Requests in which one number is extremely large, extremely small, or no integer."""
    for number in (
        TWO_TO_31,
        TWO_TO_31 + 1,
        1 << 63,
        1 << 64,
        10**30,
        1e300,
        -TWO_TO_31,
        0.1,
        1e-300,
        5e-324,
    ):
        names = ["resolution", "isocurves", "wire_sides"]
        # Large budgets are valid, and the service then computes a mesh for some seconds: therefore
        # only some of the numbers are sent as budgets.
        if number in (TWO_TO_31, 1 << 64, 0.1, -TWO_TO_31):
            names += ["max_triangles", "max_bytes"]
        for name in names:
            yield build_post("/v1/mesh", _build_document(**{name: number}))
            yield build_post("/v1/estimate", _build_document(**{name: number}))
            yield build_get(f"/v1/surfaces/utah-teapot/mesh.glb?{name}={number}")
        for name in ("tolerance", "relative_tolerance", "angle_tolerance", "crease_angle"):
            yield build_post("/v1/mesh", _build_document(**{name: number}))
            yield build_get(f"/v1/surfaces/utah-teapot/mesh.glb?{name}={number}")
        spline = {"type": "bspline", "control_net": json.loads(NET), "degree": number}
        yield build_post("/v1/mesh", json.dumps({"surface": spline}).encode())
        elevated = [{"op": "elevate", "degree": [number, number]}]
        yield build_post("/v1/convert", _build_document(operations=elevated))
        yield build_post("/v1/points", _build_document(uv=[[0, 0]], patch=number))
        yield build_post("/v1/points", _build_document(uv=[[0, 0]], derivatives=number))
        curve = {"control_points": [[0, 0], [1, 1]]}
        yield build_post("/v1/curve", json.dumps({"curve": curve, "resolution": number}).encode())
    for text, media_type in (
        (b"BEZ99%d" % TWO_TO_31, OOGL),  # degrees 9 and 9, points of 2^31 coordinates
        (b"BBP" + b" 1" * 100, OOGL),  # a patch has 48 numbers: two patches, and a part of one
        (b"2147483648\n1,2\n", TEAPOT),
        (b"1\n1,2,3,2147483648\n3\n0,0,0\n", TEAPOT),
        (_build_npy("(2147483648, 2147483648, 3)"), NPY),
        (_build_npy("(2147483648, 0, 3)"), NPY),
        (_build_npy("(1, 2147483648, 3)"), NPY),
        (save_array(np.zeros((0, TWO_TO_31, 3))), NPY),
    ):
        yield build_post("/v1/mesh", text, media_type=media_type)


def _build_npy(text: str) -> bytes:
    """A .npy file with this shape in its header, but the data of another shape."""
    file = io.BytesIO()
    np.save(file, np.zeros((2, 2, 3)))
    return file.getvalue().replace(b"(2, 2, 3)", text.encode())


async def send_huge_numbers(port: int) -> Counter[str]:
    """Sends requests with extreme numbers in options, degrees and the heads of files."""
    return await send_requests(port, _list_huge_numbers(), seconds=60)


async def send_colliding_keys(port: int) -> Counter[str]:
    """Sends keys that would have equal hashes as integers in Python, and repeated keys."""
    # The hash of an integer is its remainder modulo 2^61 - 1.
    colliding_keys = ",".join(f'"{k * (2**61 - 1)}":1' for k in range(20_000))
    repeated_keys = ",".join(['"resolution":1'] * 20_000)
    attributes = ",".join(f'"{k * (2**61 - 1)}":[[[0]]]' for k in range(15_000))
    texts = (
        write_options(colliding_keys),
        write_options(repeated_keys),
        f'{{"surface":{{"control_net":{NET},"attributes":{{{attributes}}}}}}}',
    )
    return await send_requests(
        port, cycle([build_post("/v1/mesh", text.encode()) for text in texts])
    )


BODIES = (
    Attack(
        "a body of 1 GB, declared", send_declared_length, "413 body_too_large|400 malformed_request"
    ),
    Attack(
        "a body of 1 GB, in chunks",
        send_in_chunks,
        rf"413 body_too_large|422 (invalid_request|result_too_large)|{BUSY}",
    ),
    Attack(
        "jobs of 1 GB of lines",
        send_endless_lines,
        rf"413 body_too_large|400 malformed_json|422 (invalid_request|result_too_large)|{BUSY}",
    ),
    Attack(
        "100 000 nested brackets",
        send_nested_brackets,
        rf"422 (invalid_request|result_too_large)|400 malformed_json|{BUSY}",
    ),
    Attack(
        "wide, sparse and long JSON",
        send_long_json,
        rf"400 malformed_json|413 body_too_large|422 (invalid_request|result_too_large)|{BUSY}",
        sends_largest_json=True,
    ),
    Attack("gzip bombs", send_bombs, "415 unsupported_media_type"),
    Attack(
        "NaN everywhere: all hostile bodies",
        send_hostile_bodies,
        r"4\d\d \w+",
        sends_largest_json=True,
    ),
    Attack(
        "2³¹ resolutions, degrees, counts", send_huge_numbers, rf"200|400 malformed_body|{DONE}"
    ),
    Attack(
        "hash-flooded and repeated keys",
        send_colliding_keys,
        rf"422 invalid_request|{BUSY}",
        sends_largest_json=True,
    ),
)
