"""Routes for the results of a job: the list, and each file."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.api.caching.cached_response import FOR_EVER, RawHeaders, matches_all, parse_tags
from service.api.job_documents import JOB_HEADERS, describe_result, job_url
from service.api.models.jobs import JobResults
from service.api.negotiation import Pairs, condition_of, read_query, refuse_parameters
from service.api.openapi.jobs import JOB_ERRORS, RANGE, RESULT_CONTENT, RESULT_HEADERS, PartIndex
from service.api.openapi.parameters import IF_NONE_MATCH
from service.api.openapi.responses import error
from service.api.record import record_of
from service.api.responses import (
    READING_HEADER,
    WRITING_HEADER,
    FileResponse,
    disposition,
    json_response,
    report_headers,
)
from service.api.routes.job_state import StateDep, find_jobs
from service.api.services import ContextDep
from service.jobs.reading import file_of, unknown_result
from service.jobs.results import Result
from service.pipeline.cost import Cost, Work
from service.schemas.jobs import ResultsRange
from service.schemas.query import number_from_text, values_from_text
from service.schemas.validation import validate_document

results = APIRouter()


@results.get(
    "/v1/jobs/{id}/results",
    operation_id="getJobResults",
    tags=["jobs"],
    summary="The results of a job, as a list",
    response_model=JobResults,
    response_description="The results.",
    responses=JOB_ERRORS,
    openapi_extra={"parameters": RANGE},
)
async def list_results(state: StateDep, request: Request, context: ContextDep) -> Response:
    """Lists the parts `from` … `from + limit - 1` with their state, and the URL of each file.

    A part that failed has its `problem` instead. The list may be read while the job runs.
    """
    query = read_query(_parse_range, request.query_params.multi_items())
    listed = await find_jobs(context).results(state, query.first, query.limit)
    root = request.scope.get("root_path", "")
    document: dict[str, Any] = {
        "results": [describe_result(each, root, state.id) for each in listed]
    }
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


@results.get(
    "/v1/jobs/{id}/results/{part}",
    operation_id="getJobResult",
    tags=["jobs"],
    summary="The result of a part",
    response_class=Response,
    response_description="The file.",
    responses={
        200: {"content": RESULT_CONTENT, "headers": RESULT_HEADERS},
        304: {"description": "The client has the file already.", "headers": RESULT_HEADERS},
        **JOB_ERRORS,
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
    jobs, computation = find_jobs(context), context.computation
    (found,) = await jobs.results(state, _parse_index(part, state.total), 1)
    file = file_of(found)
    headers = _result_headers(file, found.name)
    condition = condition_of(request) or b""
    if matches_all(condition) or f'"{file.sha256}"'.encode() in parse_tags(condition):
        return FileResponse(b"", headers, 304)
    length = (b"content-length", b"%d" % file.bytes)
    if record_of(request.scope).method == "HEAD":
        return FileResponse(b"", (*headers, length))
    # Takes the memory in turn with other responses, but no thread: nothing is computed.
    await computation.run(Work(Cost(file.bytes, 0.0, response=file.bytes), bool), "result")
    file, content = await jobs.content(state.id, found)
    computation.finish_work(file.bytes)
    length = (b"content-length", b"%d" % file.bytes)
    return FileResponse(content, (*_result_headers(file, found.name), length))


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
    for header, counts in ((READING_HEADER, file.reading), (WRITING_HEADER, file.writing)):
        if counts is not None:
            headers.append((header.lower().encode(), counts.encode()))
    if file.media_type != "application/json":
        file_name = disposition("attachment", name or file.name, file.suffix)
        headers.append((b"content-disposition", file_name.encode()))
    return tuple(headers)
