"""A store counts its operations and their seconds, by kind and by outcome."""

import hashlib
from pathlib import Path

import pytest

from service.errors import DamagedObject, StoreFull, UnknownSurface
from service.storage.address import open_store
from service.storage.keys import key_of

CONTENT = b"content"
ID = hashlib.sha256(CONTENT).hexdigest()


@pytest.mark.anyio
async def test_operations_are_counted_by_kind_and_outcome(tmp_path: Path) -> None:
    store = open_store(str(tmp_path), quota=10)
    assert await store.put(ID, CONTENT)
    assert not await store.put(ID, CONTENT)
    with pytest.raises(StoreFull):
        await store.put(hashlib.sha256(b"x" * 20).hexdigest(), b"x" * 20)
    assert await store.get(ID) == CONTENT
    assert not await store.has("0" * 64)
    with pytest.raises(UnknownSurface):
        await store.get("0" * 64)
    (tmp_path / key_of(ID)).write_bytes(b"another")
    with pytest.raises(DamagedObject):
        await store.get(ID)
    assert await store.delete(ID)
    assert await store.is_ready()
    totals = store.operations.totals
    assert {key: total.count for key, total in totals.items()} == {
        ("put", "done"): 2,
        ("put", "refused"): 1,
        ("get", "done"): 2,  # an unknown surface is no failure
        ("get", "failed"): 1,
        ("has", "done"): 1,
        ("delete", "done"): 1,
        ("ask", "done"): 1,  # by `is_ready`
        ("probe", "done"): 1,
    }
    assert all(total.seconds > 0 for total in totals.values())
    assert store.usage.used == 0
