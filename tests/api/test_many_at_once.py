"""Requests for meshes of one large surface at the same time share the surface."""

import threading
from collections.abc import Callable, Iterator

import pytest
from fastapi import FastAPI

from service.api import by_url, stored
from service.api.app import create_app
from service.api.computation import Computation
from service.api.services import Services
from service.pipeline.mesh import MeshFile, make_file
from service.pipeline.mesh_plan import MeshPlan
from service.settings.values import Settings
from service.storage.canonical import canonical_content, surface_id
from service.storage.store import SurfaceStore
from service.surface.kinds import Surface
from service.surface.sizes import SurfaceKind
from tools.client import Client, start_client

COUNT = 4
"""Requests that are sent together."""
SIDE = 115
"""Control points per side: too many for the event loop, so threads read the surface."""
NET = [[[i, j, (i * j) % 7 / 7] for j in range(SIDE)] for i in range(SIDE)]
LARGE = {"surface": {"type": "bspline", "degree": 1, "control_net": NET}}


@pytest.fixture
def app() -> FastAPI:
    return create_app(Settings(threads=1, allow_delete=True, memory_bytes=1 << 30))


@pytest.fixture
def client(app: FastAPI) -> Iterator[Client]:
    with start_client(app) as client:
        yield client


class MeshCounter:
    """Counts the meshes that are computed at the same time.

    The first mesh waits until all requests have the surface, that is, `has_surface` is released
    `COUNT` times.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.current = self.maximum = 0
        self.has_surface = threading.Semaphore(0)

        def run_and_count(plan: MeshPlan, surface: SurfaceKind) -> MeshFile:
            if not self.maximum:
                for _ in range(COUNT):
                    assert self.has_surface.acquire(timeout=60)
            self.current += 1
            self.maximum = max(self.maximum, self.current)
            file = make_file(plan, surface)
            self.current -= 1
            return file

        monkeypatch.setattr("service.pipeline.mesh.make_file", run_and_count)


def send_together(send: Callable[[int], int]) -> list[int]:
    """The statuses of `COUNT` requests that are sent at the same time; `send` gets their number."""
    statuses: list[int] = []
    threads = [
        threading.Thread(target=lambda number=number: statuses.append(send(number)))
        for number in range(COUNT)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return statuses


@pytest.mark.slow
def test_meshes_of_one_surface_share_it_and_are_computed_one_after_the_other(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    counter = MeshCounter(monkeypatch)
    url = client.post("/v1/surfaces", LARGE).json()["links"]["mesh"]["stl"]
    surface_of, get = stored.surface_of, SurfaceStore.get
    surfaces: list[Surface] = []
    reads: list[str] = []

    async def find_and_record(services: Services, computation: Computation, id: str) -> Surface:
        surfaces.append(await surface_of(services, computation, id))
        counter.has_surface.release()
        return surfaces[-1]

    async def read_and_record(
        store: SurfaceStore, id: str, reserve: Callable[[int], None]
    ) -> bytes:
        reads.append(id)
        return await get(store, id, reserve)

    monkeypatch.setattr(by_url, "surface_of", find_and_record)
    monkeypatch.setattr(SurfaceStore, "get", read_and_record)
    # The resolutions differ, because meshes of equal URLs are computed only once.
    statuses = send_together(
        lambda number: client.get(f"{url}&resolution={number + 1}").status_code
    )
    assert statuses == [200] * COUNT
    assert len(reads) == 1
    assert all(surface is surfaces[0] for surface in surfaces)
    assert counter.maximum == 1


def test_deleted_surfaces_are_not_shared(client: Client, app: FastAPI) -> None:
    services: Services = app.state.services
    url = client.post("/v1/surfaces", LARGE).json()["links"]["self"]
    id = url.rpartition("/")[2]
    computation = Computation(services.threads)  # does not end, so it keeps the surface
    surface = client.call(stored.surface_of, services, computation, id)
    assert client.get(url).status_code == 200
    assert client.request("DELETE", url).status_code == 204
    assert client.get(url).status_code == 404
    assert surface_id(canonical_content(surface)) == id
