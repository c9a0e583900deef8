"""Routes for jobs: long work that outlives the request that asks for it."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Mapping, Sequence
from contextlib import aclosing
from functools import partial
from typing import Annotated, Any, TypeAlias

from fastapi import APIRouter, Depends, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.api.body import INLINE_BYTES, BodyRoute, parse_content_type
from service.api.caching.cached_response import FOR_EVER, RawHeaders, matches_all, parse_tags
from service.api.intake import accept_job
from service.api.job import Job as RequestJob
from service.api.job_documents import (
    JOB_HEADERS,
    describe_result,
    describe_state,
    job_url,
)
from service.api.lines import MEDIA_TYPE, read_lines
from service.api.models.jobs import Job, JobList, JobResults
from service.api.negotiation import Pairs, condition_of, read_query, refuse_parameters
from service.api.openapi.jobs import (
    ACCEPTED,
    LINKS,
    LOCATION,
    RANGE,
    RESULT_CONTENT,
    RESULT_HEADERS,
    RETRY_LATER,
    JobId,
    PartIndex,
    job_body,
)
from service.api.openapi.parameters import IF_NONE_MATCH, Json
from service.api.openapi.responses import POST_ERRORS, TIMED, error
from service.api.record import record_of
from service.api.responses import (
    HEADERS,
    FileResponse,
    disposition,
    json_response,
    report_headers,
)
from service.api.services import Context, ContextDep, context_of
from service.errors import StoreFailed, SurfaceError
from service.jobs.manager import Jobs
from service.jobs.reading import unknown_job, unknown_result
from service.jobs.results import Result
from service.jobs.state import JobState
from service.pipeline.cost import Cost, Work
from service.schemas.document import parse_document
from service.schemas.fields import RequestModel
from service.schemas.jobs import JobRequest, ResultsRange
from service.schemas.query import number_from_text, values_from_text
from service.schemas.validation import validate_document
from service.storage.keys import is_id

RETRY = 1000
"""Milliseconds after which an `EventSource` connects again when a stream of events has ended."""

DRAIN_CHECK = 0.5
"""Seconds between two looks whether the service is about to stop, while a stream waits."""


class JobRoute(BodyRoute):
    """A route that reads the parts of a job: as one JSON document, or as lines of JSON."""

    keeps_document = True

    async def _respond(self, model: type[RequestModel], request: Request) -> Response:
        headers = dict(request.scope["headers"])
        content_type = headers.get(b"content-type", b"").decode("latin-1")
        if parse_content_type(content_type) != (MEDIA_TYPE, "utf-8"):
            return await super()._respond(model, request)
        refuse_parameters(request.query_params)
        context = await context_of(request)
        context.job.check_compute_limit()  # before the body takes memory
        return await accept_job(context, _parse_lines(context, headers))


async def _parse_lines(
    context: Context, headers: Mapping[bytes, bytes]
) -> AsyncIterator[list[object]]:
    """The parts in the lines of the body, batch by batch."""
    max_depth = context.services.document_limits.max_depth

    def find_caller() -> str:
        return context.job.caller

    async with aclosing(read_lines(context, headers)) as batches:
        async for first, lines in batches:
            job = RequestJob(context.services.threads, find_caller=find_caller)
            parse = partial(_parse_batch, lines, first, max_depth)
            try:
                parts = await job.parse(parse, is_long=sum(map(len, lines)) > INLINE_BYTES)
            finally:
                job.close()
            yield parts


def _parse_batch(lines: Sequence[bytes], first: int, max_depth: int) -> list[object]:
    parts = []
    for index, line in enumerate(lines, first):
        try:
            parts.append(parse_document(line, max_depth))
        except SurfaceError as error:
            raise error.within(f"/parts/{index}") from None
    return parts


asking = APIRouter(route_class=JobRoute)
jobs = APIRouter()

_ERRORS: dict[int | str, Json] = {
    404: error("UnknownJob"),
    422: error("InvalidQuery"),
    500: error("InternalError"),
    503: error("StoreFailed"),
}


@asking.post(
    "/v1/jobs",
    operation_id="createJob",
    tags=["jobs"],
    summary="Accepts a job: many requests, computed in the background",
    response_model=Job,
    response_description="All parts have succeeded already.",
    responses={
        200: {"headers": TIMED | LOCATION, "links": LINKS},
        202: ACCEPTED | {"model": Job},
        **POST_ERRORS,
        422: error("InvalidJob"),
        429: error("TooManyJobs"),
        503: error("Unavailable"),
        507: error("JobQuotaFull"),
    },
    openapi_extra=job_body(),
)
async def create_job(body: JobRequest, context: ContextDep) -> Response:
    """Checks all parts and accepts the job; the response has its state.

    A part with a body is a POST of one of the calls that compute, a part without one is a GET of a
    mesh by URL. Its result is the same as that of the call, byte for byte. A job may take hours: no
    request waits for it, and a restart of the service does not lose it.

    Many parts can be sent as `application/x-ndjson`, one part a line: then the service reads them
    as they come. The same parts are the same job, also in the other form and with other names: a
    second request joins it, and parts that any job has computed are not computed again. If a part
    is refused, the whole job is; the pointer of the error begins with `/parts/` and the index of
    the part.
    """

    async def parts() -> AsyncIterator[Sequence[object]]:
        yield body.parts

    return await accept_job(context, parts())


@jobs.get(
    "/v1/jobs",
    operation_id="listJobs",
    tags=["jobs"],
    summary="Your jobs",
    response_model=JobList,
    response_description="The jobs.",
    responses={
        422: error("InvalidQuery"),
        500: error("InternalError"),
        503: error("StoreFailed"),
    },
)
async def list_jobs(request: Request, context: ContextDep) -> Response:
    """Lists the jobs of the caller whose results have not expired, the newest first.

    The caller is the name of the key, or without keys the address. A key with the scope `admin`
    gets the jobs of all callers.
    """
    refuse_parameters(request.query_params)
    caller = None if "admin" in record_of(request.scope).scopes else context.job.caller
    states = await find_jobs(context).list(caller)
    root = request.scope.get("root_path", "")
    return json_response({"jobs": [describe_state(s, root) for s in states]}, 200, JOB_HEADERS)


async def find_state(id: JobId, context: ContextDep) -> JobState:
    """The state of the job that the path names; a dependency of the routes below.

    Raises
    ------
    UnknownJob
    """
    if not is_id(id):
        raise unknown_job()
    return await find_jobs(context).state(id)


async def refuse_query(request: Request) -> None:
    """Refuses all parameters; a dependency of the route that responds with a stream."""
    refuse_parameters(request.query_params)


def find_jobs(context: Context) -> Jobs:
    """The jobs of the application.

    Raises
    ------
    StoreFailed
        There is no place to keep jobs.
    """
    jobs = context.services.jobs
    if jobs is None:
        raise StoreFailed
    return jobs


StateDep: TypeAlias = Annotated[JobState, Depends(find_state)]


@jobs.get(
    "/v1/jobs/{id}",
    operation_id="getJob",
    tags=["jobs"],
    summary="The state of a job",
    response_model=Job,
    response_description="The state.",
    responses={
        200: {"headers": RETRY_LATER, "links": LINKS},
        **_ERRORS,
    },
)
async def get_job(state: StateDep, request: Request) -> Response:
    """Returns the state of a job: how many parts have ended, how fast, and how long it will take.

    Until the job has ended, `Retry-After` says when to ask again; `/events` sends each change.
    """
    refuse_parameters(request.query_params)
    root = request.scope.get("root_path", "")
    headers = JOB_HEADERS if state.has_ended else JOB_HEADERS | {"Retry-After": "1"}
    return json_response(describe_state(state, root), 200, headers)


@jobs.get(
    "/v1/jobs/{id}/events",
    operation_id="getJobEvents",
    tags=["jobs"],
    summary="The state of a job as a stream of events",
    response_class=EventSourceResponse,
    response_description="Events `progress`, and at the end of the job one event `end`.",
    responses=_ERRORS,
    dependencies=[Depends(refuse_query)],
)
async def get_job_events(
    state: StateDep, request: Request, context: ContextDep
) -> AsyncIterator[ServerSentEvent]:
    """Sends the state of the job now, and then each change, at most two a second.

    The data of each event `progress`, and of the last event, `end`, is the document of
    `GET /v1/jobs/{id}`. Between events, a comment every 15 s keeps the connection open. Before the
    service stops it ends the stream; an `EventSource` then connects again after a second.
    """
    root = request.scope.get("root_path", "")

    def event(state: JobState) -> ServerSentEvent:
        name = "end" if state.has_ended else "progress"
        return ServerSentEvent(data=describe_state(state, root), event=name, retry=RETRY)

    yield event(state)
    if state.has_ended or record_of(request.scope).method == "HEAD":
        return
    async for change in _until_draining(find_jobs(context).watch(state.id), request):
        if change != state:
            yield event(change)


async def _until_draining(
    states: AsyncIterator[JobState], request: Request
) -> AsyncGenerator[JobState]:
    """The states, until the service is about to stop, or the store fails."""
    upcoming: asyncio.Task[JobState | None] | None = None
    try:
        while request.app.state.ready:
            upcoming = upcoming or asyncio.create_task(_next(states))
            if not (await asyncio.wait({upcoming}, timeout=DRAIN_CHECK))[0]:
                continue
            try:
                state = upcoming.result()
            except SurfaceError:  # the store fails; the client connects again, and gets the error
                return
            if state is None:
                return
            upcoming = None
            yield state
    finally:
        if upcoming is not None:
            upcoming.cancel()


async def _next(states: AsyncIterator[JobState]) -> JobState | None:
    """The next state; None at the end."""
    return await anext(states, None)


@jobs.get(
    "/v1/jobs/{id}/results",
    operation_id="getJobResults",
    tags=["jobs"],
    summary="The results of a job, as a list",
    response_model=JobResults,
    response_description="The results.",
    responses=_ERRORS,
    openapi_extra={"parameters": RANGE},
)
async def list_results(state: StateDep, request: Request, context: ContextDep) -> Response:
    """Lists the parts `from` … `from + limit - 1` with their state, and the URL of each file.

    A part that failed has its `problem` instead. The list may be read while the job runs.
    """
    query = read_query(_parse_range, request.query_params.multi_items())
    results = await find_jobs(context).results(state.id, query.first, query.limit)
    root = request.scope.get("root_path", "")
    document: dict[str, Any] = {"results": [describe_result(r, root, state.id) for r in results]}
    end = query.first + query.limit
    if end < state.total:
        url = f"{job_url(root, state.id)}/results"
        document["next"] = f"{url}?from={end}&limit={query.limit}"
    return json_response(document, 200, JOB_HEADERS)


def _parse_range(pairs: Pairs) -> ResultsRange:
    """The range of parts that a query names."""
    values = values_from_text(pairs)
    numbers = {name: number_from_text(str(value)) for name, value in values.items()}
    return validate_document(ResultsRange, numbers)


@jobs.get(
    "/v1/jobs/{id}/results/{part}",
    operation_id="getJobResult",
    tags=["jobs"],
    summary="The result of a part",
    response_class=Response,
    response_description="The file.",
    responses={
        200: {"content": RESULT_CONTENT, "headers": RESULT_HEADERS},
        304: {"description": "The client has the file already.", "headers": RESULT_HEADERS},
        **_ERRORS,
        404: error("UnknownResult"),
    },
    openapi_extra={"parameters": [IF_NONE_MATCH]},
)
async def get_result(
    state: StateDep, part: PartIndex, request: Request, context: ContextDep
) -> Response:
    """Returns the file of a part that has succeeded; until then the response is 404.

    It has the bytes and the media type that the part's call returns. It never changes: `ETag` is
    its SHA-256.
    """
    refuse_parameters(request.query_params)
    jobs, job = find_jobs(context), context.job
    index = _parse_index(part, state.total)
    (result,) = await jobs.results(state.id, index, 1)
    file = result.result
    if file is None:
        raise unknown_result(
            "This part has failed; the list of results says why."
            if result.error
            else "This part has no result yet."
        )
    headers = _result_headers(file, result.name)
    condition = condition_of(request) or b""
    if matches_all(condition) or f'"{file.sha256}"'.encode() in parse_tags(condition):
        return FileResponse(b"", headers, 304)
    length = (b"content-length", b"%d" % file.bytes)
    if record_of(request.scope).method == "HEAD":
        return FileResponse(b"", (*headers, length))
    # Takes the memory in turn with other responses, but no thread: nothing is computed.
    await job.run(Work(Cost(file.bytes, 0.0, response=file.bytes), bool), "result")
    file, content = await jobs.result(state.id, index)
    job.finish_work(file.bytes)
    length = (b"content-length", b"%d" % file.bytes)
    return FileResponse(content, (*_result_headers(file, result.name), length))


def _parse_index(text: str, total: int) -> int:
    """The index of a part in a path."""
    index = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else total
    if index >= total:
        raise unknown_result("The job has no part of this index.")
    return index


def _result_headers(file: Result, name: str) -> RawHeaders:
    """The headers of a result: those of the file that the part's call returns."""
    headers = [
        (b"content-type", file.media_type.encode()),
        (b"etag", f'"{file.sha256}"'.encode()),
        (b"cache-control", FOR_EVER.encode()),
        (b"x-content-type-options", b"nosniff"),
        *report_headers(file),
    ]
    if file.media_type != "application/json":
        file_name = disposition("attachment", name or file.name, file.suffix)
        headers.append((b"content-disposition", file_name.encode()))
    return tuple(headers)


@jobs.delete(
    "/v1/jobs/{id}",
    operation_id="withdrawJob",
    tags=["jobs"],
    summary="Withdraws a job",
    status_code=204,
    response_description="You no longer wait for the job.",
    responses={
        404: error("UnknownJob"),
        422: error("InvalidQuery"),
        500: error("InternalError"),
        503: error("StoreFailed"),
    },
)
async def withdraw_job(state: StateDep, request: Request, context: ContextDep) -> Response:
    """Withdraws the caller: its work ends within two seconds if no other caller waits for the job.

    The job is then `cancelled`. The results that are ready stay until they expire. If the same
    parts are posted again, only the others are computed.
    """
    refuse_parameters(request.query_params)
    await find_jobs(context).withdraw(state.id, context.job.caller)
    return Response(status_code=204, headers=HEADERS)
