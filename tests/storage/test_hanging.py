"""Files that hang, as on a network file system whose server is gone, do not block other files.

A FIFO hangs in the same way: to open it for reading waits until another process writes to it.
"""

import asyncio
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.errors import DamagedObject, StoreFailed
from service.storage import folder
from service.storage import store as store_module
from service.storage import threads as threads_module
from service.storage.backends import Entry
from service.storage.slots import Slots
from service.storage.threads import MAX_THREADS, FileThreads
from tests.storage.backends import compute_id, compute_path, open_test_store

pytestmark = pytest.mark.anyio
CONTENTS = [b"%d" % number for number in range(13)]
*HUNG, INTACT = CONTENTS


@contextmanager
def make_hang(root: Path, contents: list[bytes]) -> Iterator[None]:
    """Replaces the files of these contents by files that hang until the block ends."""
    paths = [compute_path(root, content) for content in contents]
    for path in paths:
        path.unlink()
        os.mkfifo(path)
    try:
        yield
    finally:
        for path in paths:
            os.close(os.open(path, os.O_RDWR))  # wakes all readers


async def test_twelve_files_that_hang_block_other_files_for_a_moment_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_module, "PATIENCE", 0.02)
    store = open_test_store("folder", tmp_path)
    for content in CONTENTS:
        await store.put(compute_id(content), content)
    with make_hang(tmp_path, HUNG):
        reads = [asyncio.create_task(store.get(compute_id(content))) for content in HUNG]
        for content in CONTENTS[-1:] * 20:
            assert await asyncio.wait_for(store.get(compute_id(content)), 10) == content
        assert await store.put(compute_id(b"new"), b"new")
        assert await store.is_ready()
        assert not any(read.done() for read in reads)
    for read in reads:
        with pytest.raises(DamagedObject):  # the FIFO was empty
            await read


async def test_a_file_that_hangs_takes_one_thread_however_often_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(folder, "READ_DEADLINE", 0.02)
    store = open_test_store("folder", tmp_path)
    await store.put(compute_id(INTACT), INTACT)
    with make_hang(tmp_path, [INTACT]):
        for _ in range(3):
            with pytest.raises(StoreFailed):
                await store.get(compute_id(INTACT))
        assert caplog.text.count("an earlier operation on this file has not ended") == 2
    monkeypatch.setattr(folder, "READ_DEADLINE", 20)
    compute_path(tmp_path, INTACT).unlink()
    compute_path(tmp_path, INTACT).write_bytes(INTACT)
    while True:
        try:
            assert await store.get(compute_id(INTACT)) == INTACT
            break
        except StoreFailed:  # the thread that hung has not ended yet
            await asyncio.sleep(0.001)


async def test_work_that_was_cancelled_before_it_began_does_not_hang() -> None:
    threads = FileThreads()
    may_end = asyncio.Event()
    loop = asyncio.get_running_loop()

    def wait(_: str) -> None:
        asyncio.run_coroutine_threadsafe(may_end.wait(), loop).result()

    tasks = [asyncio.create_task(threads.run(f"{number}", wait)) for number in range(MAX_THREADS)]
    await asyncio.sleep(0)
    late = asyncio.create_task(threads.run("late", len))
    await asyncio.sleep(0)
    late.cancel()
    may_end.set()
    await asyncio.gather(*tasks)
    assert await threads.run("late", len) == 4


class Blocking:
    """Work in a thread that begins at once, and ends when a test says so."""

    def __init__(self) -> None:
        self.has_begun, self.may_end = threading.Event(), threading.Event()

    def __call__(self, *_: object) -> int:
        self.has_begun.set()
        assert self.may_end.wait(60)
        return 1

    async def start_and_cancel(self, threads: FileThreads) -> None:
        task = asyncio.create_task(threads.run("file", self))
        await asyncio.to_thread(self.has_begun.wait)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task


async def test_work_whose_request_was_cancelled_delays_further_work_on_its_file_only() -> None:
    threads, work = FileThreads(), Blocking()
    await work.start_and_cancel(threads)
    later = [asyncio.create_task(threads.run("file", len)) for _ in range(3)]
    assert await threads.run("other", len) == 5
    assert not any(task.done() for task in later)
    work.may_end.set()
    assert await asyncio.gather(*later) == [4, 4, 4]
    assert not threads._left


async def test_work_whose_request_was_cancelled_hangs_after_a_while(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(threads_module, "LEFT_SECONDS", 0.02)
    threads, work = FileThreads(), Blocking()
    await work.start_and_cancel(threads)
    with pytest.raises(TimeoutError, match="has not ended"):
        await threads.run("file", len)
    work.may_end.set()


async def test_a_listing_that_was_cancelled_does_not_make_a_store_unready(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_test_store("folder", tmp_path)
    work = Blocking()

    def walk(*_: object) -> Iterator[Entry]:
        yield Entry("surfaces/x", work(), 0.0)

    monkeypatch.setattr(folder, "walk", walk)
    listing = asyncio.create_task(store.list())
    await asyncio.to_thread(work.has_begun.wait)
    listing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await listing
    assert await store.is_ready()
    work.may_end.set()


async def test_a_limited_number_of_long_operations_give_their_slots_away() -> None:
    slots = Slots(count=1, patience=0.0, most=2)
    may_end = asyncio.Event()
    began = []

    async def operate(number: int) -> None:
        async with slots.hold():
            began.append(number)
            await may_end.wait()

    tasks = [asyncio.create_task(operate(number)) for number in range(5)]
    for _ in range(100):
        await asyncio.sleep(0)
    # Two are long and have given their slots away, a third keeps its slot.
    assert began == [0, 1, 2]
    may_end.set()
    await asyncio.gather(*tasks)
    assert began == [0, 1, 2, 3, 4]
