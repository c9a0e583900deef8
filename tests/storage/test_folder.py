"""A store in a folder: files reach the disk, and errors of the disk leave no partial files."""

import errno
import os
import stat
import threading
from pathlib import Path

import pytest

from service.errors import StoreFailed, StoreFull
from service.storage.folder import STAGING
from service.storage.keys import key_of
from service.storage.store import SurfaceStore
from tests.storage.backends import compute_id, compute_path, list_files, open_test_store

pytestmark = pytest.mark.anyio
FIRST, SECOND = b"first", b"second"


async def put_first(store: SurfaceStore) -> bool:
    return await store.put(compute_id(FIRST), FIRST)


async def test_an_object_is_on_the_disk_before_its_file_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """First the file is synced, then the folders that have a new entry."""
    final_path = compute_path(tmp_path, FIRST)
    store = open_test_store("folder", tmp_path)
    synced_files: list[tuple[int, bool]] = []
    fsync = os.fsync
    event_loop_thread = threading.get_ident()

    def record_and_sync(file: int) -> None:
        assert threading.get_ident() != event_loop_thread, "the event loop must not wait for a disk"
        synced_files.append((os.fstat(file).st_ino, final_path.exists()))
        if stat.S_ISREG(os.fstat(file).st_mode):
            assert Path(f"/proc/self/fd/{file}").read_bytes() == FIRST
        fsync(file)

    monkeypatch.setattr(os, "fsync", record_and_sync)
    assert await put_first(store)
    assert synced_files == [
        (final_path.stat().st_ino, False),
        (final_path.parent.stat().st_ino, True),
        (final_path.parent.parent.stat().st_ino, True),
        (tmp_path.stat().st_ino, True),
    ]


def test_new_folders_of_a_store_are_synced_only_when_it_is_first_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced_files: list[int] = []
    fsync = os.fsync

    def record_and_sync(file: int) -> None:
        synced_files.append(os.fstat(file).st_ino)
        fsync(file)

    monkeypatch.setattr(os, "fsync", record_and_sync)
    open_test_store("folder", tmp_path / "a" / "b")
    assert {tmp_path.stat().st_ino, (tmp_path / "a").stat().st_ino} <= set(synced_files)
    # It has two new folders, `surfaces` and `staging`, and a marker; it is synced after each.
    assert synced_files.count((tmp_path / "a" / "b").stat().st_ino) == 3
    synced_files.clear()
    open_test_store("folder", tmp_path / "a" / "b")
    assert synced_files == []


async def test_a_store_whose_staging_folder_breaks_fails_and_works_again_later(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    staging = tmp_path / STAGING
    store = open_test_store("folder", tmp_path)
    await put_first(store)
    staging.rmdir()
    staging.write_text("no folder")
    with pytest.raises(StoreFailed) as error:
        await store.put(compute_id(SECOND), SECOND)
    assert error.value.issues == ()
    assert key_of(compute_id(SECOND)) in caplog.text
    # obstore appends a description of its internal objects, which begins with these words.
    assert "Debug source" not in caplog.text
    assert await store.get(compute_id(FIRST)) == FIRST
    assert not await store.has(compute_id(SECOND))
    staging.unlink()
    assert await store.put(compute_id(SECOND), SECOND)


async def test_a_failed_write_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some disks report only at `fsync` that they are full."""

    def raise_disk_full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    store = open_test_store("folder", tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", raise_disk_full)
        with pytest.raises(StoreFull) as error:
            await put_first(store)
    assert [issue.code for issue in error.value.issues] == ["disk_full"]
    assert list_files(tmp_path) == []
    assert await put_first(store)


async def test_a_store_whose_folder_is_removed_is_not_ready(tmp_path: Path) -> None:
    store = open_test_store("folder", tmp_path)
    (tmp_path / "surfaces").rmdir()
    assert not await store.is_ready()
