"""The store never keeps more bytes than its quota."""

import asyncio
from pathlib import Path

import pytest

from service.errors import StoreFailed, StoreFull
from service.storage.quota import FRESH_SECONDS, STALE_SECONDS, Usage
from service.storage.store import SurfaceStore
from tests.clock import Clock
from tests.storage.backends import KINDS, compute_id, compute_path, list_files, open_test_store

pytestmark = pytest.mark.anyio
CONTENTS = [bytes([digit]) * 10 for digit in range(10)]
"""Ten different contents of ten bytes each."""


async def put(store: SurfaceStore, content: bytes) -> bool:
    return await store.put(compute_id(content), content)


@pytest.mark.parametrize("kind", KINDS)
async def test_surfaces_beyond_the_quota_are_refused_and_not_written(
    kind: str, tmp_path: Path
) -> None:
    store = open_test_store(kind, tmp_path, 39)
    for content in CONTENTS[:3]:
        assert await put(store, content)
    with pytest.raises(StoreFull) as error:
        await put(store, CONTENTS[3])
    (issue,) = error.value.issues
    assert (issue.code, issue.got, issue.needed) == ("store_full", "10 bytes", "at most 9 bytes")
    assert not await store.has(compute_id(CONTENTS[3]))
    assert not await put(store, CONTENTS[0]), "a stored content needs no more bytes"
    assert await put(store, b"123456789"), "a content that fits is stored"
    assert await store.delete(compute_id(CONTENTS[0]))
    assert await put(store, CONTENTS[3])


@pytest.mark.parametrize("kind", KINDS)
async def test_contents_stored_at_the_same_time_stay_within_the_quota(
    kind: str, tmp_path: Path
) -> None:
    store = open_test_store(kind, tmp_path, 49)
    results = await asyncio.gather(
        *(put(store, content) for content in CONTENTS), return_exceptions=True
    )
    assert results.count(True) == 4
    assert sum(isinstance(each, StoreFull) for each in results) == 6


async def test_surfaces_stored_before_the_start_count_and_partial_files_do_not(
    tmp_path: Path,
) -> None:
    await put(open_test_store("folder", tmp_path), CONTENTS[0])
    (tmp_path / "staging" / "abc").write_bytes(b"being written")
    store = open_test_store("folder", tmp_path, 20)
    assert await put(store, CONTENTS[1])
    with pytest.raises(StoreFull):
        await put(store, CONTENTS[2])


async def test_replacing_a_damaged_object_needs_no_more_bytes(tmp_path: Path) -> None:
    store = open_test_store("folder", tmp_path, 20)
    for content in CONTENTS[:2]:
        await put(store, content)
    compute_path(tmp_path, CONTENTS[0]).write_bytes(b"")
    assert await put(store, CONTENTS[0])


async def test_bytes_that_other_processes_delete_become_free(tmp_path: Path, clock: Clock) -> None:
    store = open_test_store("folder", tmp_path, 20)
    for content in CONTENTS[:2]:
        await put(store, content)
    for path in list_files(tmp_path):
        path.unlink()
    with pytest.raises(StoreFull):
        await put(store, CONTENTS[2])  # the last count is recent, so the store does not repeat it
    clock.now += FRESH_SECONDS + 1
    assert await put(store, CONTENTS[2])


class SharedBackend:
    """A backend that other processes use too.

    `bytes` is what a listing of its objects reports; `listings` counts the listings.
    """

    def __init__(self) -> None:
        self.bytes = 0
        self.listings = 0
        self.is_broken = False

    async def count_bytes(self) -> int:
        self.listings += 1
        await asyncio.sleep(0)
        if self.is_broken:
            raise StoreFailed
        return self.bytes

    def build_usage(self, quota: int) -> Usage:
        return Usage(quota, self.count_bytes)


async def store_bytes(usage: Usage, size: int) -> None:
    """Counts `size` bytes as stored; raises if they do not fit."""
    async with usage.reserve(size):
        pass


async def run_tasks() -> None:
    """Lets listings run that were started in the background."""
    for _ in range(5):
        await asyncio.sleep(0)


async def test_listings_are_made_only_if_there_is_no_count_or_it_is_too_old(clock: Clock) -> None:
    """The first count is a listing. A count is too old to refuse an object after `FRESH_SECONDS`.

    After `STALE_SECONDS` it is too old for objects that fit, too.
    """
    backend = SharedBackend()
    usage = backend.build_usage(100)
    await asyncio.gather(*(store_bytes(usage, 10) for _ in range(5)))
    assert backend.listings == 1
    backend.bytes = 20
    clock.now += FRESH_SECONDS + 1
    await store_bytes(usage, 80)  # 50 bytes by our own count, 20 by the listing
    assert backend.listings == 2
    with pytest.raises(StoreFull):
        await store_bytes(usage, 1)
    assert backend.listings == 2, "a full store is not listed for every request"
    clock.now += STALE_SECONDS + 1
    with pytest.raises(StoreFull):
        await store_bytes(usage, 101)
    assert backend.listings == 2, "a content larger than the quota needs no listing"
    await store_bytes(usage, 0)
    assert backend.listings == 2, "an object that takes no more bytes needs no listing"
    backend.bytes = 0
    await store_bytes(usage, 1)
    assert backend.listings == 3, "without a listing, 1 byte would be refused"
    clock.now += STALE_SECONDS + 1
    await store_bytes(usage, 1)
    await run_tasks()
    assert backend.listings == 4, "an old count starts a listing in the background"


async def test_an_old_count_is_used_while_listings_fail(clock: Clock) -> None:
    backend = SharedBackend()
    usage = backend.build_usage(100)
    await store_bytes(usage, 10)
    backend.is_broken = True
    clock.now += STALE_SECONDS + 1
    await store_bytes(usage, 10)
    await run_tasks()
    assert backend.listings == 2, "the listing in the background has failed"
    with pytest.raises(StoreFailed):
        await store_bytes(usage, 90)  # the old count, 20 bytes, is too old for a refusal


async def test_surfaces_stored_during_a_listing_are_counted() -> None:
    backend = SharedBackend()
    usage = backend.build_usage(100)
    await store_bytes(usage, 10)
    backend.bytes = 10
    recount = asyncio.create_task(usage.recount())
    await asyncio.sleep(0)
    await asyncio.sleep(0)  # the listing runs
    await store_bytes(usage, 60)
    await recount
    with pytest.raises(StoreFull):
        await store_bytes(usage, 31)
    await store_bytes(usage, 30)


async def test_a_failed_write_releases_its_bytes() -> None:
    usage = SharedBackend().build_usage(100)
    for _ in range(3):
        with pytest.raises(ZeroDivisionError):
            async with usage.reserve(100):
                raise ZeroDivisionError
    await store_bytes(usage, 100)
