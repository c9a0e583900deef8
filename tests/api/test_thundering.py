"""Many clients request one mesh at the same time before it is cached: it is computed once."""

import asyncio
import threading
from collections.abc import Mapping

import httpx
import pytest

from service.api import by_url
from service.api.app import create_app
from service.api.caching.codings import Coding, compress
from service.engine.mesh.mesh import ENGINE
from service.pipeline.mesh import MeshFile, make_file
from service.pipeline.mesh_plan import MeshPlan
from service.settings.values import Settings
from service.surface.sizes import SurfaceKind

TEAPOT = "/v1/surfaces/utah-teapot/mesh.glb"
"""With 32 divisions per patch, a thread computes the mesh, not the event loop."""


async def request_at_once(
    monkeypatch: pytest.MonkeyPatch, urls: list[str], headers: Mapping[str, str]
) -> tuple[list[httpx.Response], int]:
    """The responses to 25 requests for each URL, and the number of computed meshes.

    The computation waits until all requests are sent.
    """
    calls, all_sent = list[MeshPlan](), threading.Event()

    def run_when_all_are_sent(plan: MeshPlan, surface: SurfaceKind) -> MeshFile:
        calls.append(plan)
        assert all_sent.wait(60)
        return make_file(plan, surface)

    monkeypatch.setattr("service.pipeline.mesh.make_file", run_when_all_are_sent)
    transport = httpx.ASGITransport(create_app(Settings()))
    async with httpx.AsyncClient(transport=transport, base_url="http://service") as client:
        tasks = [asyncio.create_task(client.get(url, headers=headers)) for url in urls * 25]
        while not calls:
            await asyncio.sleep(0.001)
        assert (await client.get("/health/live")).status_code == 200
        await asyncio.sleep(0.05)
        assert not any(task.done() for task in tasks)
        all_sent.set()
        return await asyncio.gather(*tasks), len(calls)


def test_many_clients_compute_a_mesh_once_in_any_spelling_of_its_url(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    urls = [
        f"{TEAPOT}?resolution=32&engine={ENGINE}",
        f"{TEAPOT}?engine={ENGINE}&resolution=32,32",
        f"{TEAPOT}?resolution=32&oogl=bez",  # GLB ignores `oogl`
        f"{TEAPOT}?weld=true&resolution=032",
    ]
    responses, computed_meshes = asyncio.run(
        request_at_once(monkeypatch, urls, {"Accept-Encoding": "identity"})
    )
    assert [response.status_code for response in responses] == [200] * 100
    assert len({response.content for response in responses}) == 1
    assert computed_meshes == 1


def test_a_mesh_is_compressed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    codings: list[Coding] = []

    def compress_and_count(coding: Coding, content: bytes) -> bytes | None:
        codings.append(coding)
        return compress(coding, content)

    monkeypatch.setattr(by_url, "compress", compress_and_count)
    urls = [f"{TEAPOT}?resolution=32"]
    responses, computed_meshes = asyncio.run(
        request_at_once(monkeypatch, urls, {"Accept-Encoding": "gzip"})
    )
    assert {response.content[:4] for response in responses} == {b"glTF"}
    assert (computed_meshes, codings) == (1, ["gzip"])
