"""Several workers at one port: start, faults, replacement, end; `make test-rolling` adds load."""

import os
import re
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest

from service.server.run import make_server
from service.server.supervisor import Supervisor
from service.server.worker import WorkerServer
from service.settings.values import Settings
from tests.server.test_draining import SlowApp
from tests.server.workers import COUNT, Workers, is_running, start_workers, wait_until
from tools.processes import PATIENCE
from tools.programs import run_python


@pytest.fixture(scope="module")
def workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    with start_workers(tmp_path_factory.mktemp("workers")) as workers:
        yield workers


@pytest.mark.slow
def test_systemd_is_notified_once_when_all_workers_serve(workers: Workers) -> None:
    assert len(workers.server.worker_pids()) == COUNT
    for number in range(COUNT):
        assert workers.ask_worker(number, "/health/ready").status_code == 200
    assert not workers.systemd.has_more()
    assert workers.log.count("Uvicorn running on") == 1


def test_each_worker_has_metrics_and_a_part_of_the_memory(workers: Workers) -> None:
    for number in range(COUNT):
        client_count = 3 + number
        for _ in range(client_count):
            workers.ask_worker(number, "/v1/formats")
        text = workers.ask_worker(number, "/metrics").text
        (count,) = re.findall(r'_seconds_count\{.*route="/v1/formats".*\} (\S+)', text)
        assert float(count) == client_count
        limits = re.findall(r"^surface_memory_limit_bytes\S+ (\S+)", text, re.MULTILINE)
        part = Settings().memory_bytes // COUNT - 75_000_000
        assert sum(map(float, limits)) == pytest.approx(part, rel=1e-6)


def test_every_worker_gets_connections(workers: Workers) -> None:
    def count_connections(number: int) -> float:
        text = workers.ask_worker(number, "/metrics").text
        (count,) = re.findall(r"^surface_connections (\S+)", text, re.MULTILINE)
        return float(count) - 1  # without this one

    clients = [socket.create_connection(("127.0.0.1", workers.server.port)) for _ in range(64)]
    try:
        wait_until(lambda: sum(map(count_connections, range(COUNT))) == len(clients))
        # Each connection goes to either worker with probability 1/2: to one of them fewer than 8 of
        # 64 in one of 10^10 runs.
        assert min(map(count_connections, range(COUNT))) >= 8
    finally:
        for client in clients:
            client.close()


@pytest.mark.slow
def test_a_second_service_cannot_join_the_port(workers: Workers, tmp_path: Path) -> None:
    port = str(workers.server.port)
    command = ("-m", "service", "serve", "--port", port, "--workers", str(COUNT))
    environment = os.environ | {"SURFACE_STORE": str(tmp_path)}
    process = run_python(*command, env=environment, check=False)
    assert process.returncode == 1
    assert "Address already in use" in process.stderr
    assert process.stderr.splitlines()[-1].startswith("surface: cannot serve at 127.0.0.1")


@pytest.mark.slow
def test_a_killed_worker_is_replaced_and_waiting_connections_are_kept(workers: Workers) -> None:
    victim, other = workers.server.worker_pids()
    os.kill(victim, signal.SIGSTOP)  # its connections wait from now on
    clients = [httpx.Client(base_url=workers.server.url, timeout=PATIENCE) for _ in range(16)]
    statuses: list[int] = []
    threads = [
        threading.Thread(
            target=lambda client=client: statuses.append(client.get("/v1/formats").status_code)
        )
        for client in clients
    ]
    try:
        for thread in threads:
            thread.start()
        # Those of the other worker get their responses.
        wait_until(lambda: statuses)
        os.kill(victim, signal.SIGKILL)
        for thread in threads:
            thread.join(PATIENCE)
    finally:
        for client in clients:
            client.close()
    assert statuses == [200] * len(clients)
    new_pids = workers.server.worker_pids()
    assert len(new_pids) == COUNT
    assert other in new_pids
    assert victim not in new_pids
    assert re.search(rf"worker \d \(process {victim}\) ended with -9", workers.log)


@pytest.mark.slow
def test_a_stop_ends_all_workers_with_exit_code_0(workers: Workers) -> None:
    """The last test of the service that the tests above share."""
    pids = workers.server.worker_pids()
    # Ctrl-C reaches the workers, too, so that each gets the signal twice.
    for pid in pids:
        os.kill(pid, signal.SIGINT)
    workers.server.process.send_signal(signal.SIGINT)
    assert workers.server.process.wait(PATIENCE) == 0
    assert workers.systemd.read() == "STOPPING=1"
    assert not workers.systemd.has_more()
    assert not any(map(is_running, pids))
    assert "Traceback" not in workers.log


class StandIn:
    """Stands in for a worker: a process that serves, or ends, when a test says so."""

    must_end_by = None

    def __init__(self, _: object, sockets: list[str], settings: Settings, number: int) -> None:
        self.sockets, self.settings, self.number = sockets, settings, number
        self.lives, self.serves, self.exitcode = True, False, 3
        self.process = SimpleNamespace(join=lambda: None)
        self.has_failed_just_now = False

    def start(self) -> None:
        """Does nothing: it runs."""

    def answers(self) -> bool:
        return self.lives

    def kill(self) -> None:
        self.lives = False

    retire = kill

    def has_just_failed(self, seconds: float) -> bool:
        assert seconds > 0
        return self.has_failed_just_now


@pytest.fixture
def supervisor(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A supervisor of two stand-ins that serve."""
    monkeypatch.setattr("signal.signal", lambda *_: None)
    monkeypatch.setattr("service.server.supervisor.Worker", StandIn)
    supervisor: Any = Supervisor(Settings(), [["socket 0"], ["socket 1"]])  # type: ignore[list-item]
    supervisor.processes = [supervisor._start(number) for number in range(COUNT)]
    for worker in supervisor.processes:
        worker.serves = True
    supervisor._check_start()
    assert supervisor.has_served
    return supervisor


def replace_next(supervisor: Any) -> None:
    """Lets a new worker start and serve, and the old one end."""
    supervisor._replace_next()
    supervisor._successor.serves = True
    supervisor._replace_next()
    supervisor._end_retired()


def test_each_socket_has_a_worker_after_a_hangup_during_another(supervisor: Any) -> None:
    supervisor.handle_hup()
    replace_next(supervisor)
    supervisor._replace_next()  # the second worker's successor starts
    supervisor.handle_hup()
    old_workers = list(supervisor.processes)
    while supervisor._to_replace:
        replace_next(supervisor)
    assert [worker.sockets for worker in supervisor.processes] == [["socket 0"], ["socket 1"]]
    assert not set(supervisor.processes) & set(old_workers)


def test_a_worker_that_is_replaced_makes_no_new_store(supervisor: Any) -> None:
    assert supervisor.processes[0].settings.store_create
    supervisor.processes[0].kill()
    supervisor._replace_dead()
    new_worker = supervisor.processes[0]
    assert new_worker.lives
    assert not new_worker.settings.store_create


def test_a_worker_that_ended_before_it_served_is_replaced_after_a_while(supervisor: Any) -> None:
    worker = supervisor.processes[1]
    worker.has_failed_just_now = True
    worker.kill()
    supervisor._replace_dead()
    assert supervisor.processes[1] is worker
    worker.has_failed_just_now = False
    supervisor._replace_dead()
    assert supervisor.processes[1].lives


def test_a_retiring_worker_closes_its_listener_first_and_its_connections_after_a_response() -> None:
    slow_app, state = SlowApp(), SimpleNamespace(ready=True)
    server = make_server(slow_app.app, Settings(), state, WorkerServer)
    assert isinstance(server, WorkerServer)
    # Another process, here the test, has this socket too: it stays open.
    listener = socket.create_server(("127.0.0.1", 0))
    url = f"http://127.0.0.1:{listener.getsockname()[1]}"
    thread = threading.Thread(target=server.run, args=([listener.dup()],))
    thread.start()
    responses: list[Any] = []
    with httpx.Client(base_url=url, timeout=PATIENCE) as client:
        assert "connection" not in client.get("/").headers
        slow = threading.Thread(
            target=lambda: responses.append(httpx.get(f"{url}/slow", timeout=PATIENCE))
        )
        slow.start()
        assert slow_app.has_begun.wait(PATIENCE)
        server.retire()
        wait_until(lambda: server.should_exit)
        server._stop_time = time.monotonic() + PATIENCE  # the test needs more time
        waiting_client = socket.create_connection(("127.0.0.1", listener.getsockname()[1]))
        wait_until(lambda: server._is_ending)
        assert state.ready, "it still answers for the instance, which is ready"
        assert client.get("/").headers["connection"] == "close"
    slow_app.may_end.set()
    slow.join(PATIENCE)
    assert [(each.text, each.headers["connection"]) for each in responses] == [("slow", "close")]
    thread.join(PATIENCE)
    assert not thread.is_alive(), "it ends as soon as it has no connections"
    # The new connection waits for the process that takes over.
    connection, _ = listener.accept()
    with connection, waiting_client, listener:
        assert connection.getpeername() == waiting_client.getsockname()
