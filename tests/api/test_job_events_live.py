"""Streams of events on real connections: no deadline ends them while they are read."""

import socket
import time
from collections.abc import AsyncGenerator, Iterator
from contextlib import contextmanager
from dataclasses import replace

import httpx
import orjson
from starlette.types import ASGIApp

from service.api.app import Application
from service.jobs.state import JobState
from service.settings.values import Settings
from tests.api.fake_jobs import FakeJobs
from tools.live import run_service

SHORT = 0.1
"""Seconds of each deadline of the service."""

PARTS = {"parts": [{"path": f"/v1/surfaces/saddle/mesh.glb?resolution={k}"} for k in (1, 2)]}


@contextmanager
def run_with(jobs: FakeJobs) -> Iterator[tuple[str, Application]]:
    """The URL and the application of a service with these jobs, and with short deadlines."""
    apps: list[Application] = []

    def wrap(app: ASGIApp) -> ASGIApp:
        assert isinstance(app, Application)
        app.state.services = replace(app.state.services, jobs=jobs)
        apps.append(app)
        return app

    settings = Settings(
        send_timeout=SHORT,
        request_timeout=SHORT,
        body_timeout=SHORT,
        head_timeout=SHORT,
        keep_alive=SHORT,
    )
    with run_service(settings, wrap) as url:
        yield url, apps[0]


def test_a_stream_outlives_all_deadlines_while_it_is_read() -> None:
    jobs = FakeJobs()
    with run_with(jobs) as (url, _):
        links = httpx.post(f"{url}/v1/jobs", json=PARTS).json()["links"]
        start = time.monotonic()
        with httpx.stream("GET", url + links["events"]) as response:
            lines = response.iter_lines()
            assert next(lines) == "event: progress"
            time.sleep(5 * SHORT)
            (id,) = jobs.states
            for part in (0, 1):
                jobs.end_part(id, part, b"mesh")
            data = [line.removeprefix("data: ") for line in lines if line.startswith("data: ")]
        assert orjson.loads(data[-1])["state"] == "succeeded"
        # What counts as the duration of the request ends before the sleep.
        most = time.monotonic() - start - 5 * SHORT
        metrics = httpx.get(f"{url}/metrics").text
        line = next(
            line
            for line in metrics.splitlines()
            if "duration_seconds_sum" in line and "/events" in line
        )
        assert float(line.rpartition(" ")[2]) < most


def test_a_client_that_does_not_read_loses_its_stream() -> None:
    class BusyJobs(FakeJobs):
        async def watch(self, id: str) -> AsyncGenerator[JobState]:
            """Changes all the time, to fill the buffers of the connection."""
            for count in range(10**9):
                yield replace(self.states[id], rate=float(count), waiting_for="x" * 50_000)

    jobs = BusyJobs()
    with run_with(jobs) as (url, app):
        links = httpx.post(f"{url}/v1/jobs", json=PARTS).json()["links"]
        with socket.socket() as connection:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 12)
            connection.connect(("127.0.0.1", int(url.rpartition(":")[2])))
            connection.sendall(b"GET %b HTTP/1.1\r\nHost: x\r\n\r\n" % links["events"].encode())
            while not app.state.counters.in_flight:
                time.sleep(0.01)
            end = time.monotonic() + 20
            while app.state.counters.in_flight and time.monotonic() < end:
                time.sleep(0.01)
            assert app.state.counters.in_flight == 0
