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
from tests.api.hostile_files import NPY, save_array
from tools.attack.wire import BUSY, DONE, Attack, Pieces, get, open_connection, post, send_storm


@cache
def grid(rows: int, columns: int) -> bytes:
    """A request with a B-spline of `rows` × `columns` control points."""
    net = [[[i, j, (i * j) % 7 / 7] for j in range(columns)] for i in range(rows)]
    surface = {"type": "bspline", "degree": 3, "control_net": net}
    return json.dumps({"surface": surface, "resolution": 1}).encode()


@cache
def points(count: int) -> bytes:
    """A request with `count` control points, of which one patch uses a few."""
    vertices = [[k % 7 / 7, k % 11 / 11, k] for k in range(count)]
    surface = {"type": "patches", "vertices": vertices, "patches": [[[0, 1], [2, 3]]]}
    return json.dumps({"surface": surface, "resolution": 1}).encode()


_PATCH = {"control_net": [[[i, j, i * j % 3] for j in range(4)] for i in range(4)]}


def _mesh(**options: object) -> bytes:
    return json.dumps({"surface": _PATCH} | options).encode()


LARGE_ANSWER = post("/v1/mesh?format=stl", _mesh(resolution=800))
"""A short request whose response has 64 MB."""

_NAMES = ("utah-teapot", "torus", "sphere", "tea-service")

COLD = tuple(
    f"/v1/surfaces/{name}/mesh.{suffix}?resolution={u},{v}"
    for u, v, name, suffix in product(range(5, 40), range(5, 40), _NAMES, BY_SUFFIX)
)
"""Different URLs that are not in the cache."""


async def cold(port: int) -> Counter[str]:
    return await send_storm(port, [get(url) for url in COLD], together=8, seconds=6)


async def tolerances(port: int) -> Counter[str]:
    """Small meshes that take long to compute."""
    addresses = (
        f"/v1/surfaces/{name}/mesh.{suffix}?tolerance={number}e-6&two_sided={sides}"
        for number, name, suffix, sides in product(
            range(400, 600), _NAMES, ("glb", "stl"), ("true", "false")
        )
    )
    return await send_storm(port, (get(url) for url in addresses), together=8, seconds=8)


async def largest(port: int) -> Counter[str]:
    """The largest allowed meshes, many at once."""
    kinds: list[Pieces] = []
    for fmt, resolution in (("glb", 1000), ("stl", 900), ("json", 500), ("obj", 450)):
        kinds.append(post(f"/v1/mesh?format={fmt}", _mesh(resolution=resolution)))
        kinds.append(
            get(f"/v1/surfaces/saddle/mesh.{fmt}?resolution={resolution}", "Accept-Encoding: zstd")
        )
    kinds.append(post("/v1/mesh?format=json", _mesh(resolution=400, faces="quads", uvs=True)))
    points = [[k / 100_000, 0.5] for k in range(100_000)]
    kinds.append(post("/v1/points", _mesh(uv=points, derivatives=2)))
    kinds.append(post("/v1/project", _mesh(points=[[u, v, 1.0] for u, v in points])))
    return await send_storm(port, cycle(kinds), together=24, seconds=12)


async def largest_bodies(port: int) -> Counter[str]:
    """Surfaces with the largest allowed number of control points."""
    net = np.zeros((62_500, 4, 4, 3), np.float32)
    net[..., 0], net[..., 1] = np.indices((4, 4))
    net[..., 2] = np.arange(62_500)[:, None, None]
    patches, text = save_array(net), points(900_000)
    kinds: tuple[Pieces, ...] = (
        post("/v1/mesh?format=glb&resolution=1", patches, media_type=NPY),
        post("/v1/mesh?format=stl", text),
        post("/v1/estimate?resolution=4", patches, media_type=NPY),
        post("/v1/surfaces", patches, media_type=NPY),
        post("/v1/surfaces", text.replace(b', "resolution": 1', b"")),
    )
    alone = await send_storm(port, kinds, together=1, seconds=12)
    return alone + await send_storm(port, cycle(kinds), together=8, seconds=8)


def _spellings() -> Iterator[Pieces]:
    """One cached response, requested in many different ways."""
    for k in range(100_000):
        url = "/v1/surfaces/saddle/mesh.glb?resolution="
        yield get(f"{url}4&crease_angle=0.{'3' * (k % 15 + 1)}{k}")
        yield get(f"{url}5", f"Accept-Encoding: zstd;q=0.{k % 1000:03}, gzip;q=0.{k // 100:03}")
        yield get(f"{url}5&tolerance=", f'If-None-Match: "{k}"')
        yield get(f"{url}5", f"Accept: x/{k}", f"Cookie: k={k}", f"Origin: http://{k}")
        yield get(f"{url}6&weld={'true' if k % 2 else 'false'}&wire_sides={k % 60 + 3}")


async def busting(port: int) -> Counter[str]:
    return await send_storm(port, _spellings(), together=4, seconds=6)


async def uploads(port: int) -> Counter[str]:
    """Small surfaces, all different, until the store is full."""

    def surfaces() -> Iterator[Pieces]:
        for k in range(100_000):
            net = np.full((32, 32, 3), k, np.float32)
            net[..., 0], net[..., 1] = np.indices((32, 32))
            yield post("/v1/surfaces", save_array(net), media_type=NPY)

    return await send_storm(port, surfaces(), seconds=6)


async def operations(port: int) -> Counter[str]:
    """Short requests for conversions with large results."""
    kinds = [
        post("/v1/convert", _mesh(operations=[{"op": "elevate", "degree": [64, 64]}])),
        post("/v1/convert", _mesh(operations=[{"op": "split", "u": 0.5, "v": 0.5}] * 30)),
        post("/v1/convert", _mesh(operations=[{"op": "transpose"}] * 1000)),
        post("/v1/convert", grid(400, 400).replace(b'"resolution": 1', b'"operations": '
             b'[{"op": "bezier"}, {"op": "elevate", "degree": [12, 12]}]')),
        post("/v1/mesh", _mesh(wires="tubes", isocurves=500, wire_sides=64, resolution=500)),
        post("/v1/mesh", _mesh(method="de_casteljau", resolution=1000)),
        post("/v1/mesh", _mesh(method="forward_difference", resolution=1000)),
    ]  # fmt: skip
    return await send_storm(port, cycle(kinds), together=6, seconds=8)


async def floods(port: int) -> Counter[str]:
    """Small requests on open connections, at the highest rate that the service can serve."""
    answers: Counter[str] = Counter()
    end = asyncio.get_running_loop().time() + 4
    body = _mesh(resolution=4)
    request = post("/v1/mesh?format=glb", body).replace(b"Connection: close\r\n", b"")

    async def one_by_one() -> None:
        with suppress(OSError, asyncio.IncompleteReadError):
            async with open_connection(port) as (reader, writer):
                while asyncio.get_running_loop().time() < end:
                    writer.write(request)
                    head = await reader.readuntil(b"\r\n\r\n")
                    length = head.lower().split(b"content-length:")[1].split(b"\r\n")[0]
                    await reader.readexactly(int(length))
                    answers[head[9:12].decode()] += 1
                    await asyncio.sleep(0.004)

    await asyncio.gather(*(one_by_one() for _ in range(16)))
    return answers


WORK = (
    Attack("many distinct cold addresses", cold, DONE),
    Attack("tolerances that take long", tolerances, DONE),
    Attack("the largest meshes, many at once", largest, DONE),
    Attack(
        "the largest bodies, many at once",
        largest_bodies,
        rf"201|413 body_too_large|507 store_full|{DONE}",
    ),
    Attack("cache-busting", busting, rf"304|{DONE}"),
    Attack("distinct uploads against the quota", uploads, rf"201|507 store_full|{BUSY}"),
    Attack("conversions, wires and slow methods", operations, DONE),
    Attack("small posts, 16 connections", floods, "200|429"),
)
