"""Damaged objects are never sent; storing them again repairs them."""

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

import obstore
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import DamagedObject
from service.storage.keys import key_of
from service.storage.store import INLINE_BYTES, SurfaceStore
from tests.storage.backends import KINDS, compute_id, store_of

pytestmark = pytest.mark.anyio
CONTENT = b"bezier" * 100
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "truncated": lambda content: content[:-1],
    "longer": lambda content: content + b"\0",
    "changed": lambda content: bytes([content[0] ^ 1]) + content[1:],
    "of another": lambda _: b"another surface",
}


async def damage_object(store: SurfaceStore, content: bytes, instead: bytes) -> None:
    await obstore.put_async(store._backend.objects, key_of(compute_id(content)), instead)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("damaged", DAMAGES.values(), ids=DAMAGES)
@pytest.mark.parametrize("content", [CONTENT, b"x" * (INLINE_BYTES + 1)], ids=["short", "long"])
async def test_damaged_object(
    kind: str,
    damaged: Callable[[bytes], bytes],
    content: bytes,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    id = compute_id(content)
    store = store_of(kind, tmp_path)
    assert await store.put(id, content)
    await damage_object(store, content, damaged(content))
    with pytest.raises(DamagedObject), caplog.at_level(logging.ERROR):
        await store.get(id)
    assert key_of(id) in caplog.text
    assert await store.has(id)
    assert await store.put(id, content), "mended"
    assert await store.get(id) == content
    await damage_object(store, content, damaged(content))
    assert await store.delete(id)
    assert not await store.has(id)


@given(st.binary(min_size=1, max_size=64), st.binary(max_size=64))
def test_other_contents_are_never_sent(content: bytes, instead: bytes) -> None:
    async def work(store: SurfaceStore) -> None:
        await damage_object(store, content, instead)
        try:
            assert await store.get(compute_id(content)) == content
        except DamagedObject:
            assert instead != content

    asyncio.run(work(store_of("memory", Path())))
