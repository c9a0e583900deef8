"""The store never keeps more bytes than its quota."""

import asyncio
from pathlib import Path

import pytest

from service.errors import StoreFailed, StoreFull
from service.storage import quota as module
from service.storage.quota import FRESH_SECONDS, STALE_SECONDS, Usage
from service.storage.store import SurfaceStore
from tests.storage.backends import KINDS, compute_id, find_file, list_files, store_of

pytestmark = pytest.mark.anyio
TEN = [bytes([digit]) * 10 for digit in range(10)]


async def put(store: SurfaceStore, content: bytes) -> bool:
    return await store.put(compute_id(content), content)


@pytest.mark.parametrize("kind", KINDS)
async def test_surfaces_beyond_the_quota_are_refused_and_not_written(
    kind: str, tmp_path: Path
) -> None:
    store = store_of(kind, tmp_path, 39)
    for content in TEN[:3]:
        assert await put(store, content)
    with pytest.raises(StoreFull) as caught:
        await put(store, TEN[3])
    (issue,) = caught.value.issues
    assert (issue.code, issue.got, issue.needed) == ("store_full", "10 bytes", "at most 9 bytes")
    assert not await store.has(compute_id(TEN[3]))
    assert not await put(store, TEN[0]), "what is there needs no room"
    assert await put(store, b"123456789"), "what fits is taken"
    assert await store.delete(compute_id(TEN[0]))
    assert await put(store, TEN[3])


@pytest.mark.parametrize("kind", KINDS)
async def test_many_at_once_stay_below(kind: str, tmp_path: Path) -> None:
    store = store_of(kind, tmp_path, 49)
    stored = await asyncio.gather(*(put(store, content) for content in TEN), return_exceptions=True)
    assert stored.count(True) == 4
    assert sum(isinstance(each, StoreFull) for each in stored) == 6


async def test_surfaces_stored_before_the_start_count(tmp_path: Path) -> None:
    await put(store_of("folder", tmp_path), TEN[0])
    (tmp_path / "staging" / "abc").write_bytes(b"being written")
    store = store_of("folder", tmp_path, 20)
    assert await put(store, TEN[1])
    with pytest.raises(StoreFull):
        await put(store, TEN[2])


async def test_mending_needs_no_room(tmp_path: Path) -> None:
    store = store_of("folder", tmp_path, 20)
    for content in TEN[:2]:
        await put(store, content)
    find_file(tmp_path, TEN[0]).write_bytes(b"")
    assert await put(store, TEN[0])


async def test_room_that_others_make_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = store_of("folder", tmp_path, 20)
    for content in TEN[:2]:
        await put(store, content)
    for path in list_files(tmp_path):
        path.unlink()
    with pytest.raises(StoreFull):
        await put(store, TEN[2])  # the last count is recent
    monkeypatch.setattr(module, "FRESH_SECONDS", -1)
    assert await put(store, TEN[2])


class Elsewhere:
    """Usage with a listing that other processes change, and a clock that tests set."""

    def __init__(self) -> None:
        self.bytes = 0
        self.now = 0.0
        self.counts = 0
        self.broken = False

    async def listed(self) -> int:
        self.counts += 1
        await asyncio.sleep(0)
        if self.broken:
            raise StoreFailed
        return self.bytes

    def usage(self, quota: int) -> Usage:
        return Usage(quota, self.listed, lambda: self.now)


async def take(usage: Usage, size: int) -> None:
    async with usage.reserve(size):
        pass


async def run_tasks() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_counts_are_made_once_then_before_refusing_then_now_and_then() -> None:
    place = Elsewhere()
    usage = place.usage(100)
    await asyncio.gather(*(take(usage, 10) for _ in range(5)))
    assert place.counts == 1
    place.bytes = 20
    place.now = FRESH_SECONDS + 1
    await take(usage, 80)  # 50 by our count, 20 by the listing
    assert place.counts == 2
    with pytest.raises(StoreFull):
        await take(usage, 1)
    assert place.counts == 2, "a full store is not listed for every request"
    place.now += STALE_SECONDS + 1
    with pytest.raises(StoreFull):
        await take(usage, 101)
    assert place.counts == 2, "what can never fit needs no listing"
    place.bytes = 0
    await take(usage, 0)
    await take(usage, 1)
    await run_tasks()
    assert place.counts == 3


async def test_an_old_count_is_used_while_a_new_one_fails() -> None:
    place = Elsewhere()
    usage = place.usage(100)
    await take(usage, 10)
    place.broken = True
    place.now = STALE_SECONDS + 1
    await take(usage, 10)
    await run_tasks()
    assert place.counts == 2
    with pytest.raises(StoreFailed):
        await take(usage, 90)


async def test_surfaces_stored_during_a_count_are_counted() -> None:
    place = Elsewhere()
    usage = place.usage(100)
    await take(usage, 10)
    place.bytes = 10
    counting = asyncio.create_task(usage.recount())
    await asyncio.sleep(0)
    await asyncio.sleep(0)  # the listing runs
    await take(usage, 60)
    await counting
    with pytest.raises(StoreFull):
        await take(usage, 31)
    await take(usage, 30)


async def test_a_failed_write_releases_its_bytes() -> None:
    usage = Elsewhere().usage(100)
    for _ in range(3):
        with pytest.raises(ZeroDivisionError):
            async with usage.reserve(100):
                raise ZeroDivisionError
    await take(usage, 100)
