"""Long work: a call that takes too long for a request becomes a job, and waits for its result."""

import json
import re
import time
from collections.abc import Callable
from contextlib import aclosing, suppress
from dataclasses import dataclass, replace
from typing import Any

import httpx

from service.client.bodies import JSON, Request, write_json
from service.client.connection import LEAST, Connection, Deadline, find_problem, find_wait
from service.client.errors import ServiceError, read_problem
from service.client.records import Record

PATIENCE = 10.0
"""Seconds to wait for a result; then the work is asked for again as a job."""

PAUSE, MAX_SILENCE = 1.0, 120.0
"""Seconds before a client connects again when the events of a job end too early: so long may a
restart of the service take at most."""

EVENT_TIMEOUT = 60.0
"""Seconds without an event, or a comment between events, after which the connection is lost."""

EVENTS = "text/event-stream"

_PREFER = {"Prefer": "respond-async"}
"""The header with which a call makes a job (RFC 7240)."""

_PART = re.compile(r"^/parts/\d+(/body|/file|/path)?(?![^/])")
"""The pointer to a part of a job, or to the body, the file or the path of the part."""

Progress = Callable[[Record], None]
"""Called with each state of a job."""


def show_nothing(state: Record) -> None:
    """The default of `Progress`."""


@dataclass(frozen=True, slots=True)
class Work:
    """The deadline of a call, and the function that gets the states of its job."""

    deadline: Deadline
    progress: Progress = show_nothing


async def compute(connection: Connection, request: Request, work: Work) -> httpx.Response:
    """The response of a call: computed at once or, if that takes too long, by a job.

    Raises
    ------
    ServiceError
    """
    try:
        response = await connection.send(request, work.deadline, PATIENCE)
    except httpx.ReadTimeout:
        response = await _ask_job(connection, request, work)
    else:
        if _takes_long(response):
            response = await _ask_job(connection, request, work)
    if (state := _find_state(response)) is None:
        return connection.read(response, request.accept)
    job = await _wait(connection, state, work)
    if job.state["state"] == "succeeded":
        return await _fetch(connection, f"{job.url}/results/0", request.accept, work)
    (result,) = await _list_results(connection, job.url, work)
    raise _read_failure(result)


async def compute_all(
    connection: Connection, requests: list[Request], work: Work
) -> list[httpx.Response | ServiceError]:
    """The responses of several calls, which are the parts of one job; or their errors.

    Raises
    ------
    ServiceError
        The job as a whole is refused; pointers begin with `/parts/` and the index of the part.
    """
    parts = [_write_part(request) for request in requests]
    ask = Request("POST", "/v1/jobs", content=write_json({"parts": parts}))
    response = await connection.send(ask, work.deadline)
    state = _find_state(response)
    if state is None:
        connection.read(response, JSON)
        raise ServiceError(response.status_code, "not_a_surface_service", "The job has no URL.")
    job = await _wait(connection, state, work)
    results: list[httpx.Response | ServiceError] = []
    listed = await _list_results(connection, job.url, work)
    for number, (request, result) in enumerate(zip(requests, listed, strict=True)):
        if "problem" in result:
            results.append(_read_failure(result))
        else:
            url = f"{job.url}/results/{number}"
            results.append(await _fetch(connection, url, request.accept, work))
    return results


@dataclass(frozen=True, slots=True)
class _Job:
    """The URL of a job, and its last state."""

    url: httpx.URL
    state: dict[str, Any]


def _write_part(request: Request) -> dict[str, Any]:
    """A request as a part of a job."""
    if request.method == "GET":
        return {"path": request.url}
    return {"path": request.url, "body": json.loads(request.content)}


def _takes_long(response: httpx.Response) -> bool:
    """Whether the service would need more time for the work than it has for a request."""
    problem = find_problem(response)
    codes = {problem.get("code"), *(error["code"] for error in problem.get("errors", ()))}
    return bool({"out_of_time", "too_costly"} & codes)


async def _ask_job(connection: Connection, request: Request, work: Work) -> httpx.Response:
    """The response with the state of a job; a service without jobs answers the call itself."""
    if request.method == "POST":
        return await connection.send(request, work.deadline, headers=_PREFER)
    ask = Request("POST", "/v1/jobs", content=write_json({"parts": [{"path": request.url}]}))
    response = await connection.send(ask, work.deadline)
    return response if response.is_success else await connection.send(request, work.deadline)


def _find_state(response: httpx.Response) -> dict[str, Any] | None:
    """The state of the job that a response has; None for other responses."""
    if not (response.is_success and "/v1/jobs/" in response.headers.get("location", "")):
        return None
    state: dict[str, Any] = response.json()
    return state


async def _wait(connection: Connection, state: dict[str, Any], work: Work) -> _Job:
    """The job when it has ended; if the caller stops waiting, the job is withdrawn."""
    job = _Job(httpx.URL(connection.url).join(state["links"]["self"]), state)
    try:
        job = await _follow(connection, job, work)
    except BaseException:
        with suppress(httpx.HTTPError):
            await connection.transport.request("DELETE", str(job.url), timeout=5)
        raise
    if job.state["state"] == "cancelled":
        raise ServiceError(0, "cancelled", f"{connection.url}: the job was withdrawn")
    return job


async def _follow(connection: Connection, job: _Job, work: Work) -> _Job:
    """The job when it has ended, by its events."""
    last_answer = time.monotonic()
    while not _has_ended(job.state):
        if not work.deadline.left:
            raise ServiceError(0, "timeout", f"{connection.url}: the job takes too long")
        timeout = httpx.Timeout(10, read=min(EVENT_TIMEOUT, work.deadline.left + LEAST))
        pause = PAUSE
        try:
            async with aclosing(connection.transport.lines(f"{job.url}/events", timeout)) as lines:
                async for line in lines:
                    if line.startswith("data: "):
                        job = replace(job, state=json.loads(line.removeprefix("data: ")))
                        last_answer = time.monotonic()
                        work.progress(Record(job.state))
        except httpx.HTTPStatusError as error:
            wait = find_wait(error.response)
            if wait is None or wait > work.deadline.left:
                connection.read(error.response, EVENTS)
            pause = wait or PAUSE
        except httpx.TransportError as error:
            if time.monotonic() > last_answer + MAX_SILENCE:
                raise connection.fail(error) from error
        if not _has_ended(job.state):
            await connection.transport.sleep(pause)
    return job


async def _fetch(connection: Connection, url: str, accept: str, work: Work) -> httpx.Response:
    """The file of a part."""
    response = await connection.send(Request("GET", url), work.deadline)
    return connection.read(response, accept)


async def _list_results(connection: Connection, job: httpx.URL, work: Work) -> list[dict[str, Any]]:
    """The results of all parts, in their order."""
    results: list[dict[str, Any]] = []
    url: str | None = f"{job}/results"
    while url is not None:
        page = (await _fetch(connection, url, JSON, work)).json()
        results += page["results"]
        url = str(job.join(page["next"])) if "next" in page else None
    return results


def _read_failure(result: dict[str, Any]) -> ServiceError:
    """The error of a part that failed, with the pointers of its call."""
    error = read_problem(result["problem"])
    issues = (replace(issue, pointer=_PART.sub("", issue.pointer)) for issue in error.errors)
    return ServiceError(error.status, error.code, error.detail, tuple(issues))


def _has_ended(state: dict[str, Any]) -> bool:
    return state["state"] not in ("queued", "running")
