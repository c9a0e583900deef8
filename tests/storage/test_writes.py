"""Whether surfaces can be stored: by the test of writing each minute, and by every write."""

import asyncio
import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from obstore.exceptions import PermissionDeniedError

from service.api.app import create_app
from service.errors import StoreFailed, StoreFull
from service.settings.values import Settings
from service.storage.backends import Bucket
from service.storage.store import FULL_BYTES, SurfaceStore
from service.storage.watch import CHECK_INTERVAL, DEADLINE, PROBE_INTERVAL, PROBE_KEY
from tests.clock import Clock
from tests.storage.backends import KINDS, compute_id, make_read_only, open_test_store
from tools.client import start_client

pytestmark = pytest.mark.anyio
CONTENT = b"content"
PATCH = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}


async def put(store: SurfaceStore, content: bytes) -> bool:
    return await store.put(compute_id(content), content)


def read_state(store: SurfaceStore) -> str:
    """The state of writes, as in `/health/ready`."""
    return store.writes


async def let_tasks_wait() -> None:
    """Runs all tasks until they wait for the clock; none of them waits for anything else."""
    for _ in range(20):
        await asyncio.sleep(0)


def raising(number: int) -> Callable[..., None]:
    """A function that raises the system's error with this number."""

    def raise_error(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    return raise_error


@pytest.mark.parametrize("kind", KINDS)
async def test_a_small_object_is_written_at_the_start_and_each_minute(
    kind: str, tmp_path: Path, clock: Clock
) -> None:
    store = open_test_store(kind, tmp_path, quota=100)
    assert read_state(store) == "unavailable", "nothing is known yet"
    for seconds, is_written in ((0, True), (CHECK_INTERVAL, False), (PROBE_INTERVAL, True)):
        clock.now += seconds
        assert await store.is_ready()
        assert read_state(store) == "ready"
        if is_written:
            await store.backend.delete(PROBE_KEY)
        else:
            with pytest.raises(FileNotFoundError):
                await store.backend.head(PROBE_KEY)
    await store.usage.recount()
    assert store.usage.used == 0


@pytest.mark.parametrize(
    ("number", "writes"),
    [(errno.EROFS, "read_only"), (errno.ENOSPC, "full"), (errno.EIO, "unavailable")],
)
async def test_a_store_that_cannot_be_written_serves_reads_and_is_ready(
    number: int,
    writes: str,
    tmp_path: Path,
    clock: Clock,
    caplog: pytest.LogCaptureFixture,
) -> None:
    store = open_test_store("folder", tmp_path)
    await put(store, CONTENT)
    assert await store.is_ready()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", raising(number))
        clock.now += PROBE_INTERVAL
        assert await store.is_ready()
        assert read_state(store) == writes
        assert f"the store cannot be written: {writes}" in caplog.text
        assert await store.get(compute_id(CONTENT)) == CONTENT
        assert not store.has_failed
        with pytest.raises((StoreFailed, StoreFull)):
            await put(store, b"another")
        assert read_state(store) == writes
    # A surface that is stored shows it before the next test of writing.
    assert await put(store, b"another")
    assert read_state(store) == "ready"


async def test_a_write_that_fails_shows_it_before_the_next_test_of_writing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_test_store("folder", tmp_path)
    assert await store.is_ready()
    make_read_only(monkeypatch)
    with pytest.raises(StoreFailed):
        await put(store, CONTENT)
    assert await store.is_ready()
    assert read_state(store) == "read_only"


async def test_a_write_that_is_cancelled_does_not_show_that_the_store_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_test_store("folder", tmp_path)
    assert await store.is_ready()
    make_read_only(monkeypatch)
    with pytest.raises(StoreFailed):
        await put(store, CONTENT)
    has_begun = asyncio.Event()

    async def hang(*_: object, **__: object) -> None:
        has_begun.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(store.backend, "write", hang)
    writing = asyncio.create_task(put(store, CONTENT))
    await has_begun.wait()
    writing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await writing
    assert read_state(store) == "read_only"


async def test_a_store_whose_quota_is_used_up_is_full(tmp_path: Path) -> None:
    store = open_test_store("folder", tmp_path, quota=2 * FULL_BYTES)
    assert await store.is_ready()
    await put(store, b"x" * FULL_BYTES)
    assert read_state(store) == "ready"
    await put(store, b"y")
    assert read_state(store) == "full"
    await store.delete(compute_id(b"y"))
    assert read_state(store) == "ready"


async def test_a_bucket_that_forbids_writing_is_read_only() -> None:
    class ReadOnlyBucket(Bucket):
        async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
            raise PermissionDeniedError(f"403 Forbidden: {key}, {len(content)}, {durable}")

    memory = open_test_store("memory", Path()).backend
    assert isinstance(memory, Bucket)
    store = SurfaceStore(ReadOnlyBucket(memory.objects), 0)
    assert await store.is_ready()
    assert read_state(store) == "read_only"


async def test_a_test_of_writing_that_hangs_does_not_delay_the_checks(clock: Clock) -> None:
    may_end = asyncio.Event()

    class SlowBucket(Bucket):
        async def write(self, *_: object, **__: object) -> None:
            await may_end.wait()

    memory = open_test_store("memory", Path()).backend
    assert isinstance(memory, Bucket)
    store = SurfaceStore(SlowBucket(memory.objects), 0)
    check = asyncio.create_task(store.is_ready())
    while store.has_failed:
        await asyncio.sleep(0)
    await let_tasks_wait()
    clock.now += DEADLINE
    assert await check
    assert read_state(store) == "unavailable"
    may_end.set()
    while read_state(store) != "ready":
        await asyncio.sleep(0)


async def test_a_store_is_watched_without_any_request(clock: Clock) -> None:
    store = open_test_store("memory", Path())
    watch = asyncio.create_task(store.watch())
    while read_state(store) != "ready":
        await asyncio.sleep(0)
    assert not store.has_failed
    await let_tasks_wait()
    count = store.operations.totals["ask", "done"].count
    clock.now += CHECK_INTERVAL
    while store.operations.totals["ask", "done"].count == count:
        await asyncio.sleep(0)
    watch.cancel()


def test_health_says_that_a_store_is_read_only_and_the_service_is_ready(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with start_client(create_app(Settings(store=str(tmp_path)))) as client:
        surface = client.post("/v1/surfaces", PATCH).json()["links"]["self"]
        make_read_only(monkeypatch)
        response = client.get("/health/ready")
        assert response.status_code == 200
        assert response.json() == {
            "status": "ready",
            "computing": "ready",
            "store": "ready",
            "writes": "read_only",
        }
        assert client.get(surface).status_code == 200
        other = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 5]]]}}
        response = client.post("/v1/surfaces", other)
        assert (response.status_code, response.json()["code"]) == (503, "store_unavailable")
        assert response.headers["retry-after"] == "5"
