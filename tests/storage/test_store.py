"""The properties of a store, in memory and in a folder."""

import asyncio
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import UnknownSurface
from service.storage.keys import key_of
from service.storage.store import INLINE_BYTES, SurfaceStore
from tests.storage.backends import KINDS, compute_id, store_of

pytestmark = pytest.mark.anyio
CONTENTS = st.binary(max_size=2)
NAMES = [
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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [0, 1, INLINE_BYTES + 1])
async def test_stored_surfaces_are_read_back(kind: str, size: int, tmp_path: Path) -> None:
    content = bytes(index % 251 for index in range(size))
    id = compute_id(content)
    store = store_of(kind, tmp_path)
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
def test_store_is_a_dictionary(kind: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    """A store and a dictionary agree after any sequence of operations."""

    @given(st.lists(st.tuples(st.sampled_from(["put", "delete", "has"]), CONTENTS), max_size=20))
    def check_agreement(steps: list[tuple[str, bytes]]) -> None:
        async def work(store: SurfaceStore) -> None:
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

        asyncio.run(work(store_of(kind, tmp_path_factory.mktemp("store"))))

    check_agreement()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NAMES)
async def test_other_names_lead_nowhere(kind: str, name: str, tmp_path: Path) -> None:
    store = store_of(kind, tmp_path / "store")
    assert not await store.has(name)
    assert not await store.delete(name)
    with pytest.raises(UnknownSurface):
        await store.get(name)
    with pytest.raises(ValueError, match="64 hexadecimal digits"):
        await store.put(name, b"content")


@given(st.text("0aAf/.", min_size=63, max_size=65) | st.text("0af", min_size=64, max_size=64))
def test_only_ids_become_keys(name: str) -> None:
    if len(name) == 64 and set(name) <= set("0123456789abcdef"):
        assert key_of(name).split("/") == ["surfaces", name[:2], name]
    else:
        with pytest.raises(ValueError, match="64 hexadecimal digits"):
            key_of(name)


@pytest.mark.parametrize("kind", KINDS)
async def test_content_goes_under_its_own_hash_only(kind: str, tmp_path: Path) -> None:
    store = store_of(kind, tmp_path)
    with pytest.raises(ValueError, match="not the hash"):
        await store.put(compute_id(b"one"), b"other")
    assert not await store.has(compute_id(b"one"))


@pytest.mark.parametrize("kind", KINDS)
async def test_one_of_many_clients_stores_a_surface_first(kind: str, tmp_path: Path) -> None:
    content = b"the same" * 1000
    store = store_of(kind, tmp_path)
    stored = await asyncio.gather(*(store.put(compute_id(content), content) for _ in range(50)))
    assert sorted(stored) == [False] * 49 + [True]
    assert await store.get(compute_id(content)) == content
