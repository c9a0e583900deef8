"""Responses to POST are compressed if the client accepts that and it pays."""

import random
from collections.abc import Iterator

import httpx
import pytest
from fastapi import FastAPI

from service.api import compression, computation
from service.api.app import create_app
from service.api.caching.codings import MIN_BYTES, Coding, compress_fast
from service.api.threads import Threads
from service.encoders.format import SplitContent
from service.settings.values import Settings
from tests.decompression import decompress_gzip, decompress_zstd
from tools.client import Client, start_client

NET = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}
DECOMPRESS = {"gzip": decompress_gzip, "zstd": decompress_zstd}
BROWSER = "gzip, deflate, br, zstd"


@pytest.fixture
def app() -> FastAPI:
    return create_app(Settings())


@pytest.fixture
def client(app: FastAPI) -> Iterator[Client]:
    with start_client(app) as client:
        yield client


def ask_mesh(
    client: Client, accepted: str | None, resolution: int = 24, **headers: str
) -> httpx.Response:
    coding = {} if accepted is None else {"Accept-Encoding": accepted}
    document = {"surface": NET, "resolution": resolution}
    return client.post_raw("/v1/mesh", document, {**headers, **coding})


def coding_of(response: httpx.Response) -> str:
    assert int(response.headers["content-length"]) == len(response.content)
    return str(response.headers.get("content-encoding", "identity"))


def test_gzip_leaves_long_files_of_numbers_as_they_are(client: Client) -> None:
    """HTTP libraries accept gzip without being asked, and would wait longer on a fast network."""
    codings = {
        (media_type, accepted): coding_of(ask_mesh(client, accepted, 80, Accept=media_type))
        for media_type in ("model/gltf-binary", "application/json")
        for accepted in ("gzip", "zstd")
    }
    assert codings == {
        ("model/gltf-binary", "gzip"): "identity",
        ("model/gltf-binary", "zstd"): "zstd",
        ("application/json", "gzip"): "gzip",
        ("application/json", "zstd"): "zstd",
    }


@pytest.mark.parametrize("media_type", ["model/gltf-binary", "application/json", "model/stl"])
@pytest.mark.parametrize(("accepted", "coding"), [(BROWSER, "zstd"), ("gzip", "gzip")])
def test_a_mesh_is_smaller_in_a_coding_and_otherwise_the_same(
    client: Client, media_type: str, accepted: str, coding: str
) -> None:
    plain = ask_mesh(client, None, Accept=media_type)
    packed = ask_mesh(client, accepted, Accept=media_type)
    assert coding_of(packed) == coding
    assert len(packed.content) < 0.9 * len(plain.content)
    assert DECOMPRESS[coding](packed.content) == plain.content
    assert packed.headers.get_list("vary") == [*plain.headers.get_list("vary"), "Accept-Encoding"]
    assert "compress;dur=" in packed.headers["server-timing"]
    changed = {"content-length", "content-encoding", "vary", "server-timing", "x-request-id"}
    assert {k: v for k, v in packed.headers.items() if k not in changed} == {
        k: v for k, v in plain.headers.items() if k not in changed
    }


def test_other_calls_are_compressed_too(client: Client) -> None:
    uv = [[i / 200, i / 200] for i in range(200)]
    response = client.post("/v1/points", {"surface": NET, "uv": uv}, {"Accept-Encoding": "gzip"})
    assert response.headers["content-encoding"] == "gzip"
    assert len(response.json()["positions"]) == 200


@pytest.mark.parametrize(
    "accepted",
    [None, "", "identity", "br", "gzip;q=0", "identity;q=0, br", "*;q=0", ";;q," * 99],
)
def test_a_client_that_names_no_coding_of_the_service_gets_plain_bytes(
    client: Client, accepted: str | None
) -> None:
    assert ask_mesh(client, accepted).headers.get("content-encoding") is None


def test_short_and_long_responses_stay_as_they_are(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = ask_mesh(client, BROWSER, resolution=1)
    assert len(short.content) < MIN_BYTES
    assert coding_of(short) == "identity"
    monkeypatch.setattr(compression, "MAX_BYTES", 10_000)
    assert coding_of(ask_mesh(client, BROWSER)) == "identity"


def test_refusals_are_not_compressed(client: Client) -> None:
    response = client.post_raw("/v1/mesh", {"surface": {"x": 1}}, {"Accept-Encoding": BROWSER})
    assert response.status_code == 422
    assert "content-encoding" not in response.headers


@pytest.mark.parametrize("is_busy", [False, True])
def test_a_response_waits_for_no_thread_to_be_compressed(
    app: FastAPI, client: Client, monkeypatch: pytest.MonkeyPatch, is_busy: bool
) -> None:
    """Without a free thread, or memory, it is sent plain; all memory is given back afterwards."""
    threads: Threads = app.state.services.threads
    asked: list[int] = []
    try_acquire = threads.try_acquire

    def acquire_or_refuse(turn: object) -> bool:
        asked.append(1)
        # The mesh itself gets its thread; its compression is the second that asks.
        return try_acquire(turn) if len(asked) == 1 or not is_busy else False  # type: ignore[arg-type]

    monkeypatch.setattr(computation, "INLINE_SECONDS", 0.0)
    monkeypatch.setattr(threads, "try_acquire", acquire_or_refuse)
    response = ask_mesh(client, BROWSER, resolution=200)
    assert len(asked) == 2
    assert coding_of(response) == ("identity" if is_busy else "zstd")
    assert threads.used_bytes == threads.body_bytes == 0
    assert not threads.unread.totals


@pytest.mark.parametrize("coding", ["gzip", "zstd"])
def test_buffers_are_compressed_as_one_body(coding: Coding) -> None:
    buffers = tuple(bytes([i]) * 300_000 for i in range(5))
    body = compress_fast(coding, SplitContent(buffers))
    assert body is not None
    assert DECOMPRESS[coding](bytes(body)) == b"".join(buffers)


@pytest.mark.parametrize("coding", ["gzip", "zstd"])
@pytest.mark.parametrize("size", [10_000, 1_000_000])
def test_random_bytes_stay_as_they_are(coding: Coding, size: int) -> None:
    assert compress_fast(coding, random.Random(1).randbytes(size)) is None
