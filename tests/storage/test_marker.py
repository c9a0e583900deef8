"""The marker of a store in a folder: made once, and looked at whenever something could be lost."""

import asyncio
import errno
import json
import os
import shutil
import stat
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from uuid import UUID

import pytest

from service.errors import InvalidSettings, StoreFailed, UnknownSurface
from service.storage import files, folder
from service.storage.address import open_store
from service.storage.folder import Folder
from service.storage.keys import SURFACES
from service.storage.marker import MARKER
from service.storage.store import SurfaceStore
from tests.storage.backends import compute_id, list_files, make_read_only, open_test_store

pytestmark = pytest.mark.anyio
CONTENT, OTHER = b"content", b"another content"
LATER_MARKER = json.dumps({"store": 2, "id": str(UUID(int=7))})


def read_id(root: Path) -> str:
    """The id in the marker of a store."""
    marker = json.loads((root / MARKER).read_text("ascii"))
    assert marker.keys() == {"store", "id"}
    assert marker["store"] == 1
    return str(UUID(marker["id"]))


async def put(store: SurfaceStore, content: bytes) -> bool:
    return await store.put(compute_id(content), content)


def make_older_store(root: Path) -> None:
    """Makes a store as version 0.1.0 does: without a marker."""
    open_test_store("folder", root)
    (root / MARKER).unlink()


def test_a_new_store_gets_a_marker_and_keeps_it(tmp_path: Path) -> None:
    open_test_store("folder", tmp_path)
    id = read_id(tmp_path)
    open_test_store("folder", tmp_path)
    assert read_id(tmp_path) == id
    assert {path.name for path in tmp_path.iterdir()} == {MARKER, "surfaces", "staging"}


def test_an_older_store_gets_a_marker_and_keeps_its_objects(tmp_path: Path) -> None:
    make_older_store(tmp_path)
    store = open_store(str(tmp_path), 0, create=False)
    read_id(tmp_path)
    asyncio.run(put(store, CONTENT))
    (tmp_path / MARKER).unlink()
    assert asyncio.run(open_test_store("folder", tmp_path).get(compute_id(CONTENT))) == CONTENT


def test_stores_that_are_opened_at_the_same_time_have_one_marker(tmp_path: Path) -> None:
    def open_and_put(number: int) -> bool:
        return asyncio.run(put(open_test_store("folder", tmp_path / "store"), b"%d" % number))

    with ThreadPoolExecutor(8) as threads:
        assert all(threads.map(open_and_put, range(8)))
    assert len(list_files(tmp_path)) == 8


def test_a_file_system_without_links_gets_a_marker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", refuse)
    open_test_store("folder", tmp_path)
    id = read_id(tmp_path)
    assert asyncio.run(put(open_test_store("folder", tmp_path), CONTENT))
    assert read_id(tmp_path) == id


def test_a_file_system_that_cannot_sync_folders_gets_a_marker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sync = os.fsync

    def refuse_folders(file: int) -> None:
        if stat.S_ISDIR(os.fstat(file).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        sync(file)

    monkeypatch.setattr(os, "fsync", refuse_folders)
    open_test_store("folder", tmp_path)
    assert read_id(tmp_path)


@pytest.mark.parametrize("is_there", [True, False], ids=["empty", "missing"])
def test_a_store_is_not_made_if_the_operator_forbids_it(tmp_path: Path, is_there: bool) -> None:
    root = tmp_path / "store"
    if is_there:
        root.mkdir()
    with pytest.raises(InvalidSettings, match="and none may be made now"):
        open_store(str(root), 0, create=False)
    assert list(tmp_path.rglob("*")) == [root] * is_there
    open_store(str(root), 0)
    open_store(str(root), 0, create=False)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"store": 1, "id": 7}', LATER_MARKER])
def test_a_store_with_a_damaged_or_later_marker_is_not_opened(tmp_path: Path, text: str) -> None:
    open_test_store("folder", tmp_path)
    (tmp_path / MARKER).write_text(text, "ascii")
    with pytest.raises(InvalidSettings, match=f"{MARKER} is damaged, or of a later version"):
        open_test_store("folder", tmp_path)
    assert (tmp_path / MARKER).read_text("ascii") == text


async def test_an_older_store_that_cannot_be_written_is_served_and_marked_at_the_first_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    make_older_store(tmp_path)
    await put(open_test_store("folder", tmp_path), CONTENT)
    (tmp_path / MARKER).unlink()
    with monkeypatch.context() as patch:
        make_read_only(patch)
        store = open_test_store("folder", tmp_path)
        assert "has no marker yet" in caplog.text
        assert await store.get(compute_id(CONTENT)) == CONTENT
        assert await store.is_ready()
        assert store.writes == "read_only"
        with pytest.raises(StoreFailed):
            await put(store, OTHER)
    assert not (tmp_path / MARKER).exists()
    assert await put(store, OTHER)
    id = read_id(tmp_path)
    # From now on the store knows its id.
    (tmp_path / MARKER).write_text(json.dumps({"store": 1, "id": str(UUID(int=7))}), "ascii")
    with pytest.raises(StoreFailed):
        await put(store, b"third")
    (tmp_path / MARKER).write_text(json.dumps({"store": 1, "id": id}), "ascii")
    assert await put(store, b"third")


def rename_away(root: Path) -> None:
    root.rename(root.parent / "elsewhere")


def unmount(root: Path) -> None:
    """Leaves an empty folder, as a mount point is."""
    rename_away(root)
    root.mkdir()


def mount_another(root: Path) -> None:
    rename_away(root)
    open_test_store("folder", root)


def mount_an_older_store(root: Path) -> None:
    rename_away(root)
    make_older_store(root)


@pytest.mark.parametrize("lose", [rename_away, unmount, mount_another, mount_an_older_store])
async def test_a_lost_folder_is_neither_read_nor_written_nor_made_until_it_is_back(
    tmp_path: Path, lose: Callable[[Path], None]
) -> None:
    root = tmp_path / "store"
    store = open_store(str(root), quota=1000)
    await put(store, CONTENT)
    lose(root)
    paths = set(tmp_path.rglob("*"))

    async def list_all() -> list[object]:
        return [page async for page in store.backend.list(SURFACES)]

    calls: list[Callable[[], Awaitable[object]]] = [
        lambda: put(store, OTHER),
        lambda: store.get(compute_id(CONTENT)),
        lambda: store.has(compute_id(CONTENT)),
        lambda: store.delete(compute_id(CONTENT)),
        store.usage.recount,
    ]
    for call in calls:
        with pytest.raises(StoreFailed):
            await call()
    with pytest.raises(OSError, match="store"):
        await list_all()
    assert not await store.is_ready()
    assert set(tmp_path.rglob("*")) == paths

    shutil.rmtree(root, ignore_errors=True)
    (tmp_path / "elsewhere").rename(root)
    assert await store.get(compute_id(CONTENT)) == CONTENT
    assert await put(store, OTHER)
    with pytest.raises(UnknownSurface):
        await store.get("0" * 64)


@pytest.mark.parametrize("step", ["create_file", "sync_folder"])
async def test_an_object_is_not_lost_if_the_folder_goes_while_it_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    """Either the store that was opened has the object, or storing fails."""
    root = tmp_path / "store"
    store = open_test_store("folder", root)
    original = getattr(files, step)

    def lose_first(*arguments: object) -> None:
        if not (tmp_path / "elsewhere").exists():
            unmount(root)
        original(*arguments)

    monkeypatch.setattr(folder, step, lose_first)
    assert await put(store, CONTENT)
    assert list(root.iterdir()) == []
    root.rmdir()
    (tmp_path / "elsewhere").rename(root)
    assert await store.get(compute_id(CONTENT)) == CONTENT


async def test_a_removed_folder_is_not_made_while_an_object_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "store"
    store = open_test_store("folder", root)

    def remove_first(*arguments: object) -> None:
        shutil.rmtree(root)
        files.create_file(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(folder, "create_file", remove_first)
    with pytest.raises(StoreFailed):
        await put(store, CONTENT)
    assert not root.exists()


def test_buckets_have_no_marker() -> None:
    store = open_store("memory://", 0)
    assert not isinstance(store.backend, Folder)

    async def list_markers() -> list[str]:
        await put(store, CONTENT)
        return [entry.key async for page in store.backend.list("") for entry in page]

    assert asyncio.run(list_markers()) == [
        f"surfaces/{compute_id(CONTENT)[:2]}/{compute_id(CONTENT)}"
    ]
