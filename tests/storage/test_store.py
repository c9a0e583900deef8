"""A store, in memory and in a folder: contents are kept under their hashes."""

import asyncio
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import UnknownSurface
from service.storage.keys import key_of
from service.storage.store import INLINE_BYTES, SurfaceStore
from tests.storage.backends import KINDS, compute_id, open_test_store

pytestmark = pytest.mark.anyio
CONTENTS = st.binary(max_size=2)
INVALID_NAMES = [
    "",
    "../../etc/passwd",
    "a" * 63,
    "a" * 65,
    "A" * 64,
    "g" * 64,
    "٠" * 64,  # digits, but not those of hexadecimal numbers
    "a" * 64 + "\n",
    "../" + "a" * 61,
    "a" * 32 + "/" + "a" * 31,
    "a" * 62 + "#1",
    "a" * 63 + "\0",
]
"""Texts that are not ids."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [0, 1, INLINE_BYTES + 1])  # a thread hashes the largest
async def test_stored_surfaces_are_read_back(kind: str, size: int, tmp_path: Path) -> None:
    content = bytes(index % 251 for index in range(size))
    id = compute_id(content)
    store = open_test_store(kind, tmp_path)
    assert not await store.has(id)
    assert await store.put(id, content)
    assert not await store.put(id, content)
    assert await store.has(id)
    assert await store.get(id) == content
    assert await store.delete(id)
    assert not await store.delete(id)
    assert not await store.has(id)
    with pytest.raises(UnknownSurface):
        await store.get(id)


@pytest.mark.parametrize("kind", KINDS)
def test_a_store_works_like_a_dictionary(
    kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """After any sequence of operations, a store and a dictionary have the same contents."""

    @given(st.lists(st.tuples(st.sampled_from(["put", "delete", "has"]), CONTENTS), max_size=20))
    def compare_with_dictionary(steps: list[tuple[str, bytes]]) -> None:
        async def perform_steps(store: SurfaceStore) -> None:
            model: dict[str, bytes] = {}
            for step, content in steps:
                id = compute_id(content)
                if step == "put":
                    assert await store.put(id, content) is (id not in model)
                    model[id] = content
                elif step == "delete":
                    assert await store.delete(id) is (model.pop(id, None) is not None)
                assert await store.has(id) is (id in model)
            for id, content in model.items():
                assert await store.get(id) == content

        asyncio.run(perform_steps(open_test_store(kind, tmp_path_factory.mktemp("store"))))

    compare_with_dictionary()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", INVALID_NAMES)
async def test_names_that_are_not_ids_reach_nobackend(kind: str, name: str, tmp_path: Path) -> None:
    store = open_test_store(kind, tmp_path / "store")
    for call in (store.has(name), store.delete(name), store.get(name), store.put(name, b"content")):
        with pytest.raises(ValueError, match="64 hexadecimal digits"):
            await call


@given(st.text("0aAf/.", min_size=63, max_size=65) | st.text("0af", min_size=64, max_size=64))
def test_only_ids_become_keys(name: str) -> None:
    if len(name) == 64 and set(name) <= set("0123456789abcdef"):
        assert key_of(name).split("/") == ["surfaces", name[:2], name]
    else:
        with pytest.raises(ValueError, match="64 hexadecimal digits"):
            key_of(name)


@pytest.mark.parametrize("kind", KINDS)
async def test_a_content_is_stored_only_under_its_own_hash(kind: str, tmp_path: Path) -> None:
    store = open_test_store(kind, tmp_path)
    with pytest.raises(ValueError, match="not the hash"):
        await store.put(compute_id(b"one"), b"other")
    assert not await store.has(compute_id(b"one"))


@pytest.mark.parametrize("kind", KINDS)
async def test_of_many_equal_requests_only_the_first_stores_the_content(
    kind: str, tmp_path: Path
) -> None:
    content = b"the same" * 1000
    store = open_test_store(kind, tmp_path)
    results = await asyncio.gather(*(store.put(compute_id(content), content) for _ in range(50)))
    assert sorted(results) == [False] * 49 + [True]
    assert await store.get(compute_id(content)) == content
