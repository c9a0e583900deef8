"""Files that hang, as on a network file system whose server is gone, do not block other files.

A FIFO hangs in the same way: to open it for reading waits until another process writes to it.
"""

import asyncio
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.errors import DamagedObject, StoreFailed
from service.storage import folder
from service.storage import store as store_module
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
