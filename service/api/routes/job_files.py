"""The route that stores files for parts of jobs."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.api.job_documents import JOB_HEADERS
from service.api.media_types import check_content, decoder_of_body, unread_type
from service.api.models.jobs import JobFile
from service.api.negotiation import refuse_parameters
from service.api.openapi.parameters import file_bodies
from service.api.openapi.responses import POST_ERRORS, TIMED, error
from service.api.receiving import read_body
from service.api.responses import json_response
from service.api.routes.job_state import find_jobs
from service.api.services import ContextDep
from service.decoders.registry import DECODERS

files = APIRouter()

_STORED: dict[str, Any] = {"headers": TIMED}


@files.post(
    "/v1/files",
    operation_id="storeJobFile",
    tags=["jobs"],
    summary="Stores a file for parts of jobs",
    status_code=201,
    response_model=JobFile,
    response_description="The file is stored.",
    responses={
        200: _STORED | {"description": "The file was stored already.", "model": JobFile},
        201: _STORED,
        **POST_ERRORS,
        422: error("InvalidQuery"),
        503: error("Unavailable"),
        507: error("JobQuotaFull"),
    },
    openapi_extra={"requestBody": {"content": file_bodies(), "required": True}},
)
async def store_file(request: Request, context: ContextDep) -> Response:
    """Keeps a file, which parts of jobs name by its id as their `file`.

    The file is not read here: a part whose file cannot be read fails. A file is kept for twice the
    lifetime of jobs after it was stored or a job named it. The same bytes of the same type have the
    same id.
    """
    services, computation, *_ = context
    refuse_parameters(request.query_params)
    computation.check_compute_limit()  # before the body takes memory
    headers = dict(request.scope["headers"])
    content_type = headers.get(b"content-type", b"").decode("latin-1")
    decoder = decoder_of_body(content_type, DECODERS)
    if decoder is None:
        raise unread_type(content_type, DECODERS, reads_json=False)
    jobs = find_jobs(context)
    content = await read_body(request, headers, services, computation, decoder, is_kept=True)
    check_content(content, decoder)
    async with computation.until_deadline():
        with computation.timing.step("store"):
            id, is_new = await jobs.sources.store(content, decoder)
    document = {"id": id, "bytes": len(content)}
    timed = JOB_HEADERS | {"Server-Timing": str(computation.timing)}
    return json_response(document, 201 if is_new else 200, timed)
