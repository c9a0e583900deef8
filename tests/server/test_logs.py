"""The log of the process: its format and its lines; a full or broken pipe blocks no request."""

import json
import logging
import os
import re
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest

from service.api.record import NO_ROUTE, RequestRecord, current_record
from service.server.logs import MAX_MESSAGE, MAX_TEXT, LogLines, RecordFormatter, join_lines
from tools.programs import run_python

TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z")
"""A time as RFC 3339 writes it, in UTC."""

HOSTILE = "a\nERROR:    forged\r\x1b[31m\x9b31m\u2028\u202e\x00\ud800"


def build_error_record() -> logging.LogRecord:
    """A record of an exception with its cause."""
    try:
        try:
            raise KeyError(HOSTILE + "x" * 1000)
        except KeyError as error:
            raise RuntimeError("the second") from error
    except RuntimeError as error:
        info = (type(error), error, error.__traceback__)
        return logging.LogRecord(
            "service.x", logging.ERROR, "x.py", 1, "it %s\n", ("failed",), info
        )


def test_a_json_record_is_one_line_with_the_traceback() -> None:
    line = RecordFormatter("json").format(build_error_record())
    assert line.isprintable()
    fields = json.loads(line)
    assert (fields["level"], fields["logger"], fields["message"]) == (
        "error",
        "service.x",
        "it failed",
    )
    assert fields["event"] == "log"
    assert fields["exception"] == "RuntimeError"
    first, *frames, last = fields["traceback"].split("\n")
    assert "in build_error_record" in first
    assert any(frame.startswith("KeyError: ") for frame in frames)
    assert last == "RuntimeError: the second"
    # The text of the exception is cut, and escapes then make it longer.
    assert all(len(frame) < MAX_TEXT + 200 for frame in frames)
    assert "\x1b" not in fields["traceback"]


def test_texts_of_clients_cannot_break_lines_of_the_log() -> None:
    record = logging.LogRecord("x", logging.WARNING, "x.py", 1, "%s", (HOSTILE * 1000,), None)
    text = RecordFormatter("text").format(record)
    time, level = text.split(" ", 1)
    assert TIME.fullmatch(time)
    assert level.startswith("WARNING:  a\\nERROR:")
    assert text.isprintable()
    assert len(text) < 8 * MAX_MESSAGE  # escaped characters, such as \u2028, are longer
    _, *traceback = RecordFormatter("text").format(build_error_record()).split("\n")
    assert len(traceback) == 4  # the exception and its cause, each with one frame and its text
    assert all(line.startswith("    ") and line.isprintable() for line in traceback)


def test_records_have_the_ids_of_the_running_request() -> None:
    record = logging.LogRecord("x", logging.WARNING, "x.py", 1, "it", None, None)
    assert "request_id" not in json.loads(RecordFormatter("json").format(record))
    token = current_record.set(RequestRecord("GET", NO_ROUTE, "mine", "1" * 32, "2" * 16))
    try:
        fields = json.loads(RecordFormatter("json").format(record))
        record.created = 0.0625
        line = RecordFormatter("text").format(record)
        assert line == "1970-01-01T00:00:00.062Z WARNING:  it (id mine)"
    finally:
        current_record.reset(token)
    ids = fields["request_id"], fields["trace_id"], fields["span_id"]
    assert ids == ("mine", "1" * 32, "2" * 16)


PROGRAM = """
import logging, sys, warnings
from service.server.logs import start_logs
from service.settings.values import Settings

warnings.simplefilter("always")
requests, others = start_logs(Settings(log_format=sys.argv[1]))
requests.write("a request\\n")
logging.getLogger("uvicorn.error").info("Started %s", "here")
logging.getLogger("service.storage").error("it failed")
logging.getLogger("service").debug("not at this level")
warnings.warn("a warning", stacklevel=1)
"""


@pytest.mark.slow
def test_log_messages_and_warnings_go_to_standard_error() -> None:
    process = run_python("-c", PROGRAM, "json")
    assert process.stdout == "a request\n"
    messages = [json.loads(line)["message"] for line in process.stderr.splitlines()]
    assert messages[:2] == ["Started here", "it failed"]
    assert "a warning" in messages[2]
    assert len(messages) == 3


@pytest.mark.slow
def test_messages_before_the_log_is_set_up_have_its_format() -> None:
    """The port is in use, so the process ends with exit code 1 and an error."""
    settings = {"SURFACE_LOG_FORMAT": "json", "SURFACE_NOTHING": "1"}
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = str(listener.getsockname()[1])
        command = ("-m", "service", "serve", "--port", port)
        process = run_python(*command, env=os.environ | settings, check=False)
    assert process.returncode == 1
    *lines, error = process.stderr.splitlines()
    messages = [json.loads(line)["message"] for line in lines]
    assert messages[0].startswith("SURFACE_NOTHING is not a setting of")
    assert messages[1].startswith("Settings: SURFACE_HOST=127.0.0.1 SURFACE_PORT=")
    assert "Address already in use" in messages[-1]
    assert error.startswith(f"surface: cannot serve at 127.0.0.1, port {port}")


@pytest.mark.slow
def test_the_process_ends_even_if_its_log_is_not_read() -> None:
    program = """
from service.server.logs import start_logs
from service.settings.values import Settings
requests, others = start_logs(Settings())
for _ in range(5000): requests.write("x" * 1000 + "\\n")
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
        assert process.wait(300) == 0


@contextmanager
def open_pipe() -> Iterator[tuple[int, int]]:
    """File descriptors of a new pipe, to read and to write."""
    descriptors = os.pipe()
    try:
        yield descriptors
    finally:
        for descriptor in descriptors:
            with suppress(OSError):
                os.close(descriptor)


def wait_until_written(log: LogLines, seconds: float = 10) -> bool:
    """Waits until the thread of the log has written all lines so far; False if it takes longer."""
    has_written = threading.Event()
    # The thread sets an event that it finds in the queue: all lines before it are then written.
    log.lines.put(has_written)
    return has_written.wait(seconds)


def test_lines_are_complete_and_in_order() -> None:
    with open_pipe() as (read_end, write_end):
        log = LogLines(write_end)
        for number in range(1000):
            log.write(f"{number}\n")
        assert wait_until_written(log)
        actual = b""
        while actual.count(b"\n") < 1000:
            actual += os.read(read_end, 1 << 16)
    assert actual.decode().split() == [str(number) for number in range(1000)]
    assert log.dropped == 0


def test_lines_of_several_processes_do_not_mix() -> None:
    """A pipe takes blocks of up to PIPE_BUF bytes at once, whatever other processes write."""
    lines = [f"{number} {'ä' * (number % 700)}\n" for number in range(1000)]
    blocks = list(join_lines([*lines, "x" * 10_000 + "\n"]))
    assert b"".join(blocks[:-1]).decode() == "".join(lines)
    assert all(block.endswith(b"\n") for block in blocks)
    assert max(map(len, blocks[:-1])) <= select.PIPE_BUF
    assert len(blocks) < 300


def test_a_full_pipe_blocks_no_writer() -> None:
    with open_pipe() as (read_end, write_end):
        log = LogLines(write_end, max_lines=100)
        line = "x" * 1000 + "\n"
        for _ in range(500):
            log.write(line)
        assert log.dropped > 0
        assert not wait_until_written(log, 0.2)
        may_end = threading.Event()

        def drain() -> None:
            while not may_end.is_set():
                if len(os.read(read_end, 1 << 16)) == 0:
                    break

        reader = threading.Thread(target=drain, daemon=True)
        reader.start()
        assert wait_until_written(log)
        may_end.set()
        log.write("end\n")  # ends the reader's last `os.read`
        assert wait_until_written(log)
        reader.join(10)


def test_a_closed_pipe_is_no_error() -> None:
    with open_pipe() as (read_end, write_end):
        os.close(read_end)
        log = LogLines(write_end)
        log.write("a\n")
        log.write("b\n")
        assert wait_until_written(log)
    assert log.dropped == 2
    without_file = LogLines(-1)
    without_file.write("a\n")
    assert wait_until_written(without_file)
    assert without_file.dropped == 1
