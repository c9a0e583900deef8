"""A file that is read in a child process can neither harm the service nor learn anything of it."""

import json
import os
import platform
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from service.cancellation import Cancellation, Cancelled, OutOfTime, cancelled_by
from service.decoders import child, child_processes, child_program, confinement
from service.decoders.child_processes import PROCESSES, start_process
from service.decoders.format import Decoded, Decoder, FileLimits
from service.errors import Busy, InvalidRequest, SurfaceError, TooLarge
from tests.decoders import payloads
from tests.decoders.children import list_children

MEBIBYTE = 1 << 20

READING = {"format": "step", "faces": 7, "products": 2000, "skipped_faces": []}
"""The report of each file of 2000 bytes."""

is_linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux refuses system calls")


def _decode_here(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
    """A decoder that reads a short file in this process, or fails at it."""
    if content == b"MemoryError":
        raise MemoryError
    if content == b"ZeroDivisionError":
        raise ZeroDivisionError
    return Decoded({"here": content, "kind": kind, "limits": limits})


DECODER = Decoder(
    "step", "STEP", "model/step", ("step",), True, (), _decode_here, "", 4, 60 * MEBIBYTE,
    child_bytes=1000,
)  # fmt: skip


@pytest.fixture(autouse=True)
def program(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Lets the children run the program of the payloads; none waits for a next file."""
    PROCESSES.close()
    monkeypatch.setattr(PROCESSES, "starts_ahead", False)
    monkeypatch.setattr(child_processes, "PROGRAM", payloads.__name__)
    yield
    PROCESSES.close()


@pytest.fixture
def starts_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next process waits, as in a service."""
    monkeypatch.setattr(PROCESSES, "starts_ahead", True)


def read(do: str, argument: object = None, length: int = 2000) -> Decoded:
    content = json.dumps({"do": do, "with": argument}).encode().ljust(length)
    return child.read_file(DECODER, content, "brep", FileLimits(max_faces=7))


def refuse(do: str, argument: object = None) -> tuple[type[SurfaceError], str]:
    """The class and the code of the error that a payload gives."""
    with pytest.raises(SurfaceError) as caught:
        read(do, argument)
    (issue,) = caught.value.issues
    return type(caught.value), issue.code


def test_bytes_go_in_and_arrays_come_out() -> None:
    decoded = read("answer", 1000)
    assert decoded.tree["kind"] == "brep"
    assert decoded.tree["nothing"] is None
    np.testing.assert_array_equal(decoded.tree["array"], np.arange(1000.0))
    assert decoded.reading == READING
    assert read("answer", 500_000, 8 * MEBIBYTE).tree["array"].nbytes == 4_000_000


def test_a_short_file_is_read_in_this_process() -> None:
    limits = FileLimits()
    decoded = child.read_file(DECODER, b"short", None, limits)
    assert decoded.tree == {"here": b"short", "kind": None, "limits": limits}
    for content, code in (
        (b"MemoryError", "too_much_memory"),
        (b"ZeroDivisionError", "malformed_file"),
    ):
        with pytest.raises(SurfaceError) as caught:
            child.read_file(DECODER, content, None, limits)
        assert caught.value.issues[0].code == code


@is_linux
def test_a_child_has_two_pipes_and_no_variables() -> None:
    described = read("describe").tree
    assert described["descriptors"] == [0, 1, 2]  # 2 is /dev/null
    assert described["variables"] == {}
    assert described["threads"] == 1
    rooms = {name.split(".")[1] for name in described["modules"] if name.startswith("service.")}
    assert rooms == {"bases", "cancellation", "decoders", "errors", "framing", "surface"}
    assert not {"pydantic", "fastapi", "obstore"} & set(described["modules"])


@is_linux
@pytest.mark.skipif(
    platform.machine() not in confinement.ARCHITECTURES, reason="no numbers of system calls"
)
def test_a_child_may_use_memory_and_its_pipes_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "secret"
    path.write_text("secret")
    refused = read("try everything", str(path)).tree
    del refused["kind"], refused["type"]
    assert len(refused) > 10
    errors = {"PermissionError", "ModuleNotFoundError", "RuntimeError"}
    assert {name: error for name, error in refused.items() if error not in errors} == {}
    assert os.listdir(tmp_path) == ["secret"]


@is_linux
def test_a_child_that_takes_too_much_memory_is_refused() -> None:
    assert refuse("fill memory") == (TooLarge, "too_much_memory")
    assert refuse("take an array", 10**8) == (TooLarge, "too_much_memory")
    assert read("take an array", 10**6).tree["array"].sum() == 10**6


@pytest.mark.slow
def test_an_answer_that_is_too_long_is_refused() -> None:
    assert refuse("write much", 14 * MEBIBYTE) == (InvalidRequest, "malformed_file")  # no frame
    assert refuse("write much", 16 * MEBIBYTE) == (TooLarge, "too_much_memory")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("do", "argument"),
    [
        ("crash", None),
        ("die", 15),
        ("fail", None),
        ("nest", 5000),
        ("write", "no frame"),
        ("write", '{"arrays":[],"answer":{}}\n'),
        ("write", '{"arrays":[],"answer":{"error":"OSError","issues":[]},"is_confined":1}\n'),
        ("write", '{"arrays":[],"answer":{"tree":7,"reading":{}},"is_confined":1}\n'),
        ("write", '{"arrays":[],"answer":{}}\n{"arrays":[],"answer":5,"is_confined":1}\n'),
        ("write", '{"arrays":[],"answer":{}}\n{"arrays":[],"answer":{"tree":[]}}\n'),
        ("write", '{}\n{"arrays":[],"answer":{"tree":{"type":"group"},"reading":{}}}\n'),
        ("repeat", {"type": 7}),
        ("repeat", {"reading": {"faces": -1}}),
        ("write", ""),
        ("close and hang", None),
    ],
)
def test_a_child_that_crashes_or_talks_nonsense_is_an_error_of_the_file(
    do: str, argument: object
) -> None:
    assert refuse(do, argument) == (InvalidRequest, "malformed_file")


def test_an_error_of_the_decoder_is_that_of_the_file() -> None:
    with pytest.raises(InvalidRequest) as caught:
        read("refuse")
    (issue,) = caught.value.issues
    assert (issue.code, issue.message) == ("malformed_file", "Nothing can be read.")
    assert (issue.got, issue.needed) == ("a test", "a file")


def test_a_fault_of_the_reader_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    refuse("fail")
    assert "LookupError: a fault of the reader" in caplog.text


@pytest.mark.slow
@is_linux
@pytest.mark.usefixtures("starts_ahead")
@pytest.mark.parametrize("do", ["hang", "compute"])
def test_a_child_ends_at_the_deadline(do: str) -> None:
    read("answer", 1)
    before = time.monotonic()
    with cancelled_by(Cancellation(before + 0.5)), pytest.raises(OutOfTime):
        read(do)
    assert 0.5 <= time.monotonic() - before < 5
    PROCESSES.close()
    assert list_children() == set()


@is_linux
@pytest.mark.usefixtures("starts_ahead")
def test_a_child_ends_when_the_client_leaves() -> None:
    cancellation = Cancellation()
    timer = threading.Timer(0.5, cancellation.cancel)
    timer.start()
    with cancelled_by(cancellation), pytest.raises(Cancelled):
        read("hang")
    PROCESSES.close()
    assert list_children() == set()


@pytest.mark.slow
@is_linux
@pytest.mark.usefixtures("starts_ahead")
def test_the_next_process_waits_and_one_that_has_died_is_replaced() -> None:
    read("answer", 1)
    (spare,) = list_children()
    os.kill(spare, 9)
    while b" Z " not in Path(f"/proc/{spare}/stat").read_bytes():  # the signal is on its way
        time.sleep(0.01)
    assert read("answer", 1).reading == READING
    (other,) = list_children()
    assert other != spare


@is_linux
def test_a_program_for_one_file_starts_no_other_process() -> None:
    assert read("answer", 1).reading == READING
    assert list_children() == set()


@is_linux
@pytest.mark.usefixtures("starts_ahead")
def test_a_file_is_refused_for_now_if_no_process_can_be_started(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise BlockingIOError("Resource temporarily unavailable")

    read("answer", 1)  # the next process waits
    monkeypatch.setattr(child_processes, "start_process", fail)
    assert read("answer", 1).reading == READING
    with pytest.raises(Busy):
        read("answer", 1)
    assert "No process could be started" in caplog.text
    assert list_children() == set()


@pytest.mark.slow
@is_linux
@pytest.mark.usefixtures("starts_ahead")
def test_many_threads_read_at_once() -> None:
    results: list[int] = []

    def read_some(number: int) -> None:
        results.extend(read("answer", number + k).tree["array"].size - k for k in range(2))

    threads = [threading.Thread(target=read_some, args=(10 * n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(results) == sorted(10 * n for n in range(4) for _ in range(2))
    assert len(list_children()) == 1


@is_linux
@pytest.mark.parametrize("do", ["idle", "hang"])
def test_a_child_does_not_outlive_the_service(do: str) -> None:
    """The pipes close, whether the child waits for a file, or reads one that comes slowly."""
    process = start_process()
    assert process.stdin is not None
    assert process.stdout is not None
    if do == "hang":
        task: dict[str, object] = {
            "decoder": "step",
            "is_mesh": False,
            "kind": None,
            "limits": [],
            "length": 9,
            "memory": 1 << 25,
        }
        process.stdin.write(json.dumps(task | {"seconds": 9}).encode() + b"\n1234")
    process.stdin.close()
    assert process.stdout.read() == b""
    assert process.wait(5) == 0
    process.stdout.close()


def test_the_program_of_a_child_is_the_one_that_is_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.undo()
    assert child_program.__name__ == child_processes.PROGRAM


def test_a_system_that_cannot_confine_children_is_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    processes = child_processes.ChildProcesses()
    processes.report_confinement(is_confined=True)
    assert caplog.text == ""
    processes.report_confinement(is_confined=False)
    processes.report_confinement(is_confined=False)
    assert caplog.text.count("cannot refuse system calls") == 1


@pytest.mark.slow
@is_linux
def test_a_step_may_have_less_time_than_the_file() -> None:
    """The payload computes for 0.3 s, in a step of 0.1 s; or in one of 1 s, and the limit stays."""
    assert refuse("step", [0.1, 0.3]) == (InvalidRequest, "malformed_file")
    assert 4 < read("step", [1.0, 0.3]).tree["left"] < 4.8


def test_a_step_of_a_process_without_limits_is_not_bounded() -> None:
    with confinement.limit_step(1e-3):
        end = time.process_time() + 0.05
        while time.process_time() < end:
            pass
