"""Opens stores for tests, and gives the paths of the files in which they keep their contents."""

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from service.storage.address import open_store
from service.storage.keys import key_of
from service.storage.marker import MARKER
from service.storage.store import SurfaceStore
from service.storage.watch import PROBE_KEY

KINDS = ("memory", "folder")


def compute_id(content: bytes) -> str:
    """The id under which a content is stored: its SHA-256 in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def open_test_store(kind: str, folder: Path, quota: int = 0) -> SurfaceStore:
    """A store of this kind, in memory or in the folder; a quota of 0 means no limit."""
    return open_store("memory://" if kind == "memory" else str(folder), quota)


def compute_path(folder: Path, content: bytes) -> Path:
    """The path at which a store in this folder keeps a content, or would keep it."""
    return folder / key_of(compute_id(content))


def list_files(folder: Path) -> list[Path]:
    """All files of objects, complete or not, in a folder and in its subfolders."""
    own_files = {MARKER, PROBE_KEY}
    return [path for path in folder.rglob("*") if path.is_file() and path.name not in own_files]


def make_read_only(patch: pytest.MonkeyPatch) -> None:
    """Makes all file systems read-only for new files, in this process."""
    original = os.open

    def open_existing(path: str, flags: int, *arguments: Any, **options: Any) -> int:
        if flags & os.O_CREAT:
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), path)
        return original(path, flags, *arguments, **options)

    patch.setattr(os, "open", open_existing)


@contextmanager
def set_account(url: str) -> Iterator[None]:
    """Sets the environment variables of an account of the S3 server at `url`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", url)
        patch.setenv("AWS_ALLOW_HTTP", "true")
        patch.setenv("AWS_REGION", "us-east-1")
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        yield
