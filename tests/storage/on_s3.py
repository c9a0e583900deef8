"""The store on a server that speaks S3: `make test-s3`.

The server is moto's, from a Python of its own; `S3_SERVER` names its program.
"""

import asyncio
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import obstore
import pytest

from service.api.observing.health import STORE_GRACE
from service.errors import DamagedObject, StoreFailed, StoreFull, UnknownSurface
from service.settings.values import Settings
from service.storage.address import open_store
from service.storage.keys import key_of
from service.storage.store import SurfaceStore
from tests.live import run_service
from tests.storage.backends import compute_id, set_account
from tools.processes import Server, free_port

pytestmark = pytest.mark.anyio
BUCKET = "surfaces-of-a-test"
PATCH = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
TEN = [bytes([digit]) * 10 for digit in range(10)]


@contextmanager
def start_s3_server() -> Iterator[str]:
    """URL of a server that keeps everything in its memory, with one empty bucket."""
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
    """Another prefix of the bucket for every test."""
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


@pytest.mark.parametrize("instead", [b"", TEN[1], TEN[0][:-1]], ids=["empty", "other", "short"])
async def test_damaged_object(instead: bytes, address: str) -> None:
    store = open_store(address, 0)
    await put(store, TEN[0])
    await obstore.put_async(store._backend.objects, key_of(compute_id(TEN[0])), instead)
    with pytest.raises(DamagedObject):
        await store.get(compute_id(TEN[0]))
    assert await put(store, TEN[0])
    assert await store.get(compute_id(TEN[0])) == TEN[0]


async def test_all_pages_of_the_listing_count(address: str) -> None:
    """A listing has pages of a thousand objects."""
    many, full = [f"{number:10d}".encode() for number in range(1003)], open_store(address, 0)
    await asyncio.gather(*(put(full, content) for content in many))
    store = open_store(address, 10_049)
    assert await put(store, TEN[0])
    with pytest.raises(StoreFull) as caught:
        await put(store, TEN[1])
    assert caught.value.issues[0].needed == "at most 9 bytes"
    assert not await put(store, TEN[0])
    assert await store.delete(compute_id(many[0]))
    assert await put(store, TEN[1])


async def test_a_bucket_that_is_not_there(server: str) -> None:
    del server
    store = open_store("s3://there-is-no-such-bucket", 0)
    with pytest.raises(StoreFailed):
        await put(store, TEN[0])
    assert not await store.is_ready()


def test_service_outlives_its_store() -> None:
    with start_s3_server() as url, set_account(url):
        settings = Settings(store=f"s3://{BUCKET}/service", store_quota=1 << 20)
        with run_service(settings) as service:
            ready = httpx.get(f"{service}/health/ready")
            assert (ready.status_code, ready.json()["store"]) == (200, "ready")
            stored = httpx.post(f"{service}/v1/surfaces", json=PATCH)
            assert stored.status_code == 201
            address = stored.headers["location"]
            given = httpx.get(f"{service}{address}").json()["surface"]
            assert given["control_net"] == PATCH["surface"]["control_net"]
    with set_account(url), run_service(settings) as service:  # no server listens at `url` any more
        ready = httpx.get(f"{service}/health/ready")
        assert (ready.status_code, ready.json()["store"]) == (200, "unavailable")
        assert httpx.get(f"{service}/v1/surfaces/saddle/mesh.glb").status_code == 200
        for answer in (
            httpx.get(f"{service}{address}", timeout=60),
            httpx.post(f"{service}/v1/surfaces", json=PATCH, timeout=60),
        ):
            assert (answer.status_code, answer.json()["code"]) == (503, "store_unavailable")
            assert url not in answer.text
        time.sleep(STORE_GRACE)
        ready = httpx.get(f"{service}/health/ready")
        assert (ready.status_code, ready.json()["store"]) == (503, "unavailable")
