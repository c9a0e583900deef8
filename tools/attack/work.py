"""Attacks that cause as much work as the limits allow."""

import asyncio
import json
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from itertools import cycle, product

import numpy as np

from service.encoders.registry import BY_SUFFIX
from tools.attack.wire import (
    BUSY,
    DONE,
    Attack,
    Pieces,
    build_get,
    build_post,
    open_connection,
    send_requests,
)
from tools.hostile.files import NPY, save_array


@cache
def build_grid_body(rows: int, columns: int) -> bytes:
    """The body of a request with a B-spline of `rows` × `columns` control points."""
    net = [[[i, j, (i * j) % 7 / 7] for j in range(columns)] for i in range(rows)]
    surface = {"type": "bspline", "degree": 3, "control_net": net}
    return json.dumps({"surface": surface, "resolution": 1}).encode()


@cache
def build_vertices_body(count: int) -> bytes:
    """The body of a request with `count` vertices, of which only four are used, by one patch."""
    vertices = [[k % 7 / 7, k % 11 / 11, k] for k in range(count)]
    surface = {"type": "patches", "vertices": vertices, "patches": [[[0, 1], [2, 3]]]}
    return json.dumps({"surface": surface, "resolution": 1}).encode()


_PATCH = {"control_net": [[[i, j, i * j % 3] for j in range(4)] for i in range(4)]}


def _build_document(**options: object) -> bytes:
    """The JSON body of a request with one bicubic patch and these options."""
    return json.dumps({"surface": _PATCH} | options).encode()


LARGE_MESH_REQUEST = build_post("/v1/mesh?format=stl", _build_document(resolution=800))
"""A short request whose response has 64 MB."""

_NAMES = ("utah-teapot", "torus", "sphere", "tea-service")

UNCACHED_URLS = tuple(
    f"/v1/surfaces/{name}/mesh.{suffix}?resolution={u},{v}"
    for u, v, name, suffix in product(range(5, 40), range(5, 40), _NAMES, BY_SUFFIX)
)
"""Distinct URLs, whose responses are not in the cache when they are first requested."""


async def request_uncached_urls(port: int) -> Counter[str]:
    """Requests meshes by distinct URLs, 8 at a time."""
    return await send_requests(
        port, [build_get(url) for url in UNCACHED_URLS], together=8, seconds=6
    )


async def request_small_tolerances(port: int) -> Counter[str]:
    """Requests small meshes that take long to compute."""
    addresses = (
        f"/v1/surfaces/{name}/mesh.{suffix}?tolerance={number}e-6&two_sided={sides}"
        for number, name, suffix, sides in product(
            range(400, 600), _NAMES, ("glb", "stl"), ("true", "false")
        )
    )
    return await send_requests(port, (build_get(url) for url in addresses), together=8, seconds=8)


async def request_largest_meshes(port: int) -> Counter[str]:
    """Requests the largest allowed meshes and numbers of points, 24 at a time."""
    requests: list[Pieces] = []
    for fmt, resolution in (("glb", 1000), ("stl", 900), ("json", 500), ("obj", 450)):
        requests.append(
            build_post(f"/v1/mesh?format={fmt}", _build_document(resolution=resolution))
        )
        requests.append(
            build_get(
                f"/v1/surfaces/saddle/mesh.{fmt}?resolution={resolution}", "Accept-Encoding: zstd"
            )
        )
    requests.append(
        build_post("/v1/mesh?format=json", _build_document(resolution=400, faces="quads", uvs=True))
    )
    points = [[k / 100_000, 0.5] for k in range(100_000)]
    requests.append(build_post("/v1/points", _build_document(uv=points, derivatives=2)))
    requests.append(
        build_post("/v1/project", _build_document(points=[[u, v, 1.0] for u, v in points]))
    )
    return await send_requests(port, cycle(requests), together=24, seconds=12)


async def send_largest_bodies(port: int) -> Counter[str]:
    """Sends .npy files with the most control points that are allowed, and JSON that is too long."""
    net = np.zeros((62_500, 4, 4, 3), np.float32)
    net[..., 0], net[..., 1] = np.indices((4, 4))
    net[..., 2] = np.arange(62_500)[:, None, None]
    npy, json_body = save_array(net), build_vertices_body(900_000)
    requests: tuple[Pieces, ...] = (
        build_post("/v1/mesh?format=glb&resolution=1", npy, media_type=NPY),
        build_post("/v1/mesh?format=stl", json_body),
        build_post("/v1/estimate?resolution=4", npy, media_type=NPY),
        build_post("/v1/surfaces", npy, media_type=NPY),
        build_post("/v1/surfaces", json_body.replace(b', "resolution": 1', b"")),
    )
    first_responses = await send_requests(port, requests, together=1, seconds=12)
    return first_responses + await send_requests(port, cycle(requests), together=8, seconds=8)


def _list_spellings() -> Iterator[Pieces]:
    """Requests that differ, although only a few different responses exist."""
    for k in range(100_000):
        url = "/v1/surfaces/saddle/mesh.glb?resolution="
        yield build_get(f"{url}4&crease_angle=0.{'3' * (k % 15 + 1)}{k}")
        yield build_get(
            f"{url}5", f"Accept-Encoding: zstd;q=0.{k % 1000:03}, gzip;q=0.{k // 100:03}"
        )
        yield build_get(f"{url}5&tolerance=", f'If-None-Match: "{k}"')
        yield build_get(f"{url}5", f"Accept: x/{k}", f"Cookie: k={k}", f"Origin: http://{k}")
        yield build_get(f"{url}6&weld={'true' if k % 2 else 'false'}&wire_sides={k % 60 + 3}")


async def request_spellings(port: int) -> Counter[str]:
    """Requests a few meshes with many spellings of URLs and headers."""
    return await send_requests(port, _list_spellings(), together=4, seconds=6)


async def upload_distinct_surfaces(port: int) -> Counter[str]:
    """Uploads distinct small surfaces until the store is full."""

    def surfaces() -> Iterator[Pieces]:
        for k in range(100_000):
            net = np.full((32, 32, 3), k, np.float32)
            net[..., 0], net[..., 1] = np.indices((32, 32))
            yield build_post("/v1/surfaces", save_array(net), media_type=NPY)

    return await send_requests(port, surfaces(), seconds=6)


async def request_conversions(port: int) -> Counter[str]:
    """Sends short requests with large results or much work: conversions, wires, slow methods."""
    spline = build_grid_body(400, 400)
    operations = b'[{"op": "bezier"}, {"op": "elevate", "degree": [12, 12]}]'
    requests = [
        build_post(
            "/v1/convert", _build_document(operations=[{"op": "elevate", "degree": [64, 64]}])
        ),
        build_post(
            "/v1/convert", _build_document(operations=[{"op": "split", "u": 0.5, "v": 0.5}] * 30)
        ),
        build_post("/v1/convert", _build_document(operations=[{"op": "transpose"}] * 1000)),
        build_post(
            "/v1/convert", spline.replace(b'"resolution": 1', b'"operations": ' + operations)
        ),
        build_post(
            "/v1/mesh", _build_document(wires="tubes", isocurves=500, wire_sides=64, resolution=500)
        ),
        build_post("/v1/mesh", _build_document(method="de_casteljau", resolution=1000)),
        build_post("/v1/mesh", _build_document(method="forward_difference", resolution=1000)),
    ]
    return await send_requests(port, cycle(requests), together=6, seconds=8)


async def send_small_posts(port: int) -> Counter[str]:
    """Sends small requests on 16 connections that stay open, for 4 s."""
    responses: Counter[str] = Counter()
    end = asyncio.get_running_loop().time() + 4
    body = _build_document(resolution=4)
    request = build_post("/v1/mesh?format=glb", body).replace(b"Connection: close\r\n", b"")

    async def send_one_by_one() -> None:
        with suppress(OSError, asyncio.IncompleteReadError):
            async with open_connection(port) as (reader, writer):
                while asyncio.get_running_loop().time() < end:
                    writer.write(request)
                    head = await reader.readuntil(b"\r\n\r\n")
                    length = head.lower().split(b"content-length:")[1].split(b"\r\n")[0]
                    await reader.readexactly(int(length))
                    responses[head[9:12].decode()] += 1
                    await asyncio.sleep(0.004)

    await asyncio.gather(*(send_one_by_one() for _ in range(16)))
    return responses


WORK = (
    Attack("many distinct cold addresses", request_uncached_urls, DONE),
    Attack("tolerances that take long", request_small_tolerances, DONE),
    Attack("the largest meshes, many at once", request_largest_meshes, DONE),
    Attack(
        "the largest bodies, many at once",
        send_largest_bodies,
        rf"201|413 body_too_large|507 store_full|{DONE}",
    ),
    Attack("cache-busting", request_spellings, rf"304|{DONE}"),
    Attack(
        "distinct uploads against the quota",
        upload_distinct_surfaces,
        rf"201|507 store_full|{BUSY}",
    ),
    Attack("conversions, wires and slow methods", request_conversions, DONE),
    Attack("small posts, 16 connections", send_small_posts, "200|429"),
)
