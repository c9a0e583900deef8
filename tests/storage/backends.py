"""Stores and contents for tests."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.storage.address import open_store
from service.storage.keys import key_of
from service.storage.store import SurfaceStore

KINDS = ("memory", "folder")


def compute_id(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def store_of(kind: str, folder: Path, quota: int = 0) -> SurfaceStore:
    return open_store("memory://" if kind == "memory" else str(folder), quota)


def find_file(folder: Path, content: bytes) -> Path:
    """The path of the file of a content in a folder."""
    return folder / key_of(compute_id(content))


def list_files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


@contextmanager
def set_account(url: str) -> Iterator[None]:
    """The environment of a process that may use the S3 server at `url`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", url)
        patch.setenv("AWS_ALLOW_HTTP", "true")
        patch.setenv("AWS_REGION", "us-east-1")
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        yield
