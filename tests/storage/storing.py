"""Stores 200 contents in a folder, and prints the id of each.

`python -m tests.storage.storing FOLDER` prints an id as one line when the content is stored.
"""

import asyncio
import sys
from collections.abc import Iterator

from service.storage.address import open_store
from tests.storage.backends import compute_id

CONTENT_COUNT = 200
AT_ONCE = 8  # contents that are stored at the same time


def generate_contents() -> Iterator[bytes]:
    """Different contents, most of them short; every twentieth has half a megabyte."""
    for index in range(CONTENT_COUNT):
        size = 1 << 19 if index % 20 == 0 else 100 + index
        yield f"{index:6d}".encode() * (size // 6)


async def store_all(folder: str) -> None:
    store = open_store(folder, 1 << 30)
    contents = generate_contents()

    async def store_next() -> None:
        for content in contents:
            id = compute_id(content)
            await store.put(id, content)
            print(id, flush=True)

    await asyncio.gather(*(store_next() for _ in range(AT_ONCE)))


if __name__ == "__main__":
    asyncio.run(store_all(sys.argv[1]))
