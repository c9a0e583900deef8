"""Routes for jobs: long work that outlives the request that asks for it."""

from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import aclosing
from functools import partial

from fastapi import APIRouter, Request, Response

from service.api.body import INLINE_BYTES, BodyRoute
from service.api.computation import Computation
from service.api.intake import accept_job
from service.api.job_documents import (
    JOB_HEADERS,
    describe_state,
)
from service.api.lines import MEDIA_TYPE, read_lines
from service.api.media_types import parse_content_type
from service.api.models.jobs import Job, JobList
from service.api.negotiation import refuse_parameters
from service.api.openapi.jobs import (
    ACCEPTED,
    JOB_ERRORS,
    LINKS,
    LOCATION,
    RETRY_LATER,
    job_body,
)
from service.api.openapi.responses import POST_ERRORS, TIMED, error
from service.api.record import record_of
from service.api.responses import (
    HEADERS,
    json_response,
)
from service.api.routes.job_state import StateDep, find_jobs
from service.api.services import Context, ContextDep, context_of
from service.errors import SurfaceError
from service.schemas.document import parse_document
from service.schemas.fields import RequestModel
from service.schemas.jobs import JobRequest


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
        context.computation.check_compute_limit()  # before the body takes memory
        return await accept_job(context, _parse_lines(context, headers))


async def _parse_lines(
    context: Context, headers: Mapping[bytes, bytes]
) -> AsyncIterator[list[object]]:
    """The parts in the lines of the body, batch by batch."""
    max_depth = context.services.document_limits.max_depth

    def find_caller() -> str:
        return context.computation.caller

    async with aclosing(read_lines(context, headers)) as batches:
        async for first, lines in batches:
            computation = Computation(context.services.threads, find_caller=find_caller)
            parse = partial(_parse_batch, lines, first, max_depth)
            try:
                parts = await computation.parse(parse, is_long=sum(map(len, lines)) > INLINE_BYTES)
            finally:
                computation.close()
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
    caller = None if "admin" in record_of(request.scope).scopes else context.computation.caller
    states = await find_jobs(context).list(caller)
    root = request.scope.get("root_path", "")
    return json_response({"jobs": [describe_state(s, root) for s in states]}, 200, JOB_HEADERS)


@jobs.get(
    "/v1/jobs/{id}",
    operation_id="getJob",
    tags=["jobs"],
    summary="The state of a job",
    response_model=Job,
    response_description="The state.",
    responses={
        200: {"headers": RETRY_LATER, "links": LINKS},
        **JOB_ERRORS,
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


@jobs.delete(
    "/v1/jobs/{id}",
    operation_id="withdrawJob",
    tags=["jobs"],
    summary="Withdraws a job",
    status_code=204,
    response_description="You no longer wait for the job.",
    responses=JOB_ERRORS,
)
async def withdraw_job(state: StateDep, request: Request, context: ContextDep) -> Response:
    """Withdraws the caller: its work ends within two seconds if no other caller waits for the job.

    The job is then `cancelled`. The results that are ready stay until they expire. If the same
    parts are posted again, only the others are computed.
    """
    refuse_parameters(request.query_params)
    await find_jobs(context).withdraw(state.id, context.computation.caller)
    return Response(status_code=204, headers=HEADERS)
