"""Work of the command line that takes long becomes a job at the service; the file is the same."""

import asyncio
import sys
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import orjson
import pytest
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.problems import problem_of, problem_response
from service.cancellation import OutOfTime
from service.cli import remote
from service.cli.main import INTERRUPTED, main
from service.client import jobs as client_jobs
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError, TooLarge
from service.pipeline.mesh import render
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from tests.api.fake_jobs import FakeJobs
from tests.cad import TETRAHEDRON
from tools.live import run_service

RESULT = render(find("saddle").surface(), MeshOptions(), BY_NAME["glb"])
COMMAND = ["mesh", "saddle", "-o"]


class SlowService(NamedTuple):
    """A service that has too little time for every call, but not for jobs."""

    url: str
    jobs: FakeJobs
    results: list[bytes | SurfaceError]
    """Results of the next parts, which end a moment after a client has asked for events."""


def run_slow_service(settings: Settings) -> Iterator[SlowService]:
    jobs, results = FakeJobs(), list[bytes | SurfaceError]()

    def wrap(app: Any) -> ASGIApp:
        if settings.jobs:
            app.state.services = replace(app.state.services, jobs=jobs)

        async def respond(scope: Scope, receive: Receive, send: Send) -> None:
            path = scope.get("path", "")
            prefers_job = any(name == b"prefer" for name, _ in scope.get("headers", ()))
            if "/mesh" in path and not prefers_job and settings.jobs:
                await problem_response(problem_of(OutOfTime()))(scope, receive, send)
                return
            if path.endswith("/events") and results:
                asyncio.get_running_loop().call_later(
                    0.05, jobs.end_part, path.split("/")[3], 0, results.pop()
                )
            await app(scope, receive, send)

        return respond

    with run_service(settings, wrap) as url:
        yield SlowService(url, jobs, results)


@pytest.fixture
def service(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowService]:
    monkeypatch.setattr(client_jobs, "PAUSE", 0.01)
    yield from run_slow_service(Settings())


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """A file with a request, which the command line posts."""
    path = tmp_path / "net.json"
    path.write_text('{"surface": {"control_net": [[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]]]}}')
    return path


def test_a_mesh_that_takes_long_becomes_a_job(
    service: SlowService, tmp_path: Path, net: Path
) -> None:
    output = tmp_path / "out.glb"
    for source in ("saddle", str(net)):
        service.results.append(RESULT)
        assert main(["mesh", source, "-o", str(output), "--url", service.url]) == 0
        assert output.read_bytes() == RESULT
    assert [line.startswith(b'{"id"') for line in service.jobs.lines] == [True, True]


def test_a_cad_file_that_takes_long_becomes_a_job_with_the_file(
    service: SlowService, tmp_path: Path
) -> None:
    source, output = tmp_path / "part.step", tmp_path / "out.glb"
    source.write_bytes(TETRAHEDRON)
    service.results.append(RESULT)
    command = ["mesh", str(source), "--tolerance", "0.1", "--name", "tip", "-o", str(output)]
    assert main([*command, "--url", service.url]) == 0
    assert output.read_bytes() == RESULT
    (line,) = map(orjson.loads, service.jobs.lines)
    assert line["path"] == "/v1/mesh?name=tip&tolerance=0.1&format=glb"
    assert line["file"] == f"{sha256(TETRAHEDRON).hexdigest()}.step"


def test_a_stream_that_ends_too_early_is_read_again(service: SlowService, tmp_path: Path) -> None:
    """As when the service restarts."""
    watch, output = service.jobs.watch, tmp_path / "out.glb"
    calls: list[str] = []

    async def watch_briefly(id: str) -> Any:
        calls.append(id)
        if len(calls) == 1:
            return
        async for state in watch(id):
            yield state

    service.jobs.watch = watch_briefly  # type: ignore[method-assign]
    service.results.append(RESULT)
    end_part = service.jobs.end_part
    service.jobs.end_part = lambda *a: len(calls) > 0 and end_part(*a)  # type: ignore[assignment, method-assign]
    assert main([*COMMAND, str(output), "--url", service.url]) == 0
    assert output.read_bytes() == RESULT


def test_the_error_of_a_part_is_that_of_the_call(
    service: SlowService, net: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    issue = Issue("tolerance_too_small", "Too small.", "/body/tolerance", "1e-20", "at least 1e-9")
    service.results.append(TooLarge(issue))
    output = str(tmp_path / "out.glb")
    command = ["mesh", str(net), "--tolerance", "1e-20", "-o", output, "--url", service.url]
    assert main(command) == 1
    assert "--tolerance" in capsys.readouterr().err


def test_ctrl_c_withdraws_the_job(
    service: SlowService, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(remote._Progress, "show", interrupt)
    assert main([*COMMAND, str(tmp_path / "out.glb"), "--url", service.url]) == INTERRUPTED
    assert [state.state for state in service.jobs.states.values()] == ["cancelled"]


def test_a_job_that_was_withdrawn_elsewhere_is_a_failure(
    service: SlowService, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def withdraw(id: str, *_: object) -> None:
        service.jobs.states[id] = replace(service.jobs.states[id], state="cancelled")
        service.jobs.changed.set()

    service.jobs.end_part = withdraw  # type: ignore[assignment]
    service.results.append(RESULT)
    assert main([*COMMAND, str(tmp_path / "out.glb"), "--url", service.url]) == 3
    assert "the job was withdrawn" in capsys.readouterr().err


def test_a_terminal_shows_the_progress(
    service: SlowService,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    service.results.append(RESULT)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main([*COMMAND, str(tmp_path / "out.glb"), "--url", service.url]) == 0
    lines = capsys.readouterr().err.split("\r\x1b[K")
    assert lines[1] == "computed as a job: queued, 0 s; Ctrl-C withdraws it"
    assert lines[-1] == ""


def test_a_service_without_jobs_computes_the_call_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, net: Path
) -> None:
    monkeypatch.setattr("service.client.jobs.PATIENCE", 1e-4)
    output = tmp_path / "out.glb"
    for service in run_slow_service(Settings(jobs=False)):
        for source in ("saddle", str(net)):
            assert main(["mesh", source, "-o", str(output), "--url", service.url]) == 0
            assert main(["mesh", source, "-o", str(tmp_path / "local.glb")]) == 0
            assert output.read_bytes() == (tmp_path / "local.glb").read_bytes()
