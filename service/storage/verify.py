"""Reads every object of a store, and compares its content with the hash in its name."""

import asyncio
import hashlib
from collections.abc import AsyncIterator
from dataclasses import dataclass, field

from service.errors import StoreFailed
from service.storage.backends import Backend, Entry
from service.storage.failures import translate_errors
from service.storage.keys import SURFACES, find_id

READERS, READ_BYTES = 8, 256 << 20
"""Most objects that are read at the same time, and about the most bytes of all of them."""


@dataclass(slots=True)
class Verification:
    """The result of a verification so far.

    Attributes
    ----------
    objects, bytes : int
        Number and bytes of the objects that were read or refused.
    faults : dict of str to str
        For each faulty object, by its key, what is wrong.
    """

    objects: int = 0
    bytes: int = 0
    faults: dict[str, str] = field(default_factory=dict)


async def verify(backend: Backend) -> AsyncIterator[Verification]:
    """Verifies all surfaces of a store; returns the result so far again and again.

    An object that is deleted meanwhile is no fault.

    Raises
    ------
    StoreFailed
        The store cannot be listed.
    """
    result = Verification()
    with translate_errors("listing surfaces"):
        async for page in backend.list(SURFACES):
            for entries in _divide(page):
                faults = await asyncio.gather(*(_find_fault(backend, each) for each in entries))
                for entry, fault in zip(entries, faults, strict=True):
                    result.objects += 1
                    result.bytes += entry.size
                    if fault:
                        result.faults[entry.key] = fault
                yield result


def _divide(page: list[Entry]) -> list[list[Entry]]:
    """Runs of entries that may be read at the same time."""
    runs: list[list[Entry]] = [[]]
    for entry in page:
        size = sum(each.size for each in runs[-1]) + entry.size
        if len(runs[-1]) == READERS or (runs[-1] and size > READ_BYTES):
            runs.append([])
        runs[-1].append(entry)
    return runs


async def _find_fault(backend: Backend, entry: Entry) -> str:
    """The fault of an object in words; empty if it has none."""
    id = find_id(entry.key)
    if id is None:
        return "the name is no id of a surface"
    try:
        with translate_errors(f"reading {entry.key}"):
            try:
                content = await backend.read(entry.key)
            except FileNotFoundError:
                return ""
    except StoreFailed:
        return "it cannot be read"
    digest = await asyncio.to_thread(lambda: hashlib.sha256(content).hexdigest())
    return "" if digest == id else f"{len(content)} bytes of another hash"
