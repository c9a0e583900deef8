"""Many large requests at the same time: waiting requests take little memory."""

import threading
from collections.abc import Callable, Iterator

import pytest
from fastapi import FastAPI

from service.api import stored
from service.api.app import create_app
from service.api.routes import meshes_by_url
from service.api.services import Services
from service.api.stored import Stored
from service.api.workers import Job
from service.pipeline.mesh import MeshFile, MeshWork
from service.settings.values import Settings
from service.storage.store import SurfaceStore
from tests.api.client import Client, start_client

COUNT = 4
SIDE = 115
"""The surface is too long for the event loop, as JSON and in its stored form."""
NET = [[[i, j, (i * j) % 7 / 7] for j in range(SIDE)] for i in range(SIDE)]
LARGE = {"surface": {"type": "bspline", "degree": 1, "control_net": NET}}


@pytest.fixture
def app() -> FastAPI:
    return create_app(Settings(threads=1, allow_delete=True, memory_bytes=1 << 30))


@pytest.fixture
def client(app: FastAPI) -> Iterator[Client]:
    with start_client(app) as client:
        yield client


class Watch:
    """Counts surfaces that are lowered at the same time; the first mesh waits for all requests."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = self.most = 0
        self.came = threading.Semaphore(0)
        run = MeshWork.run

        def watched(work: MeshWork) -> MeshFile:
            if not self.most:
                for _ in range(COUNT):
                    assert self.came.acquire(timeout=60)
            self.now += 1
            self.most = max(self.most, self.now)
            response = run(work)
            self.now -= 1
            return response

        monkeypatch.setattr(MeshWork, "run", watched)


def send_together(ask: Callable[[int], int]) -> list[int]:
    """The statuses of requests that are sent at the same time."""
    statuses: list[int] = []
    asking = [
        threading.Thread(target=lambda each=each: statuses.append(ask(each)))
        for each in range(COUNT)
    ]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    return statuses


def test_meshes_of_one_surface_share_it_and_wait_as_control_points(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch = Watch(monkeypatch)
    url = client.post("/v1/surfaces", LARGE).json()["links"]["mesh"]["stl"]
    find, get = stored.surface_of, SurfaceStore.get
    seen: list[Stored] = []
    reads: list[str] = []

    async def found(services: Services, job: Job, id: str) -> Stored:
        seen.append(await find(services, job, id))
        watch.came.release()
        return seen[-1]

    async def read(store: SurfaceStore, id: str, announced: Callable[[int], None]) -> bytes:
        reads.append(id)
        return await get(store, id, announced)

    monkeypatch.setattr(meshes_by_url, "surface_of", found)
    monkeypatch.setattr(SurfaceStore, "get", read)
    statuses = send_together(lambda each: client.get(f"{url}&resolution={each + 1}").status_code)
    assert statuses == [200] * COUNT
    assert len(reads) == 1
    assert all(each is seen[0] for each in seen)
    assert watch.most == 1


def test_deleted_surfaces_are_not_shared(client: Client, app: FastAPI) -> None:
    services: Services = app.state.services
    url = client.post("/v1/surfaces", LARGE).json()["links"]["self"]
    id = url.rpartition("/")[2]
    job = Job(services.workers)  # a job that does not end
    kept = client.call(stored.surface_of, services, job, id)
    assert client.get(url).status_code == 200
    assert client.request("DELETE", url).status_code == 204
    assert client.get(url).status_code == 404
    assert kept.id == id
