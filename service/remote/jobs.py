"""Waits for a job of one part at a service, shows its progress, and fetches its result."""

import re
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, TypeAlias

import httpx
import orjson

from service.errors import ServiceFailed
from service.remote.connection import Connection

PREFER = {"Prefer": "respond-async"}
"""The header with which a call makes a job (RFC 7240)."""

PAUSE, MAX_SILENCE = 1.0, 120.0
"""Seconds before the program connects again when the events of a job end too early: so long may a
restart of the service take at most."""

EVENT_TIMEOUT = 60.0
"""Seconds without an event, or a comment between events, after which the connection is lost."""

_PART = re.compile(r"^/parts/0(/body|/file|/path)?(?![^/])")
"""The pointer to the only part of a job, or to what the part has of the call."""

State: TypeAlias = dict[str, Any]
"""The document of a job's state."""


def find_state(response: httpx.Response) -> State | None:
    """The state of the job that a response has; None for other responses."""
    if not (response.is_success and "/v1/jobs/" in response.headers.get("location", "")):
        return None
    state: State = response.json()
    return state


def fetch_result(connection: Connection, state: State, expected_type: str) -> bytes:
    """The result of a job's only part, as soon as it has ended.

    Ctrl-C withdraws the job.

    Raises
    ------
    InvalidRequest, ServiceFailed
    """
    job = httpx.URL(connection.url).join(state["links"]["self"])
    try:
        state = _wait(connection, job, state)
    except KeyboardInterrupt:
        with suppress(httpx.HTTPError):
            connection.client.delete(job, timeout=5)
        raise
    finally:
        _show("")
    if state["state"] == "cancelled":
        raise ServiceFailed(f"{connection.url}: the job was withdrawn")
    if state["state"] == "succeeded":
        return connection.read(connection.send("GET", f"{job}/results/0"), expected_type)
    listed = connection.read(connection.send("GET", f"{job}/results"), "application/json")
    problem = orjson.loads(listed)["results"][0]["problem"]
    for error in problem["errors"]:
        # The pointer is that of the job, whose only part has the body, or the file, of the call.
        error["pointer"] = _PART.sub("", error["pointer"])
    raise connection.failure(problem["status"], problem)


def _wait(connection: Connection, job: httpx.URL, state: State) -> State:
    """The state of a job that has ended; shows each change before."""
    start = last_answer = time.monotonic()
    while not _has_ended(state):
        try:
            for change in _read_events(connection, f"{job}/events"):
                state, last_answer = change, time.monotonic()
                _show(_describe(state, last_answer - start))
        except httpx.TransportError:
            if time.monotonic() > last_answer + MAX_SILENCE:
                raise
        if not _has_ended(state):
            time.sleep(PAUSE)
    return state


def _read_events(connection: Connection, url: str) -> Iterator[State]:
    """The states in a stream of events, until it ends."""
    timeout = httpx.Timeout(10, read=EVENT_TIMEOUT)
    with connection.client.stream("GET", url, timeout=timeout) as response:
        if not response.is_success:
            response.read()
            connection.read(response, "text/event-stream")
        for line in response.iter_lines():
            if line.startswith("data: "):
                yield orjson.loads(line.removeprefix("data: "))


def _has_ended(state: State) -> bool:
    return state["state"] not in ("queued", "running")


def _describe(state: State, seconds: float) -> str:
    """The state in words, for people."""
    waiting = state.get("waiting_for")
    reason = f", waits for {waiting}" if waiting else ""
    return f"computed as a job: {state['state']}{reason}, {seconds:.0f} s; Ctrl-C withdraws it"


def _show(line: str) -> None:
    """Replaces the last line of the terminal; writes nothing if there is none."""
    if sys.stderr is not None and sys.stderr.isatty():
        print(f"\r\x1b[K{line}", end="", file=sys.stderr, flush=True)
