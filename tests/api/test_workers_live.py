"""Waiting, refused, disconnecting and slow clients of a real server."""

import gc
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest

from service.api.workers import Workers
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue
from service.pipeline.mesh import MeshFile, MeshWork
from service.settings.values import Settings
from tests.live import run_service

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
SIDE = 200
"""Divisions of a mesh that is not small."""

LONG = {"surface": {"control_net": NET}, "resolution": SIDE}
SHORT = {"surface": {"control_net": NET}, "resolution": 4}
SADDLE = f"/v1/surfaces/saddle/mesh.glb?resolution={SIDE}"
ROOM = 4 << 30


class Looping:
    """Meshes with many vertices, which are computed until the test ends them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls = self.stopped = 0
        self.gate = threading.Event()
        run = MeshWork.run

        def looping(work: MeshWork) -> MeshFile:
            if work.size.vertices < SIDE**2:
                return run(work)
            self.calls += 1
            try:
                while not self.gate.is_set():
                    time.sleep(0.001)
                    checkpoint()
            except Exception:
                self.stopped += 1
                raise
            return run(work)

        monkeypatch.setattr(MeshWork, "run", looping)


@pytest.fixture
def looping(monkeypatch: pytest.MonkeyPatch) -> Iterator[Looping]:
    built = Looping(monkeypatch)
    yield built
    built.gate.set()


class Service:
    """A service with one thread, and its clients."""

    def __init__(self, url: str, workers: Workers, clients: ExitStack) -> None:
        where = urlsplit(url)
        self.where = (str(where.hostname), int(where.port or 0))
        self.workers = workers
        self._clients = clients

    def connected(self) -> "Client":
        return Client(self._clients.enter_context(socket.create_connection(self.where, 30)))

    def posted(self, document: Any, address: str = "/v1/mesh?format=glb") -> "Client":
        client = self.connected()
        client.post(json.dumps(document).encode(), address)
        return client

    def got(self, address: str) -> "Client":
        client = self.connected()
        client.send(f"GET {address} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
        return client

    def given_back(self) -> bool:
        return self.workers.used == self.workers.computing == 0


class Client:
    """One connection, for one request."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def send(self, content: bytes) -> None:
        self._connection.sendall(content)

    def post(self, body: bytes, address: str, length: int | None = None) -> None:
        length = len(body) if length is None else length
        head = f"POST {address} HTTP/1.1\r\nHost: x\r\n"
        head += f"Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
        self.send(head.encode() + body)

    def leave(self) -> None:
        self._connection.close()

    def read_response(self) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body."""
        with self._connection.makefile("rb") as answer:
            first, *lines = iter(lambda: answer.readline().decode().strip(), "")
            headers = dict(line.lower().split(": ", 1) for line in lines)
            body = answer.read(int(headers["content-length"]))
        return int(first.split(" ")[1]), headers, body

    def refusal(self) -> tuple[int, str, int]:
        """Status, code, and seconds to wait."""
        status, headers, body = self.read_response()
        return status, json.loads(body)["code"], int(headers.get("retry-after", 0))


@contextmanager
def start_service(**chosen: Any) -> Iterator[Service]:
    apps: list[Any] = []

    def kept(app: Any) -> Any:
        apps.append(app)
        return app

    settings = Settings(**{"threads": 1, "memory_bytes": ROOM, "cache_bytes": 0, **chosen})
    with run_service(settings, kept) as url, ExitStack() as clients:
        yield Service(url, apps[0].state.services.workers, clients)


def wait_until(condition: Callable[[], bool]) -> None:
    """Waits until a condition is true."""
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_a_client_that_leaves_leaves_the_queue(looping: Looping) -> None:
    with start_service() as service:
        computed = service.posted(LONG)
        wait_until(lambda: looping.calls == 1)
        leaving, staying = service.posted(LONG), service.posted(LONG)
        wait_until(lambda: service.workers.waiting == 2)
        leaving.leave()
        wait_until(lambda: service.workers.waiting == 1)
        looping.gate.set()
        assert [client.read_response()[0] for client in (computed, staying)] == [200, 200]
        wait_until(service.given_back)
        assert (looping.calls, looping.stopped) == (2, 0)


def test_the_last_waiting_client_that_leaves_cancels_the_work(looping: Looping) -> None:
    with start_service() as service:
        first, second = service.got(SADDLE), service.got(SADDLE)
        other = service.got(SADDLE.replace("glb", "stl"))
        wait_until(lambda: looping.calls == 1 and service.workers.waiting == 1)
        first.leave()
        wait_until(lambda: service.got("/health/live").read_response()[0] == 200)
        assert looping.stopped == 0
        second.leave()
        wait_until(lambda: (looping.calls, looping.stopped) == (2, 1))
        again = service.got(SADDLE)
        looping.gate.set()
        assert [client.read_response()[0] for client in (other, again)] == [200, 200]
        wait_until(service.given_back)
        assert (looping.calls, looping.stopped) == (3, 1)


def test_the_deadline_holds_for_computing_and_waiting_requests(looping: Looping) -> None:
    with start_service(request_timeout=0.5) as service:
        clients = [service.posted(LONG), service.got(SADDLE), service.posted(LONG)]
        refusals = [client.refusal() for client in clients]
        assert [(status, code) for status, code, _ in refusals] == [(503, "out_of_time")] * 3
        assert all(seconds >= 1 for _, _, seconds in refusals)
        wait_until(service.given_back)
        assert looping.stopped == looping.calls >= 1


def test_small_requests_do_not_wait_for_large_ones(looping: Looping) -> None:
    with start_service(max_queue=1) as service:
        computed = service.posted(LONG)
        wait_until(lambda: looping.calls == 1)
        waiting = service.posted(LONG)
        wait_until(lambda: service.workers.waiting == 1)
        assert service.posted(SHORT).read_response()[0] == 200
        assert service.posted(SHORT, "/v1/estimate").read_response()[0] == 200
        for small in ("/v1/surfaces/saddle/mesh.glb?resolution=4", "/v1/surfaces/saddle"):
            assert service.got(small).read_response()[0] == 200
        looping.gate.set()
        assert [client.read_response()[0] for client in (computed, waiting)] == [200, 200]
        wait_until(service.given_back)


def test_slow_readers_hold_the_memory_of_their_response_only() -> None:
    long = LONG | {"resolution": 400}
    with start_service() as service:
        for leaves in (False, True):
            client = service.posted(long, "/v1/mesh?format=stl")
            wait_until(lambda: service.workers.computing == 0 < service.workers.used)
            wait_until(lambda: service.workers.used == 84 + 50 * 2 * 400**2)
            if leaves:
                client.leave()
            else:
                assert len(client.read_response()[2]) == 84 + 50 * 2 * 400**2
            wait_until(service.given_back)


@pytest.mark.parametrize("error", [RuntimeError(), InvalidRequest(Issue("code", "No."))])
def test_failed_requests_release_threads_and_memory(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_: MeshWork) -> MeshFile:
        raise error

    monkeypatch.setattr(MeshWork, "run", fails)
    with start_service() as service:
        for client in (service.posted(LONG), service.posted(SHORT), service.got(SADDLE)):
            assert client.read_response()[0] in (422, 500)
        wait_until(service.given_back)


def test_bodies_that_do_not_fit_are_refused_and_small_ones_do_fit() -> None:
    with start_service(memory_bytes=64 << 20) as service:
        begun = b'{"surface": {"control_net": [[[0, 0, 0' + b", 0" * 100_000
        first, second = service.connected(), service.connected()
        first.post(begun, "/v1/mesh", length=10**7)
        wait_until(lambda: service.workers.used > 10_000_000)
        second.post(begun, "/v1/mesh", length=10**7)
        assert second.refusal() == (429, "busy", 1)
        assert service.posted(SHORT).read_response()[0] == 200
        first.leave()
        wait_until(service.given_back)
        third = service.connected()
        third.post(begun + b", 0" * 100_000, "/v1/mesh", length=10**7)
        status, _, body = third.read_response()
        assert (status, json.loads(body)["errors"][0]["code"]) == (422, "too_much_memory")
        wait_until(service.given_back)


def test_requests_leave_no_reference_cycles(looping: Looping) -> None:
    """Reference cycles would keep the memory of a request, because Python rarely looks for them."""
    many = LONG["surface"] | {"extra": [[0] * 10] * 10_000}  # type: ignore[operator]
    before, kept = gc.isenabled(), list[object]()
    with start_service(max_queue=1) as service:
        gc.collect()
        gc.disable()
        try:
            gone = service.posted(LONG)
            wait_until(lambda: looping.calls == 1)
            gone.leave()
            wait_until(lambda: looping.stopped == 1)
            for client in (service.posted({"surface": many}), service.posted(SHORT)):
                assert client.read_response()[0] in (200, 422)
                client.leave()
            half = service.connected()
            half.post(b'{"surface": ', "/v1/mesh", length=10**6)
            half.leave()
            wait_until(service.given_back)
            time.sleep(0.1)  # the connections end
            gc.set_debug(gc.DEBUG_SAVEALL)
            gc.collect()
            kept, gc.garbage[:] = list(gc.garbage), []
        finally:
            gc.set_debug(0)
            if before:
                gc.enable()
    kinds = {type(thing).__qualname__ for thing in kept}
    assert kinds.isdisjoint({"BoundedProtocol", "Cycle", "Job", "MeshWork", "ndarray", "frame"})
