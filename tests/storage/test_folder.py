"""Properties that only a folder has: files, permissions, a disk."""

import os
import stat
import threading
from pathlib import Path

import pytest

from service.errors import StoreFailed, StoreFull
from service.storage.backends import STAGING
from service.storage.keys import key_of
from service.storage.store import SurfaceStore
from tests.storage.backends import compute_id, find_file, list_files, store_of

pytestmark = pytest.mark.anyio
ONE, TWO = b"one", b"two"


async def put_one(store: SurfaceStore) -> bool:
    return await store.put(compute_id(ONE), ONE)


async def test_an_object_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file first; then the folders in which its name and theirs are new."""
    final = find_file(tmp_path, ONE)
    store = store_of("folder", tmp_path)
    synced: list[tuple[int, bool]] = []
    fsync = os.fsync
    loop = threading.get_ident()

    def watched(file: int) -> None:
        assert threading.get_ident() != loop, "the event loop has no time to wait for a disk"
        synced.append((os.fstat(file).st_ino, final.exists()))
        if stat.S_ISREG(os.fstat(file).st_mode):
            assert os.pread(file, 10, 0) == ONE
        fsync(file)

    monkeypatch.setattr(os, "fsync", watched)
    assert await put_one(store)
    assert synced == [
        (final.stat().st_ino, False),
        (final.parent.stat().st_ino, True),
        (final.parent.parent.stat().st_ino, True),
    ]


def test_new_folders_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    fsync = os.fsync

    def watched(file: int) -> None:
        synced.append(os.fstat(file).st_ino)
        fsync(file)

    monkeypatch.setattr(os, "fsync", watched)
    store_of("folder", tmp_path / "a" / "b")
    assert {tmp_path.stat().st_ino, (tmp_path / "a").stat().st_ino} <= set(synced)
    assert synced.count((tmp_path / "a" / "b").stat().st_ino) == 2
    synced.clear()
    store_of("folder", tmp_path / "a" / "b")
    assert synced == []


async def test_a_folder_that_breaks_fails_and_works_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    staging = tmp_path / STAGING
    store = store_of("folder", tmp_path)
    await put_one(store)
    staging.rmdir()
    staging.write_text("no folder")
    with pytest.raises(StoreFailed) as caught:
        await store.put(compute_id(TWO), TWO)
    assert caught.value.issues == ()
    assert key_of(compute_id(TWO)) in caplog.text
    assert "Debug source" not in caplog.text
    assert await store.get(compute_id(ONE)) == ONE
    assert not await store.has(compute_id(TWO))
    staging.unlink()
    assert await store.put(compute_id(TWO), TWO)


async def test_a_write_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some disks report that they are full only when bytes are forced to them."""

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    store = store_of("folder", tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(StoreFull) as caught:
            await put_one(store)
    assert [issue.code for issue in caught.value.issues] == ["disk_full"]
    assert list_files(tmp_path) == []
    assert await put_one(store)


async def test_a_folder_that_is_gone_does_not_answer(tmp_path: Path) -> None:
    store = store_of("folder", tmp_path)
    (tmp_path / "surfaces").rmdir()
    assert not await store.is_ready()
