"""The backends: objects under keys of any prefix, as the store and the jobs use them."""

from pathlib import Path

import pytest

from service.storage.backends import Backend
from tests.storage.backends import KINDS, open_test_store

pytestmark = pytest.mark.anyio


@pytest.fixture(params=KINDS)
def backend(request: pytest.FixtureRequest, tmp_path: Path) -> Backend:
    return open_test_store(request.param, tmp_path).backend


async def list_keys(backend: Backend, prefix: str, after: str = "") -> list[str]:
    return [entry.key async for entries in backend.list(prefix, after) for entry in entries]


@pytest.mark.parametrize("durable", [True, False])
async def test_objects_are_written_replaced_read_and_deleted(
    backend: Backend, durable: bool
) -> None:
    key = "jobs/ab/askers/name"
    with pytest.raises(FileNotFoundError):
        await backend.read(key)
    with pytest.raises(FileNotFoundError):
        await backend.head(key)
    await backend.write(key, b"first", durable=durable)
    await backend.write(key, b"", durable=durable)
    assert await backend.read(key) == b""
    content = bytes(3_000_000)
    await backend.write(key, content, durable=durable)
    assert await backend.read(key) == content
    assert (await backend.head(key)).size == len(content)
    await backend.delete(key)
    assert await list_keys(backend, "jobs") == []
    with pytest.raises(FileNotFoundError):
        await backend.head(key)
    with pytest.raises(FileNotFoundError):
        await backend.head("jobs")


async def test_nothing_is_read_if_the_reservation_of_memory_fails(backend: Backend) -> None:
    await backend.write("parts/ab/c", b"content")
    sizes: list[int] = []
    assert await backend.read("parts/ab/c", sizes.append) == b"content"
    assert sizes == [7]

    def refuse(_: int) -> None:
        raise MemoryError

    with pytest.raises(MemoryError):
        await backend.read("parts/ab/c", refuse)


async def test_a_listing_is_in_the_order_of_the_keys_and_begins_after_a_key(
    backend: Backend,
) -> None:
    keys = ["jobs/a.b", "jobs/a/c", "jobs/a/d/e", "jobs/a0", "jobs/b/a", "jobs/b/b"]
    for key in reversed(keys):
        await backend.write(key, key.encode(), durable=False)
    await backend.write("parts/x", b"", durable=False)
    assert await list_keys(backend, "jobs") == keys
    for place, key in enumerate(keys):
        assert await list_keys(backend, "jobs", key) == keys[place + 1 :]
        assert await list_keys(backend, "jobs", key + "\N{MIDDLE DOT}") == keys[place + 1 :]
    assert await list_keys(backend, "jobs/a") == ["jobs/a/c", "jobs/a/d/e"]
    assert await list_keys(backend, "nothing") == []
    entries = [entry async for page in backend.list("jobs") for entry in page]
    assert [entry.size for entry in entries] == [len(key) for key in keys]
    head = await backend.head(keys[0])
    assert entries[0] == head


async def test_a_folder_has_no_keys_outside_itself(tmp_path: Path) -> None:
    (tmp_path / "outside").write_bytes(b"secret")
    backend = open_test_store("folder", tmp_path / "store").backend
    for key in ("../outside", "jobs/../../outside", str(tmp_path / "outside"), "jobs//a", "."):
        with pytest.raises(ValueError, match="a key has names"):
            await backend.read(key)
        with pytest.raises(ValueError, match="a key has names"):
            await backend.write(key, b"")
