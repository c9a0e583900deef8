"""Tests of a store in a bucket of an S3 server: `make test-s3`.

The package moto has this server, and is in a Python environment of its own; the variable
`S3_SERVER` is the path of its program.
"""

import asyncio
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from service.errors import DamagedObject, StoreFailed, StoreFull, UnknownSurface
from service.settings.values import Settings
from service.storage.address import open_store
from service.storage.keys import key_of
from service.storage.store import SurfaceStore
from tests.storage.backends import compute_id, set_account
from tools.live import run_service
from tools.processes import Server, free_port

pytestmark = pytest.mark.anyio
BUCKET = "surfaces-of-a-test"
PATCH = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
CONTENTS = [bytes([digit]) * 10 for digit in range(10)]
"""Ten different contents of ten bytes each."""


@contextmanager
def start_s3_server() -> Iterator[str]:
    """The URL of an S3 server with one empty bucket; it keeps all objects in memory."""
    port = free_port()
    command = [os.environ["S3_SERVER"], "--host", "127.0.0.1", "--port", str(port)]
    with Server(Path(os.devnull), command, port, os.environ) as server:
        httpx.put(f"{server.url}/{BUCKET}").raise_for_status()
        yield server.url


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with start_s3_server() as url, set_account(url):
        yield url


@pytest.fixture
def address(server: str, request: pytest.FixtureRequest) -> str:
    """The address of a store for one test: a prefix of the bucket with the test's name."""
    del server
    return f"s3://{BUCKET}/{request.node.name}"


async def put(store: SurfaceStore, content: bytes) -> bool:
    return await store.put(compute_id(content), content)


@pytest.mark.parametrize("size", [0, 10, 6 << 20], ids=["empty", "short", "6 MiB"])
async def test_stored_surfaces_are_read_back(size: int, address: str) -> None:
    content = b"x" * size
    id = compute_id(content)
    store = open_store(address, 0)
    assert not await store.has(id)
    assert await put(store, content)
    assert not await put(store, content)
    assert await store.has(id)
    assert await store.get(id) == content
    assert await store.delete(id)
    assert not await store.delete(id)
    with pytest.raises(UnknownSurface):
        await store.get(id)


@pytest.mark.parametrize(
    "damaged_content", [b"", CONTENTS[1], CONTENTS[0][:-1]], ids=["empty", "other", "short"]
)
async def test_a_damaged_object_is_refused_and_replaced_when_stored_again(
    damaged_content: bytes, address: str
) -> None:
    store = open_store(address, 0)
    await put(store, CONTENTS[0])
    await store.backend.write(key_of(compute_id(CONTENTS[0])), damaged_content)
    with pytest.raises(DamagedObject):
        await store.get(compute_id(CONTENTS[0]))
    assert await put(store, CONTENTS[0])
    assert await store.get(compute_id(CONTENTS[0])) == CONTENTS[0]


async def test_the_quota_counts_all_pages_of_the_listing(address: str) -> None:
    """An S3 server lists a bucket in pages of 1000 objects; this store has 1003."""
    contents = [f"{number:10d}".encode() for number in range(1003)]
    store = open_store(address, 0)
    await asyncio.gather(*(put(store, content) for content in contents))
    store = open_store(address, 10_049)  # bytes: 1004 contents of 10 bytes, and 9 more
    assert await put(store, CONTENTS[0])
    with pytest.raises(StoreFull) as error:
        await put(store, CONTENTS[1])
    assert error.value.issues[0].needed == "at most 9 bytes"
    assert not await put(store, CONTENTS[0])
    assert await store.delete(compute_id(contents[0]))
    assert await put(store, CONTENTS[1])


async def test_a_store_in_a_missing_bucket_is_not_ready(server: str) -> None:
    del server
    store = open_store("s3://there-is-no-such-bucket", 0)
    with pytest.raises(StoreFailed):
        await put(store, CONTENTS[0])
    assert not await store.is_ready()


def test_a_service_works_without_its_store_and_is_not_ready() -> None:
    with start_s3_server() as url, set_account(url):
        settings = Settings(store=f"s3://{BUCKET}/service", store_quota=1 << 20)
        with run_service(settings) as service:
            health = httpx.get(f"{service}/health/ready")
            assert (health.status_code, health.json()["store"]) == (200, "ready")
            creation = httpx.post(f"{service}/v1/surfaces", json=PATCH)
            assert creation.status_code == 201
            path_of_surface = creation.headers["location"]
            surface = httpx.get(f"{service}{path_of_surface}").json()["surface"]
            assert surface["control_net"] == PATCH["surface"]["control_net"]
    # The S3 server has ended; no process listens at `url`.
    with set_account(url), run_service(settings) as service:
        health = httpx.get(f"{service}/health/ready")
        assert (health.status_code, health.json()["store"]) == (503, "unavailable")
        assert httpx.get(f"{service}/v1/surfaces/saddle/mesh.glb").status_code == 200
        for response in (
            httpx.get(f"{service}{path_of_surface}", timeout=60),
            httpx.post(f"{service}/v1/surfaces", json=PATCH, timeout=60),
        ):
            assert (response.status_code, response.json()["code"]) == (503, "store_unavailable")
            assert url not in response.text
