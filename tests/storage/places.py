"""Stores to try things on, and contents to put there."""

import asyncio
import hashlib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

from service.storage.address import open_store
from service.storage.keys import key_of
from service.storage.store import SurfaceStore

Result = TypeVar("Result")
KINDS = ("memory", "folder")


def id_of(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def store_of(kind: str, folder: Path, quota: int = 0) -> SurfaceStore:
    return open_store("memory://" if kind == "memory" else str(folder), quota)


def on(store: SurfaceStore, work: Callable[[SurfaceStore], Awaitable[Result]]) -> Result:
    """What a coroutine on the store returns, on an event loop of its own."""

    async def run() -> Result:
        return await work(store)

    return asyncio.run(run())


def file_of(folder: Path, content: bytes) -> Path:
    """Where a folder keeps a content."""
    return folder / key_of(id_of(content))


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]
