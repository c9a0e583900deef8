"""Files that harm their reader: the child process ends, and the service gets its memory back.

The children run the program of `tests.decoders.payloads`: a file says what they do.
"""

import json
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from service.api.threads import Threads
from service.decoders import child_processes
from service.decoders.child_processes import PROCESSES
from service.settings.values import Settings
from tests.decoders import payloads
from tests.decoders.children import list_children
from tools.live import run_service

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are Linux's")

PATH, TYPE = "/v1/estimate?format=glb", {"Content-Type": "model/step"}


class Service:
    """A running service, and its threads."""

    def __init__(self, url: str, threads: Threads) -> None:
        self.url, self.threads = url, threads

    def post(self, do: str, argument: object = None) -> httpx.Response:
        return httpx.post(self.url + PATH, content=_file(do, argument), headers=TYPE, timeout=60)


@contextmanager
def start_service(**settings: Any) -> Iterator[Service]:
    """A service of its own; at the end no child is left."""
    PROCESSES.close()
    apps: list[Any] = []

    def record(app: Any) -> Any:
        apps.append(app)
        return app

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(child_processes, "PROGRAM", payloads.__name__)
        with run_service(Settings(threads=1, cache_bytes=0, **settings), record) as url:
            yield Service(url, apps[0].state.services.threads)
        PROCESSES.close()
    assert list_children() == set()


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with start_service() as service:
        yield service


def _file(do: str, argument: object = None) -> bytes:
    return json.dumps({"do": do, "with": argument}).encode().ljust(70_000)


def _wait_until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + 10
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("do", "argument", "status", "code"),
    [
        ("crash", None, 422, "malformed_file"),
        ("fail", None, 422, "malformed_file"),
        ("write", "nonsense", 422, "malformed_file"),
        ("answer", 5, 422, None),  # not the document of a surface
        ("repeat", {"type": "brep", "faces": 5}, 422, "wrong_type"),
        ("repeat", {"type": "group", "members": [{"definition": 5}]}, 422, None),
        ("repeat", {"reading": {"faces": "many"}}, 422, "malformed_file"),
        ("refuse", None, 422, "malformed_file"),
        ("fill memory", None, 422, "too_much_memory"),
    ],
)
def test_no_file_is_an_error_of_the_service(
    service: Service, do: str, argument: object, status: int, code: str | None
) -> None:
    check_problem(service, service.post(do, argument), status, code)


def check_problem(
    service: Service, response: httpx.Response, status: int, code: str | None
) -> None:
    """The response names the error, and the service has its memory and its thread back."""
    assert response.status_code == status
    problem = response.json()
    codes = [problem["code"], *(error["code"] for error in problem["errors"])]
    assert code is None or code in codes
    threads = service.threads
    _wait_until(lambda: threads.used_bytes == threads.busy_count == 0)


@pytest.mark.parametrize("do", ["hang", "compute"])
def test_a_child_ends_at_the_deadline(do: str) -> None:
    with start_service(request_timeout=1) as service:
        check_problem(service, service.post(do), 503, "out_of_time")


def test_a_child_ends_when_its_client_leaves(service: Service) -> None:
    parts, body = urlsplit(service.url), _file("hang")
    head = f"POST {PATH} HTTP/1.1\r\nHost: x\r\nContent-Type: model/step\r\n"
    head += f"Content-Length: {len(body)}\r\n\r\n"
    with socket.create_connection((str(parts.hostname), int(parts.port or 0))) as connection:
        connection.sendall(head.encode() + body)
        _wait_until(lambda: len(list_children()) == 2)  # one reads, one waits for the next file
    threads = service.threads
    _wait_until(lambda: threads.used_bytes == threads.busy_count == 0)
    assert len(list_children()) == 1


def test_the_thread_that_waits_is_charged_to_the_caller() -> None:
    with start_service(request_timeout=2, compute_limit=1) as service:
        assert service.post("hang").status_code == 503  # it took two of the caller's seconds
        refused = service.post("answer", 5)
    assert (refused.status_code, refused.json()["code"]) == (429, "compute_limited")
