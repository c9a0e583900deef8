"""Clients of a real server that wait, are refused, disconnect, or read slowly."""

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

from service.api.threads import Threads
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue
from service.pipeline.mesh import MeshFile, make_file
from service.pipeline.mesh_plan import MeshPlan
from service.settings.values import Settings
from service.surface.sizes import SurfaceKind
from tools.live import run_service

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
RESOLUTION = 200
"""Divisions of a mesh that is too large for the event loop: a thread computes it."""

LONG = {"surface": {"control_net": NET}, "resolution": RESOLUTION}
SHORT = {"surface": {"control_net": NET}, "resolution": 4}
SADDLE = f"/v1/surfaces/saddle/mesh.glb?resolution={RESOLUTION}"
MEMORY = 4 << 30


class SlowMeshes:
    """Lets the computation of large meshes run until `may_end` is set or the work is cancelled.

    `started` and `cancelled` count these computations.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.started = self.cancelled = 0
        self.may_end = threading.Event()

        def run_slowly(plan: MeshPlan, surface: SurfaceKind) -> MeshFile:
            if plan.size.vertices < RESOLUTION**2:
                return make_file(plan, surface)
            self.started += 1
            try:
                while not self.may_end.is_set():
                    time.sleep(0.001)
                    checkpoint()
            except Exception:
                self.cancelled += 1
                raise
            return make_file(plan, surface)

        monkeypatch.setattr("service.pipeline.mesh.make_file", run_slowly)


@pytest.fixture
def slow_meshes(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowMeshes]:
    slow_meshes = SlowMeshes(monkeypatch)
    yield slow_meshes
    slow_meshes.may_end.set()


class Service:
    """A running service with one thread; its methods start clients."""

    def __init__(self, url: str, threads: Threads, clients: ExitStack) -> None:
        parts = urlsplit(url)
        self.address = (str(parts.hostname), int(parts.port or 0))
        self.threads = threads
        self._clients = clients

    def connect(self) -> "Client":
        """A client that has sent nothing yet."""
        return Client(self._clients.enter_context(socket.create_connection(self.address, 30)))

    def post(self, document: Any, url: str = "/v1/mesh?format=glb") -> "Client":
        """A client that has sent a POST request, and has not read the response."""
        client = self.connect()
        client.post(json.dumps(document).encode(), url)
        return client

    def get(self, url: str) -> "Client":
        """A client that has sent a GET request, and has not read the response."""
        client = self.connect()
        client.send(f"GET {url} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
        return client

    def is_idle(self) -> bool:
        """True if all threads and all memory are released."""
        return self.threads.used_bytes == self.threads.busy_count == 0


class Client:
    """One connection, for one request."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def send(self, content: bytes) -> None:
        self._connection.sendall(content)

    def post(self, body: bytes, url: str, length: int | None = None) -> None:
        """Sends a request with this body; a larger `length` announces more of the body."""
        length = len(body) if length is None else length
        head = f"POST {url} HTTP/1.1\r\nHost: x\r\n"
        head += f"Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
        self.send(head.encode() + body)

    def leave(self) -> None:
        self._connection.close()

    def read_response(self) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of the response."""
        with self._connection.makefile("rb") as response:
            status_line, *lines = iter(lambda: response.readline().decode().strip(), "")
            headers = dict(line.lower().split(": ", 1) for line in lines)
            body = response.read(int(headers["content-length"]))
        return int(status_line.split(" ")[1]), headers, body

    def read_refusal(self) -> tuple[int, str, int]:
        """Status and code of a problem, and the seconds in `Retry-After`."""
        status, headers, body = self.read_response()
        return status, json.loads(body)["code"], int(headers.get("retry-after", 0))


@contextmanager
def start_service(**changes: Any) -> Iterator[Service]:
    """A service with one thread, without a cache, and with these changes of the settings."""
    apps: list[Any] = []

    def record(app: Any) -> Any:
        apps.append(app)
        return app

    settings = Settings(**{"threads": 1, "memory_bytes": MEMORY, "cache_bytes": 0, **changes})
    with run_service(settings, record) as url, ExitStack() as clients:
        yield Service(url, apps[0].state.services.threads, clients)


def wait_until(condition: Callable[[], bool]) -> None:
    """Waits until the condition is true, at most 20 seconds."""
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_a_client_that_disconnects_is_removed_from_the_queue(slow_meshes: SlowMeshes) -> None:
    with start_service() as service:
        computing_client = service.post(LONG)
        wait_until(lambda: slow_meshes.started == 1)
        leaving_client, staying_client = service.post(LONG), service.post(LONG)
        wait_until(lambda: service.threads.queue_length == 2)
        leaving_client.leave()
        wait_until(lambda: service.threads.queue_length == 1)
        slow_meshes.may_end.set()
        assert [client.read_response()[0] for client in (computing_client, staying_client)] == [
            200,
            200,
        ]
        wait_until(service.is_idle)
        assert (slow_meshes.started, slow_meshes.cancelled) == (2, 0)


def test_the_work_is_cancelled_when_the_last_of_its_clients_disconnects(
    slow_meshes: SlowMeshes,
) -> None:
    with start_service() as service:
        first_client, second_client = service.get(SADDLE), service.get(SADDLE)
        stl_client = service.get(SADDLE.replace("glb", "stl"))
        wait_until(lambda: slow_meshes.started == 1 and service.threads.queue_length == 1)
        first_client.leave()
        # When the service has answered another client, it has noticed that the first has left.
        assert service.get("/health/live").read_response()[0] == 200
        assert slow_meshes.cancelled == 0
        second_client.leave()
        wait_until(lambda: (slow_meshes.started, slow_meshes.cancelled) == (2, 1))
        third_client = service.get(SADDLE)
        slow_meshes.may_end.set()
        assert [client.read_response()[0] for client in (stl_client, third_client)] == [200, 200]
        wait_until(service.is_idle)
        assert (slow_meshes.started, slow_meshes.cancelled) == (3, 1)


def test_computing_and_waiting_requests_have_a_deadline(slow_meshes: SlowMeshes) -> None:
    with start_service(request_timeout=0.5) as service:
        clients = [service.post(LONG), service.get(SADDLE), service.post(LONG)]
        refusals = [client.read_refusal() for client in clients]
        assert [(status, code) for status, code, _ in refusals] == [(503, "out_of_time")] * 3
        assert all(seconds >= 1 for _, _, seconds in refusals)
        wait_until(service.is_idle)
        assert slow_meshes.cancelled == slow_meshes.started >= 1


def test_small_requests_do_not_wait_for_large_requests(slow_meshes: SlowMeshes) -> None:
    with start_service(max_queue=1) as service:
        computing_client = service.post(LONG)
        wait_until(lambda: slow_meshes.started == 1)
        waiting_client = service.post(LONG)
        wait_until(lambda: service.threads.queue_length == 1)
        assert service.post(SHORT).read_response()[0] == 200
        assert service.post(SHORT, "/v1/estimate").read_response()[0] == 200
        for url in ("/v1/surfaces/saddle/mesh.glb?resolution=4", "/v1/surfaces/saddle"):
            assert service.get(url).read_response()[0] == 200
        slow_meshes.may_end.set()
        assert [client.read_response()[0] for client in (computing_client, waiting_client)] == [
            200,
            200,
        ]
        wait_until(service.is_idle)


def test_a_client_that_reads_slowly_keeps_only_the_memory_of_its_response() -> None:
    request = LONG | {"resolution": 400}
    # An STL file has a header of 84 bytes, and 50 bytes for each triangle.
    length = 84 + 50 * 2 * 400**2
    with start_service() as service:
        for client_leaves in (False, True):
            client = service.post(request, "/v1/mesh?format=stl")
            wait_until(lambda: service.threads.busy_count == 0 < service.threads.used_bytes)
            wait_until(lambda: service.threads.used_bytes == length)
            if client_leaves:
                client.leave()
            else:
                assert len(client.read_response()[2]) == length
            wait_until(service.is_idle)


@pytest.mark.parametrize("error", [RuntimeError(), InvalidRequest(Issue("code", "No."))])
def test_failed_requests_release_threads_and_memory(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raise_error(*_: object) -> MeshFile:
        raise error

    monkeypatch.setattr("service.pipeline.mesh.make_file", raise_error)
    with start_service() as service:
        for client in (service.post(LONG), service.post(SHORT), service.get(SADDLE)):
            assert client.read_response()[0] in (422, 500)
        wait_until(service.is_idle)


def test_bodies_above_the_memory_budget_are_refused_and_small_ones_accepted() -> None:
    with start_service(memory_bytes=64 << 20) as service:
        # Large bodies may take 15 MB together. For JSON the service counts about 100 bytes for each
        # value: 11 MB for 100,000 values, 22 MB for 200,000.
        first_part = b'{"surface": {"control_net": [[[0, 0, 0' + b", 0" * 100_000
        first_client, second_client = service.connect(), service.connect()
        first_client.post(first_part, "/v1/mesh", length=10**7)
        wait_until(lambda: service.threads.used_bytes > 10_000_000)
        second_client.post(first_part, "/v1/mesh", length=10**7)
        assert second_client.read_refusal() == (429, "busy", 1)
        assert service.post(SHORT).read_response()[0] == 200
        first_client.leave()
        wait_until(service.is_idle)
        third_client = service.connect()
        third_client.post(first_part + b", 0" * 100_000, "/v1/mesh", length=10**7)
        status, _, body = third_client.read_response()
        assert (status, json.loads(body)["errors"][0]["code"]) == (422, "too_much_memory")
        wait_until(service.is_idle)


def test_requests_leave_no_reference_cycles(slow_meshes: SlowMeshes) -> None:
    """Objects in a cycle keep their memory until the garbage collector runs, which is rare."""
    surface = LONG["surface"] | {"extra": [[0] * 10] * 10_000}  # type: ignore[operator]
    was_enabled, garbage = gc.isenabled(), list[object]()
    with start_service(max_queue=1) as service:
        gc.collect()
        gc.disable()
        try:
            leaving_client = service.post(LONG)
            wait_until(lambda: slow_meshes.started == 1)
            leaving_client.leave()
            wait_until(lambda: slow_meshes.cancelled == 1)
            # An unknown field is refused.
            for client in (service.post({"surface": surface}), service.post(SHORT)):
                assert client.read_response()[0] in (200, 422)
                client.leave()
            unfinished_client = service.connect()
            unfinished_client.post(b'{"surface": ', "/v1/mesh", length=10**6)
            unfinished_client.leave()
            wait_until(service.is_idle)
            time.sleep(0.1)  # the connections end
            gc.set_debug(gc.DEBUG_SAVEALL)
            gc.collect()
            garbage, gc.garbage[:] = list(gc.garbage), []
        finally:
            gc.set_debug(0)
            if was_enabled:
                gc.enable()
    # Classes of the server and of requests, and what they refer to.
    names = {type(value).__qualname__ for value in garbage}
    assert names.isdisjoint({"BoundedProtocol", "Cycle", "Job", "Work", "ndarray", "frame"})


def test_a_slow_reader_keeps_only_its_share_and_its_further_responses_wait() -> None:
    """The first file is larger than the share, and than the system buffers for a client."""
    urls = [f"/v1/surfaces/saddle/mesh.stl?resolution={n}" for n in (80, 81, 82)]
    memory = 64 << 20
    with start_service(memory_bytes=memory, cache_bytes=0) as service:
        unread = service.threads.unread
        slow_client = service.get("/v1/surfaces/saddle/mesh.stl?resolution=300")  # 9 MB
        wait_until(lambda: sum(unread.totals.values()) > memory // 8)
        waiting_clients = [service.get(each) for each in urls]
        waiting_clients.append(service.post(LONG, "/v1/mesh?format=stl"))
        short = service.post(SHORT)
        assert short.read_response()[0] == 200, "a short response holds no memory"
        assert list(unread.totals) == ["127.0.0.1"]
        assert sum(unread.totals.values()) < 10_000_000, "the others take no memory yet"
        slow_client.read_response()
        assert [client.read_response()[0] for client in waiting_clients] == [200] * 4
        wait_until(service.is_idle)
        assert unread.totals == {}


def test_a_cached_response_waits_for_its_callers_share_unless_it_is_being_read() -> None:
    with start_service(memory_bytes=256 << 20, cache_bytes=256 << 20) as service:
        unread = service.threads.unread
        url, other_url = (f"/v1/surfaces/saddle/mesh.stl?resolution={n}" for n in (500, 400))
        sizes = [len(service.get(each).read_response()[2]) for each in (url, other_url)]
        slow_client = service.get(url)
        wait_until(lambda: unread.totals == {"127.0.0.1": sizes[0]})
        second_client = service.get(url)  # the same bytes: they take no further memory
        assert len(second_client.read_response()[2]) == sizes[0]
        other_client = service.get(other_url)
        assert service.post(SHORT).read_response()[0] == 200
        assert unread.totals == {"127.0.0.1": sizes[0]}
        assert len(slow_client.read_response()[2]) == sizes[0]
        assert len(other_client.read_response()[2]) == sizes[1]
        wait_until(lambda: unread.totals == {})
