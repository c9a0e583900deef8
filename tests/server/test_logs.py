"""The log of the process: one form, whole lines, and no reason to end."""

import json
import logging
import os
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Literal

import pytest

from service.api.observing.record import NO_ROUTE, RequestRecord, current_record
from service.server.logs import held, logs
from service.server.records import MESSAGE, TEXT, JsonRecords, TextRecords
from service.server.sink import Sink
from service.settings.values import Settings

HOSTILE = "a\nERROR:    forged\r\x1b[31m\x9b31m\u2028\u202e\x00\ud800"


@contextmanager
def streams(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Files that stand for standard output and standard error."""
    places = folder / "out", folder / "err"
    with (
        places[0].open("w") as out,
        places[1].open("w") as err,
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        yield places


def failing() -> logging.LogRecord:
    """A record of an exception, and what it came from."""
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


def test_a_record_is_one_object_in_one_line() -> None:
    line = JsonRecords().format(failing())
    assert line.isprintable()
    told = json.loads(line)
    assert (told["level"], told["logger"], told["message"]) == ("error", "service.x", "it failed")
    assert told["event"] == "log"
    assert told["exception"] == "RuntimeError"
    first, *frames, last = told["traceback"].split("\n")
    assert "in failing" in first
    assert any(frame.startswith("KeyError: ") for frame in frames)
    assert last == "RuntimeError: the second"
    assert all(len(frame) < TEXT + 200 for frame in frames)
    assert "\x1b" not in told["traceback"]


def test_text_cannot_be_forged() -> None:
    record = logging.LogRecord("x", logging.WARNING, "x.py", 1, "%s", (HOSTILE * 1000,), None)
    text = TextRecords().format(record)
    assert text.startswith("WARNING:  a\\x0aERROR:")
    assert text.isprintable()
    assert len(text) < 8 * MESSAGE
    _, *below = TextRecords().format(failing()).split("\n")
    assert len(below) == 4
    assert all(line.startswith("    ") and line.isprintable() for line in below)


def test_records_tell_of_the_request_that_is_under_way() -> None:
    record = logging.LogRecord("x", logging.WARNING, "x.py", 1, "it", None, None)
    assert "request_id" not in json.loads(JsonRecords().format(record))
    token = current_record.set(RequestRecord("GET", NO_ROUTE, "mine", "1" * 32, "2" * 16))
    try:
        told = json.loads(JsonRecords().format(record))
        assert TextRecords().format(record) == "WARNING:  it (id mine)"
    finally:
        current_record.reset(token)
    ids = told["request_id"], told["trace_id"], told["span_id"]
    assert ids == ("mine", "1" * 32, "2" * 16)


@pytest.mark.parametrize("form", ["text", "json"])
def test_everything_goes_one_way(tmp_path: Path, form: Literal["text", "json"]) -> None:
    root = logging.getLogger()
    before = root.handlers[:], root.level
    with (
        streams(tmp_path) as (out, err),
        warnings.catch_warnings(),
        logs(Settings(log_format=form)) as log,
    ):
        warnings.simplefilter("always")
        log.requests.write("a request\n")
        logging.getLogger("uvicorn.error").info("Started %s", "here")
        logging.getLogger("service.storage").error("it failed")
        logging.getLogger("service").debug("not at this level")
        warnings.warn("a warning", stacklevel=1)
    assert (root.handlers, root.level) == before
    assert out.read_text() == "a request\n"
    lines = err.read_text().splitlines()
    assert len(lines) == 3
    if form == "json":
        told = [json.loads(line)["message"] for line in lines]
        assert told[:2] == ["Started here", "it failed"]
        assert "a warning" in told[2]
    else:
        assert lines[:2] == ["INFO:     Started here", "ERROR:    it failed"]


def test_what_is_logged_before_the_log_is_there_is_kept(tmp_path: Path) -> None:
    with streams(tmp_path) as (_, err), ExitStack() as stack:
        with held():
            logging.getLogger("service.settings").warning("unknown")
            log = stack.enter_context(logs(Settings(log_format="json")))
        assert log.others.flush(10)
    assert json.loads(err.read_text())["message"] == "unknown"


@contextmanager
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    try:
        yield ends
    finally:
        for end in ends:
            try:
                os.close(end)
            except OSError:
                continue


def test_lines_come_whole_and_in_order() -> None:
    with pipe() as (read, write):
        sink = Sink(write)
        for number in range(1000):
            sink.write(f"{number}\n")
        assert sink.flush(10)
        got = b""
        while got.count(b"\n") < 1000:
            got += os.read(read, 1 << 16)
    assert got.decode().split() == [str(number) for number in range(1000)]
    assert sink.dropped == 0


def test_a_pipe_that_nobody_reads_blocks_nobody() -> None:
    with pipe() as (read, write):
        sink = Sink(write, waiting=100)
        line = "x" * 1000 + "\n"
        for _ in range(500):
            sink.write(line)
        assert sink.dropped > 0
        assert not sink.flush(0.01)
        done = threading.Event()

        def drain() -> None:
            while not done.is_set():
                if len(os.read(read, 1 << 16)) == 0:
                    break

        reader = threading.Thread(target=drain, daemon=True)
        reader.start()
        assert sink.flush(10)
        done.set()
        sink.write_now("end\n")
        assert sink.flush(10)
        reader.join(10)


def test_a_reader_that_has_gone_is_no_error() -> None:
    with pipe() as (read, write):
        os.close(read)
        sink = Sink(write)
        sink.write("a\n")
        sink.write("b\n")
        assert sink.flush(10)
    assert sink.dropped == 2
    nowhere = Sink(-1)
    nowhere.write("a\n")
    assert nowhere.flush(10)
    assert nowhere.dropped == 1
