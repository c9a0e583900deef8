"""In the editor, long meshes are made by jobs; their progress is shown, and a button stops them."""

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.problems import problem_of, problem_response
from service.cancellation import OutOfTime
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError, TooLarge
from service.pipeline.mesh import render
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from tests.api.fake_jobs import FakeJobs
from tests.web.test_editor_files import drop
from tools.browser import Stage
from tools.editor import READY, SADDLE, open_editor, read_value
from tools.live import run_service

MESH = render(find("saddle").surface(), MeshOptions(resolution=(2, 2)), BY_NAME["glb"])


@dataclass
class SlowService:
    """A service that, while `is_slow`, has time for meshes and checks in jobs only."""

    jobs: FakeJobs = field(default_factory=FakeJobs)
    is_slow: bool = False
    loop: asyncio.AbstractEventLoop | None = None

    def wrap(self, app: Any) -> ASGIApp:
        app.state.services = replace(app.state.services, jobs=self.jobs)

        async def respond(scope: Scope, receive: Receive, send: Send) -> None:
            self.loop = asyncio.get_running_loop()
            prefers_job = any(name == b"prefer" for name, _ in scope.get("headers", ()))
            is_long = scope.get("path") in ("/v1/mesh", "/v1/check")
            if is_long and self.is_slow and not prefers_job:
                await problem_response(problem_of(OutOfTime()))(scope, receive, send)
            else:
                await app(scope, receive, send)

        return respond

    def end_job(self, result: bytes | SurfaceError) -> None:
        """Lets the part of the newest job end."""
        assert self.loop is not None
        id = list(self.jobs.states)[-1]
        self.loop.call_soon_threadsafe(self.jobs.end_part, id, 0, result)

    def cancel_job(self) -> None:
        """Cancels the newest job, as another of its askers may."""
        assert self.loop is not None
        id = list(self.jobs.states)[-1]
        self.jobs.states[id] = replace(self.jobs.states[id], state="cancelled")
        self.loop.call_soon_threadsafe(self.jobs.changed.set)


@pytest.fixture(scope="module")
def slow_editor(browser: Browser) -> Iterator[tuple[Stage, SlowService]]:
    service = SlowService()
    with run_service(Settings(), service.wrap) as url:
        stage = open_editor(browser, url + SADDLE)
        service.is_slow = True
        yield stage, service
        stage.page.context.close()


def ask_mesh(page: Page, resolution: int) -> None:
    """Asks for another mesh, and waits for its job."""
    page.fill("#resolution", str(resolution))
    page.wait_for_selector("#busy-detail:text('as a job, queued')")


def test_a_long_mesh_is_made_by_a_job(slow_editor: tuple[Stage, SlowService]) -> None:
    stage, service = slow_editor
    ask_mesh(stage.page, 7)
    service.end_job(MESH)
    stage.page.wait_for_selector(READY)
    assert stage.page.is_hidden("#busy")
    assert read_value(stage.page, "triangles") == 8


def test_a_button_stops_the_job(slow_editor: tuple[Stage, SlowService]) -> None:
    stage, service = slow_editor
    ask_mesh(stage.page, 8)
    with stage.page.expect_response(lambda r: r.request.method == "DELETE") as response:
        stage.page.click("#busy-stop")
    assert response.value.status == 204
    stage.page.wait_for_selector("#problem-title:text('Stopped')")
    assert stage.page.is_hidden("#busy")
    assert list(service.jobs.states.values())[-1].state == "cancelled"


@pytest.mark.parametrize("is_here", [True, False])
def test_a_long_check_is_a_job_that_is_stopped_here_or_elsewhere(
    slow_editor: tuple[Stage, SlowService], *, is_here: bool
) -> None:
    stage, service = slow_editor
    # Equal calls have one job.
    drop(stage.page, {"part.stl": b"solid %d\nfacet normal 0 0 1\n" % is_here})
    stage.page.wait_for_selector("#busy-detail:text('as a job, queued')")
    if is_here:
        stage.page.click("#busy-stop")
    else:
        service.cancel_job()
    stage.page.wait_for_selector("#problem-title:text('Stopped')")
    assert list(service.jobs.states.values())[-1].state == "cancelled"
    assert stage.page.locator("#check").count() == 0
    stage.page.click("#problem-close")


def test_a_change_replaces_the_job(slow_editor: tuple[Stage, SlowService]) -> None:
    stage, service = slow_editor
    ask_mesh(stage.page, 9)
    count = len(service.jobs.states)
    stage.page.fill("#resolution", "10")
    while len(service.jobs.states) == count:
        stage.page.wait_for_timeout(10)
    assert list(service.jobs.states.values())[-2].state == "cancelled"
    service.end_job(MESH)
    stage.page.wait_for_selector(READY)


def test_the_error_of_a_job_names_the_field_of_the_request(
    slow_editor: tuple[Stage, SlowService],
) -> None:
    stage, service = slow_editor
    ask_mesh(stage.page, 11)
    service.end_job(TooLarge(Issue("too_many_vertices", "Too many.", "/body/resolution")))
    stage.page.wait_for_selector("#problem-errors code:text-is('/resolution')")
