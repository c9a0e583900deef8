"""Damaged objects are never sent; storing them again repairs them."""

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import DamagedObject
from service.storage.keys import key_of
from service.storage.store import INLINE_BYTES, SurfaceStore
from tests.storage.backends import KINDS, compute_id, open_test_store

pytestmark = pytest.mark.anyio
CONTENT = b"bezier" * 100
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "truncated": lambda content: content[:-1],
    "longer": lambda content: content + b"\0",
    "changed": lambda content: bytes([content[0] ^ 1]) + content[1:],
    "of another surface": lambda _: b"another surface",
}


async def replace_object(store: SurfaceStore, content: bytes, new_content: bytes) -> None:
    """Writes other bytes to the object that a store keeps for a content."""
    await store.backend.write(key_of(compute_id(content)), new_content)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
# The event loop hashes the short content itself; a thread hashes the long one.
@pytest.mark.parametrize("content", [CONTENT, b"x" * (INLINE_BYTES + 1)], ids=["short", "long"])
async def test_a_damaged_object_is_refused_and_replaced_when_stored_again(
    kind: str,
    damage: Callable[[bytes], bytes],
    content: bytes,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    id = compute_id(content)
    store = open_test_store(kind, tmp_path)
    assert await store.put(id, content)
    await replace_object(store, content, damage(content))
    with pytest.raises(DamagedObject), caplog.at_level(logging.ERROR):
        await store.get(id)
    assert key_of(id) in caplog.text
    assert await store.has(id)
    assert await store.put(id, content), "storing again replaces the object"
    assert await store.get(id) == content
    await replace_object(store, content, damage(content))
    assert await store.delete(id)
    assert not await store.has(id)


@given(st.binary(min_size=1, max_size=64), st.binary(max_size=64))
def test_a_content_under_another_id_is_never_returned(content: bytes, other_content: bytes) -> None:
    async def replace_and_read(store: SurfaceStore) -> None:
        await replace_object(store, content, other_content)
        try:
            assert await store.get(compute_id(content)) == content
        except DamagedObject:
            assert other_content != content

    asyncio.run(replace_and_read(open_test_store("memory", Path())))
