"""Parameters, headers and examples of the routes for jobs, for the OpenAPI document."""

from datetime import UTC, datetime
from hashlib import sha256
from typing import Annotated, TypeAlias

import orjson
from fastapi import Path
from pydantic import WithJsonSchema

from service.api.caching.cached_response import FOR_EVER
from service.api.job_documents import describe_result, describe_state, job_url
from service.api.lines import MEDIA_TYPE
from service.api.openapi.parameters import Json, json_body, parameter
from service.api.openapi.responses import EXAMPLE_RESPONSES, TIMED, error, file_schema, header
from service.encoders.cad.registry import CONVERSION_FORMATS
from service.encoders.polylines.registry import CURVE_FORMATS, SECTION_FORMATS
from service.encoders.registry import FORMATS
from service.engine.mesh.mesh import ENGINE
from service.errors import Issue, TooLarge
from service.jobs.parts import read_part
from service.jobs.results import Result
from service.jobs.state import JobState, PartResult
from service.pipeline.calls import CallLimits
from service.schemas.jobs import MAX_LISTED, JobRequest
from service.schemas.validation import validate_document

_SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
JOBS: Json = {
    "meshes": {
        "summary": "Two meshes: of a surface in the body, and of a built-in one by URL",
        "value": {
            "parts": [
                {"name": "lid", "path": "/v1/mesh?format=glb", "body": {"surface": _SQUARE}},
                {"name": "hull", "path": "/v1/surfaces/ship-hull/mesh.stl?resolution=8"},
            ]
        },
    },
    "questions": {
        "summary": "The area and a point of a surface",
        "value": {
            "parts": [
                {"path": "/v1/measure", "body": {"surface": _SQUARE}},
                {"path": "/v1/points", "body": {"surface": _SQUARE, "uv": [[0.5, 0.5]]}},
            ]
        },
    },
}


def _id_of(document: Json) -> str:
    """The id of the job with this body."""
    parts = validate_document(JobRequest, document).parts
    ids = [read_part(part.path, part.body, CallLimits()).id for part in parts]
    return sha256(bytes.fromhex("".join(ids))).hexdigest()


_ID = _id_of(JOBS["meshes"]["value"])

JOB_ERRORS: dict[int | str, Json] = {
    404: error("UnknownJob"),
    422: error("InvalidQuery"),
    500: error("InternalError"),
    503: error("StoreFailed"),
}
"""The errors of the routes about one job."""

JobId: TypeAlias = Annotated[
    str,
    WithJsonSchema({"type": "string", "pattern": "^[0-9a-f]{64}$"}),
    Path(description="Id of a job.", openapi_examples={"meshes": {"value": _ID}}),
]
PartIndex: TypeAlias = Annotated[
    str,
    WithJsonSchema({"type": "integer", "minimum": 0}),
    Path(description="Index of a part.", openapi_examples={"first": {"value": 0}}),
]
RANGE: list[Json] = [
    parameter(
        "query", "from", "Index of the first part.", {"type": "integer", "minimum": 0, "default": 0}
    ),
    parameter(
        "query",
        "limit",
        "The most parts.",
        {"type": "integer", "minimum": 1, "maximum": MAX_LISTED, "default": MAX_LISTED},
    ),
]
PREFER = parameter(
    "header",
    "Prefer",
    "`respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The "
    "response, in place of the result, is then 202 with the state of this job, a `Job`, and the "
    "headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or "
    "of rays, and for a file of a mesh that, with its surface, would be too long as JSON.",
    {"type": "string"},
)


def _time(minute: int, second: int) -> datetime:
    return datetime(2026, 11, 29, 14, minute, second, 125_000, UTC)


_RUNNING = JobState(
    id=_ID,
    state="running",
    engine=ENGINE,
    total=100,
    queued=56,
    running=2,
    succeeded=41,
    failed=1,
    created=_time(40, 20),
    started=_time(40, 21),
    ended=None,
    expires=_time(40, 20).replace(month=12, day=6),
    rate=12.5,
    seconds_left=5,
)
_ENDED = JobState(
    id=_ID,
    state="succeeded",
    engine=ENGINE,
    total=2,
    queued=0,
    running=0,
    succeeded=2,
    failed=0,
    created=_time(40, 20),
    started=_time(40, 21),
    ended=_time(40, 22),
    expires=_time(40, 22).replace(month=12, day=6),
)

_LINKS = {
    "State": ("getJob", "The state of the job."),
    "Events": ("getJobEvents", "Its state as a stream of events."),
    "Results": ("getJobResults", "The list of its results."),
    "Withdrawal": ("withdrawJob", "Its withdrawal."),
}
LINKS: Json = {
    name: {
        "operationId": operation,
        "description": text,
        "parameters": {"id": "$response.body#/id"},
    }
    for name, (operation, text) in _LINKS.items()
}
LOCATION: Json = {"Location": header("URL of the job, without the host.", job_url("", _ID))}
RETRY_LATER: Json = {
    "Retry-After": header(
        "Seconds after which to ask again. Not sent when the job has ended.",
        1,
        is_required=False,
        type="integer",
    )
}


def _states() -> Json:
    """Examples of the state of a job."""
    return {state.state: {"value": describe_state(state, "")} for state in (_RUNNING, _ENDED)}


_EVENTS = "".join(
    f"event: {name}\ndata: {orjson.dumps(describe_state(state, '')).decode()}\nretry: 1000\n\n"
    for name, state in (("progress", _RUNNING), ("end", _ENDED))
)
EVENTS: Json = {"schema": {"type": "string"}, "example": _EVENTS}

_FAILURE = TooLarge(
    Issue(
        "too_many_vertices",
        "The mesh would have more vertices than this service allows.",
        "/body/resolution",
        "81018001 vertices",
        "at most 4500000",
    )
)
_RESULTS = (
    PartResult(0, "", "lid", "succeeded", Result("model/gltf-binary", "glb", "", 1940, _ID)),
    PartResult(1, "", "hull", "running"),
    PartResult(2, "", "keel", "failed", error=_FAILURE),
)

# The document is built without members whose value is null, and then these examples are added.
EXAMPLE_RESPONSES |= {
    "storeJobFile": lambda: {"part": {"value": {"id": f"{_ID}.step", "bytes": 12_636}}},
    "createJob": _states,
    "getJob": _states,
    "listJobs": lambda: {"one": {"value": {"jobs": [describe_state(_RUNNING, "")]}}},
    "getJobResults": lambda: {
        "three": {"value": {"results": [describe_result(each, "", _ID) for each in _RESULTS]}}
    },
}

RESULT_HEADERS: Json = {
    "ETag": header("The SHA-256 of the file, in quotes.", f'"{_ID}"'),
    "Cache-Control": header("The file never changes.", FOR_EVER),
    "Content-Disposition": header(
        "A name to save the file under. Not sent with JSON.",
        'attachment; filename="lid.glb"',
        is_required=False,
    ),
}
_FORMATS = (*FORMATS, *CONVERSION_FORMATS, *CURVE_FORMATS, *SECTION_FORMATS)
_FILES = {fmt.media_type: fmt for fmt in _FORMATS}
RESULT_CONTENT: Json = {name: {"schema": file_schema(f)} for name, f in _FILES.items()}


ACCEPTED: Json = {
    "description": "The job is accepted.",
    "headers": TIMED | LOCATION | RETRY_LATER,
    "links": LINKS,
}
"""The response 202."""


_PREFERRED: Json = {
    "Preference-Applied": header(
        "Only in the response 202 to `Prefer: respond-async`: this preference.",
        "respond-async",
        is_required=False,
    )
} | {
    name: about
    | {
        "description": "Only in the response 202 to `Prefer: respond-async`. "
        + about["description"],
        "required": False,
    }
    for name, about in (LOCATION | RETRY_LATER).items()
}


def add_preference(operation: Json) -> None:
    """Adds to a call that computes the header `Prefer`, which describes the response 202.

    This response is not listed, only its headers: in typed clients, each result would have the type
    of a job as well.
    """
    operation.setdefault("parameters", []).append(PREFER)
    result = operation["responses"]["200"]
    operation["responses"] |= {
        "200": result | {"headers": result["headers"] | _PREFERRED},
        "507": error("JobQuotaFull"),
    }


def job_body() -> Json:
    """The body of a job, as JSON or as lines: the argument `openapi_extra` of its route."""
    extra = json_body(JOBS)
    lines = b"".join(
        orjson.dumps(part, option=orjson.OPT_APPEND_NEWLINE)
        for part in JOBS["meshes"]["value"]["parts"]
    )
    text = "One part a line (`PartDefinition`), each a JSON object in UTF-8 without a line feed."
    extra["requestBody"]["content"][MEDIA_TYPE] = {
        "schema": {"type": "string", "description": text},
        "examples": {"meshes": {"summary": JOBS["meshes"]["summary"], "value": lines.decode()}},
    }
    return extra
