"""Long work of the client becomes a job, which is withdrawn when its caller stops waiting."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from service.client import AsyncClient, Client, ServiceError
from service.client import jobs as client_jobs
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from tests.cli.test_remote_jobs import SlowService, run_slow_service

CONTENT = render(find("saddle").surface(), MeshOptions(), BY_NAME["glb"])


@pytest.fixture
def service(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowService]:
    """A service that has too little time for every mesh, but not for jobs."""
    monkeypatch.setattr(client_jobs, "PAUSE", 0.01)
    yield from run_slow_service(Settings())


def list_states(service: SlowService) -> list[str]:
    return [state.state for state in service.jobs.states.values()]


def test_a_call_that_takes_long_has_the_answer_of_a_job(service: SlowService) -> None:
    service.results.append(CONTENT)
    with Client(service.url) as client:
        assert client.file(Client.mesh.part("saddle"), "glb") == CONTENT
    assert len(service.jobs.lines) == 1


def test_a_job_beyond_the_deadline_is_withdrawn(service: SlowService) -> None:
    with Client(service.url, timeout=0.6) as client, pytest.raises(ServiceError) as raised:
        client.mesh("saddle")
    assert (raised.value.status, raised.value.code) == (0, "timeout")
    assert list_states(service) == ["cancelled"]


def test_a_task_that_is_cancelled_withdraws_its_job(service: SlowService) -> None:
    watch, watched = service.jobs.watch, []

    async def note(id: str) -> Any:
        watched.append(id)
        async for state in watch(id):
            yield state

    service.jobs.watch = note  # type: ignore[method-assign]

    async def ask() -> None:
        async with AsyncClient(service.url) as client:
            task = asyncio.ensure_future(client.mesh("saddle"))
            while not watched:
                await asyncio.sleep(0.01)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task

    asyncio.run(ask())
    assert list_states(service) == ["cancelled"]
