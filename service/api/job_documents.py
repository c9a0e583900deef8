"""Jobs and their results as documents, and the responses with them."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from fastapi import Request, Response

from service.api.problems import problem_document, problem_of
from service.api.responses import HEADERS, json_response
from service.jobs.state import JobState, PartResult

JOB_HEADERS = HEADERS | {"Cache-Control": "no-store"}
"""Headers of documents about jobs, which change at any moment."""


def job_url(root: str, id: str) -> str:
    """The URL of a job; `root` is the path that the service is mounted at, often empty."""
    return f"{root}/v1/jobs/{id}"


def describe_state(state: JobState, root: str) -> dict[str, Any]:
    """The document of a job's state."""
    url = job_url(root, state.id)
    document = {
        "id": state.id,
        "state": state.state,
        "engine": state.engine,
        "parts": {
            "total": state.total,
            "queued": state.queued,
            "running": state.running,
            "succeeded": state.succeeded,
            "failed": state.failed,
        },
        "created": _format_time(state.created),
        "started": _format_time(state.started),
        "ended": _format_time(state.ended),
        "expires": _format_time(state.expires),
        "rate": state.rate,
        "seconds_left": state.seconds_left,
        "links": {"self": url, "events": f"{url}/events", "results": f"{url}/results"},
    }
    return document | ({"waiting_for": state.waiting_for} if state.waiting_for else {})


def _format_time(time: datetime | None) -> str | None:
    """A time in UTC as RFC 3339 writes it, with milliseconds."""
    if time is None:
        return None
    return time.replace(tzinfo=None).isoformat(timespec="milliseconds") + "Z"


def describe_result(result: PartResult, root: str, id: str) -> dict[str, Any]:
    """The document of a part of the job `id`: its state, and its file or its error."""
    name = result.name or str(result.part)
    document: dict[str, Any] = {"part": result.part, "name": name, "state": result.state}
    if result.error is not None:
        error = result.error.within(f"/parts/{result.part}")
        document["problem"] = problem_document(problem_of(error), error.issues, "pointer")
    if (file := result.result) is not None:
        document |= {
            "media_type": file.media_type,
            "bytes": file.bytes,
            "sha256": file.sha256,
            "link": f"{job_url(root, id)}/results/{result.part}",
        }
    return document


def state_response(state: JobState, request: Request, headers: Mapping[str, str]) -> Response:
    """The response to a client that asks for a job: 200 if it has succeeded already, else 202."""
    root = request.scope.get("root_path", "")
    headers = {**JOB_HEADERS, **headers, "Location": job_url(root, state.id)}
    if state.state == "succeeded":
        return json_response(describe_state(state, root), 200, headers)
    return json_response(describe_state(state, root), 202, headers | {"Retry-After": "1"})
