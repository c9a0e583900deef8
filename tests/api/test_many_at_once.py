"""Many who ask for something large: what waits takes little memory."""

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.requests import Request

from service.api import mesh, mesh_by_url, stored
from service.api.admission.visits import Visit
from service.api.app import create_app
from service.api.posted import Posting
from service.api.stored import Stored
from service.pipeline.mesh import Answer, MeshWork
from service.settings.values import Settings
from service.storage.store import SurfaceStore
from tests.api.client import Client, client_of

COUNT = 4
SIDE = 115
"""More bytes than the event loop has the time for, as JSON and as it is stored."""
NET = [[[i, j, (i * j) % 7 / 7] for j in range(SIDE)] for i in range(SIDE)]
LARGE = {"surface": {"type": "bspline", "degree": 1, "control_net": NET}}


@pytest.fixture
def app() -> FastAPI:
    return create_app(Settings(threads=1, allow_delete=True, memory_bytes=1 << 30))


@pytest.fixture
def client(app: FastAPI) -> Iterator[Client]:
    with client_of(app) as client:
        yield client


class Watch:
    """How many surfaces are patches at the same time; the first waits until all have come."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, place: Any, name: str) -> None:
        self.now = self.most = self.come = 0
        self.all_came = threading.Event()
        plan: Callable[..., MeshWork] = getattr(place, name)
        answer = MeshWork.run

        def planned(*arguments: Any) -> MeshWork:
            assert self.all_came.wait(60)
            self.now += 1
            self.most = max(self.most, self.now)
            return plan(*arguments)

        def answered(work: MeshWork) -> Answer:
            made = answer(work)
            self.now -= 1
            return made

        monkeypatch.setattr(place, name, planned)
        monkeypatch.setattr(MeshWork, "run", answered)

    def comes(self) -> None:
        """One more request has got as far as it gets without a thread."""
        self.come += 1
        if self.come == COUNT:
            self.all_came.set()


def together(ask: Callable[[int], int]) -> list[int]:
    """The statuses of some requests that are made at the same time."""
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
    watch = Watch(monkeypatch, mesh, "planned")
    address = client.post("/v1/surfaces", LARGE).json()["links"]["mesh"]["stl"]
    find, get = stored.surface_of, SurfaceStore.get
    seen: list[Stored] = []
    reads: list[str] = []

    async def found(request: Request, id: str) -> Stored:
        seen.append(await find(request, id))
        watch.comes()
        return seen[-1]

    async def read(store: SurfaceStore, id: str, announced: Callable[[int], None]) -> bytes:
        reads.append(id)
        return await get(store, id, announced)

    monkeypatch.setattr(mesh_by_url, "surface_of", found)
    monkeypatch.setattr(SurfaceStore, "get", read)
    statuses = together(lambda each: client.get(f"{address}&resolution={each + 1}").status_code)
    assert statuses == [200] * COUNT
    assert len(reads) == 1
    assert all(each is seen[0] for each in seen)
    assert watch.most == 1


def test_bodies_wait_as_bytes(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    watch = Watch(monkeypatch, mesh, "planned")
    read = Posting.read

    async def body(posting: Any, request: Request, settings: Settings) -> bytes:
        content = await read(posting, request, settings)
        watch.comes()
        return content

    monkeypatch.setattr(Posting, "read", body)
    large = {**LARGE, "resolution": 1}
    statuses = together(lambda _: client.post("/v1/mesh?format=stl", large).status_code)
    assert statuses == [200] * COUNT
    assert watch.most == 1


def test_what_was_deleted_is_not_shared(client: Client, app: FastAPI) -> None:
    address = client.post("/v1/surfaces", LARGE).json()["links"]["self"]
    id = address.rpartition("/")[2]
    kept: list[Stored] = []

    async def keep() -> None:
        scope = {"type": "http", "app": app, "headers": []}
        with Visit(app.state.admission).current():  # which does not end
            kept.append(await stored.surface_of(Request(scope), id))

    client.call(keep)
    assert client.get(address).status_code == 200
    assert client.request("DELETE", address).status_code == 204
    assert client.get(address).status_code == 404
    assert kept[0].id == id
