"""Hundreds of clients at once at one address that nobody has asked for before; on a real server."""

import asyncio
import threading
from collections import Counter
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from service.api.caching.codings import Coding, compressed
from service.api.routes import meshes_by_url
from service.engine.mesh import ENGINE
from service.pipeline.mesh import Answer, MeshWork
from service.settings.values import Settings
from tests.live import running_service
from tests.packed import unpacked_zstd

COUNT = 300
TEAPOT = "/v1/surfaces/utah-teapot/mesh.glb"
"""Large enough, at twelve divisions, to be computed in a thread."""


class Spy:
    """Counts how often a mesh is computed; the work waits until it is let go."""

    def __init__(self) -> None:
        self.calls = 0
        self.gate = threading.Event()
        self._answer = MeshWork.run

    def __call__(self, work: MeshWork) -> Answer:
        self.calls += 1
        assert self.gate.wait(60)
        return self._answer(work)


@pytest.fixture
def server() -> Iterator[str]:
    """A service that has answered nothing yet."""
    with running_service(Settings()) as url:
        yield url


def spied(monkeypatch: pytest.MonkeyPatch, spy: Spy) -> Spy:
    def answer(work: MeshWork) -> Answer:
        return spy(work)

    monkeypatch.setattr(MeshWork, "run", answer)
    return spy


class Connection:
    """One client: a request, and what is answered."""

    async def open(self, server: str, address: str, *headers: str) -> None:
        where = urlsplit(server)
        self.reader, self.writer = await asyncio.open_connection(where.hostname, where.port)
        lines = (f"GET {address} HTTP/1.1", "Host: x", "Connection: close", *headers, "", "")
        self.writer.write("\r\n".join(lines).encode())
        await self.writer.drain()

    async def answer(self) -> tuple[int, bytes]:
        """Status and body."""
        text = await self.reader.read(-1)
        self.writer.close()
        head, _, body = text.partition(b"\r\n\r\n")
        return int(head.split(b" ")[1]), body


async def crowd(
    server: str,
    addresses: list[str],
    spy: Spy,
    *,
    coding: str = "identity",
    count: int = 200,
) -> list[tuple[int, bytes]]:
    """All of them connected and waiting before the work may go on; then their answers."""
    connections = [Connection() for _ in range(count)]
    for start in range(0, count, 100):
        chunk = connections[start : start + 100]
        places = range(start, start + 100)
        await asyncio.gather(
            *(
                c.open(server, addresses[i % len(addresses)], f"Accept-Encoding: {coding}")
                for i, c in zip(places, chunk, strict=True)
            )
        )
    # The server has read them all: it answers those that came later.
    health = Connection()
    await health.open(server, "/health/live")
    assert (await health.answer())[0] == 200
    spy.gate.set()
    return await asyncio.gather(*(c.answer() for c in connections))


def test_hundreds_at_once_compute_once_in_whatever_spelling(
    server: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spy = spied(monkeypatch, Spy())
    addresses = [
        f"{TEAPOT}?resolution=12&engine={ENGINE}",
        f"{TEAPOT}?engine={ENGINE}&resolution=12,12",
        f"{TEAPOT}?resolution=12&oogl=bez",
        f"{TEAPOT}?weld=true&resolution=012",
    ]
    answers = asyncio.run(crowd(server, addresses, spy, count=COUNT))
    assert Counter(status for status, _ in answers) == {200: COUNT}
    assert len({body for _, body in answers}) == 1
    assert spy.calls == 1


def test_what_is_compressed_is_compressed_once(
    server: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spy, codings = spied(monkeypatch, Spy()), []

    def counted(coding: Coding, content: bytes) -> bytes | None:
        codings.append(coding)
        return compressed(coding, content)

    monkeypatch.setattr(meshes_by_url, "compressed", counted)
    answers = asyncio.run(crowd(server, [f"{TEAPOT}?resolution=12"], spy, coding="zstd"))
    (body,) = {body for _, body in answers}
    assert unpacked_zstd(body)[:4] == b"glTF"
    assert (spy.calls, codings) == (1, ["zstd"])
