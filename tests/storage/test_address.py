"""Addresses of stores: folders, memory and buckets; invalid addresses are refused at the start."""

import errno
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.main import main
from service.errors import InvalidSettings, StoreFailed
from service.settings.values import Settings
from service.storage import address
from service.storage.address import open_store
from tests.storage.backends import compute_id, list_files, set_account

pytestmark = pytest.mark.anyio
CONTENT = b"content"
NOBODY = 65534


async def is_stored_in(store_address: str, folder: Path) -> bool:
    """True if a content that is stored at this address is then in this folder."""
    await open_store(store_address, quota=0).put(compute_id(CONTENT), CONTENT)
    return [path.name for path in list_files(folder)] == [compute_id(CONTENT)]


async def test_addresses_of_folders_may_be_relative_absolute_or_urls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert await is_stored_in(str(tmp_path / "whole"), tmp_path / "whole")
    assert await is_stored_in("./relative", tmp_path / "relative")
    assert await is_stored_in("~/data", tmp_path / "home" / "data")
    assert await is_stored_in("./s3:", tmp_path / "s3:")
    assert await is_stored_in((tmp_path / "a b").as_uri(), tmp_path / "a b")


@pytest.mark.parametrize(
    ("store_address", "message"),
    [
        ("ftp://host/folder", "needed a folder, or an address that begins with"),
        ("http://127.0.0.1/folder", "begins with file://"),
        ("memory://name", "needed memory:// alone"),
        ("file://folder", "the whole path of a folder"),
        ("file:folder", "the whole path of a folder"),
        ("file://other.machine/folder", "the whole path of a folder"),
        ("s3://", "needed the address of a bucket"),
        ("s3:bucket", "needed the address of a bucket"),
        ("az://container", "needed the address of a bucket"),
        ("fol\0der", "needed a folder"),
        ("/proc/folder", "cannot be kept"),
        (str(Path(__file__)), "Not a directory"),
        ("~nobody-of-this-name/data", "needed a folder"),
    ],
)
def test_invalid_addresses_are_refused(store_address: str, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        open_store(store_address, quota=0)


@contextmanager
def drop_privileges() -> Iterator[None]:
    """Runs the block as another user, because root may write to all folders."""
    is_root = os.geteuid() == 0
    if is_root:
        os.seteuid(NOBODY)
    try:
        yield
    finally:
        if is_root:
            os.seteuid(0)


def test_a_new_store_in_a_folder_without_permission_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    with drop_privileges(), pytest.raises(InvalidSettings, match="Permission denied"):
        open_store(str(tmp_path / "new"), quota=0)


async def test_on_a_full_disk_an_existing_store_opens_and_a_new_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raise_disk_full(path: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    await open_store(str(tmp_path), quota=0).put(compute_id(CONTENT), CONTENT)
    monkeypatch.setattr(address, "make_folder", raise_disk_full)
    store = open_store(str(tmp_path), quota=0)
    assert await store.get(compute_id(CONTENT)) == CONTENT
    with pytest.raises(InvalidSettings, match="No space left"):
        open_store(str(tmp_path / "new"), quota=0)


def test_the_error_of_an_invalid_address_names_the_setting(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InvalidSettings, match="SURFACE_STORE: got 'ftp://x'"):
        create_app(Settings(store="ftp://x"))
    monkeypatch.setenv("SURFACE_STORE", "ftp://x")
    # The command changes the handlers of the root logger; monkeypatch restores them.
    root = logging.getLogger()
    monkeypatch.setattr(root, "handlers", [])
    monkeypatch.setattr(root, "level", root.level)
    assert main(["serve"]) == 2
    assert capsys.readouterr().err.startswith("surface: SURFACE_STORE: got 'ftp://x', needed")


async def test_a_store_in_an_unreachable_bucket_opens_and_is_not_ready() -> None:
    """So the service starts, and reports later that its store does not respond."""
    with set_account("http://127.0.0.1:9"):
        store = open_store("s3://bucket/prefix", quota=0)
        with pytest.raises(StoreFailed):
            await store.get(compute_id(CONTENT))
        assert not await store.is_ready()
