"""Every error as `application/problem+json` (RFC 9457), from one table of classes.

`service.api.problem_handlers` responds with these documents.
"""

from collections.abc import Collection
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Literal, TypeAlias

from starlette.responses import Response

from service.api.errors import (
    BodyTooLarge,
    BodyTooSlow,
    ComputeLimited,
    EngineGone,
    InvalidQuery,
    KeyNeeded,
    KeyUnknown,
    NotAcceptable,
    RateLimited,
    ScopeNeeded,
    SignatureExpired,
    SignatureInvalid,
    UnknownSuffix,
    UnsupportedMediaType,
)
from service.api.responses import HEADERS, json_response
from service.cancellation import OutOfTime
from service.errors import (
    Busy,
    DamagedObject,
    InvalidRequest,
    Issue,
    JobQuotaFull,
    MalformedBody,
    MalformedJson,
    PartCrashed,
    StoreFailed,
    StoreFull,
    SurfaceError,
    TooLarge,
    TooManyJobs,
    UnknownJob,
    UnknownResult,
    UnknownSurface,
    UnsupportedByFormat,
    first_part,
)
from service.schemas.file_fields import FIELDS

MEDIA_TYPE = "application/problem+json"

PROBLEM_HEADERS = HEADERS | {"Cache-Control": "no-store"}
"""Caches must not keep errors: a surface that is unknown now may be stored a moment later."""

LocationKind: TypeAlias = Literal["pointer", "parameter", "header", "file"]
"""Whether an issue is in the body, a parameter or a header. The issue's document has a member of
this name: a JSON pointer, or the name of the parameter or header. `file` stands for a posted file
and its query: each of their issues gets a `pointer` or a `parameter`."""

_TITLES = {413: "Content Too Large", 422: "Unprocessable Content"}
"""Phrases of RFC 9110 for statuses for which older Pythons have the phrases of RFC 7231."""


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """The HTTP status and the texts of a class of errors.

    `code` is stable, for programs; `detail` is for people. `location` says where the issues are: in
    the body (a JSON pointer), in the path or query (a parameter), in a header, or in a posted file
    and the query beside it.
    """

    status: int
    code: str
    detail: str
    location: LocationKind = "pointer"

    @property
    def title(self) -> str:
        """The phrase of the status in RFC 9110 (507: RFC 4918)."""
        return _TITLES.get(self.status) or HTTPStatus(self.status).phrase


PROBLEMS: dict[type[SurfaceError], ProblemKind] = {
    MalformedJson: ProblemKind(400, "malformed_json", "The body is not JSON."),
    MalformedBody: ProblemKind(
        400, "malformed_body", "The body is not of the type that its `Content-Type` says."
    ),
    KeyNeeded: ProblemKind(401, "key_needed", "This call needs a key.", "header"),
    KeyUnknown: ProblemKind(401, "key_unknown", "The service does not know this key.", "header"),
    ScopeNeeded: ProblemKind(403, "scope_needed", "This key does not permit this call.", "header"),
    SignatureInvalid: ProblemKind(
        403, "signature_invalid", "The signature does not belong to this URL.", "parameter"
    ),
    SignatureExpired: ProblemKind(
        403, "signature_expired", "The signature of this URL has expired.", "parameter"
    ),
    RateLimited: ProblemKind(
        429,
        "rate_limited",
        "Too many requests in a short time; `Retry-After` says when to try again.",
    ),
    ComputeLimited: ProblemKind(
        429,
        "compute_limited",
        "Your requests have used too much computing time; `Retry-After` says when to try again.",
    ),
    UnknownSurface: ProblemKind(404, "unknown_surface", "No surface has this id.", "parameter"),
    UnknownJob: ProblemKind(404, "unknown_job", "No job has this id.", "parameter"),
    UnknownResult: ProblemKind(
        404, "unknown_result", "The part has no result now, or there is no such part.", "parameter"
    ),
    UnknownSuffix: ProblemKind(404, "unknown_suffix", "No format has this suffix.", "parameter"),
    NotAcceptable: ProblemKind(
        406, "not_acceptable", "The service writes no format or coding that you accept.", "header"
    ),
    BodyTooSlow: ProblemKind(408, "body_too_slow", "The body did not arrive in time."),
    EngineGone: ProblemKind(
        410,
        "engine_gone",
        "The URL names a version of the engine (`engine=…`) that this service does not have.",
        "parameter",
    ),
    BodyTooLarge: ProblemKind(413, "body_too_large", "The body has too many bytes."),
    UnsupportedMediaType: ProblemKind(
        415,
        "unsupported_media_type",
        "This call does not read bodies of this type, or compressed ones.",
        "header",
    ),
    InvalidRequest: ProblemKind(
        422, "invalid_request", "The surface or an option is invalid; `errors` says what and where."
    ),
    InvalidQuery: ProblemKind(
        422, "invalid_request", "A query parameter is invalid; `errors` says which.", "parameter"
    ),
    UnsupportedByFormat: ProblemKind(
        422, "unsupported_by_format", "The format cannot store what the request asks for."
    ),
    TooLarge: ProblemKind(422, "result_too_large", "The result would exceed a limit."),
    Busy: ProblemKind(
        429,
        "busy",
        "The service is busy; nothing was computed. `Retry-After` says when to try again.",
    ),
    TooManyJobs: ProblemKind(
        429,
        "too_many_jobs",
        "You have the largest number of jobs that have not ended; `Retry-After` says when to try "
        "again.",
    ),
    PartCrashed: ProblemKind(
        500, "part_crashed", "The process that computed this part ended, more than once."
    ),
    DamagedObject: ProblemKind(
        500,
        "damaged_object",
        "The stored surface is damaged and was not sent. To repair it, store the surface again.",
    ),
    StoreFailed: ProblemKind(
        503,
        "store_unavailable",
        "The store does not work at the moment. The service has logged the error.",
    ),
    OutOfTime: ProblemKind(
        503,
        "out_of_time",
        "The result was not ready in time: the service is busy, or the request asks for much work. "
        "`Retry-After` says when to try again; a job has more time (`Prefer: respond-async`).",
    ),
    JobQuotaFull: ProblemKind(
        507, "job_quota_full", "The store has no room for another job; nothing was accepted."
    ),
    StoreFull: ProblemKind(
        507, "store_full", "The store has no room for another surface; nothing was stored."
    ),
}

NOT_FOUND = ProblemKind(404, "not_found", "The service has nothing at this URL.")
METHOD_NOT_ALLOWED = ProblemKind(
    405,
    "method_not_allowed",
    "This URL does not support this method; `Allow` lists the methods that it supports.",
)
INTERNAL_ERROR = ProblemKind(
    500, "internal_error", "The service has made an error and has logged it. You may try again."
)

# The server responds with these itself, before the application sees the request.
MALFORMED_REQUEST = ProblemKind(400, "malformed_request", "The request is not valid HTTP/1.1.")
HEAD_TOO_SLOW = ProblemKind(408, "head_too_slow", "The head of the request did not arrive in time.")
HEAD_TOO_LARGE = ProblemKind(
    431, "head_too_large", "The URL and the headers together have too many bytes."
)
TOO_MANY_CONNECTIONS = ProblemKind(
    503,
    "too_many_connections",
    "The service has its largest number of connections. `Retry-After` says when to try again.",
)
DRAINING = ProblemKind(
    503,
    "draining",
    "The service is about to stop and takes no more requests. Try again later.",
)


def problem_document(
    problem: ProblemKind,
    issues: tuple[Issue, ...] = (),
    location: LocationKind | None = None,
    file_fields: Collection[str] = FIELDS,
) -> dict[str, Any]:
    """The body of an error response.

    `location` replaces the location of the problem. For a file, `file_fields` are the fields of its
    surface that the query may have.
    """
    return {
        "type": "about:blank",
        "title": problem.title,
        "status": problem.status,
        "code": problem.code,
        "detail": problem.detail,
        "errors": [
            _issue_document(issue, location or problem.location, file_fields) for issue in issues
        ],
    }


def _issue_document(
    issue: Issue, location: LocationKind, file_fields: Collection[str]
) -> dict[str, str]:
    pointer = issue.pointer
    if location == "file":
        location, pointer = _locate_in_file_or_query(pointer, file_fields)
    # The first part of the pointer names the parameter or header, which has no further parts.
    value = pointer if location == "pointer" else first_part(pointer)
    texts = {"got": issue.got, "needed": issue.needed}
    return {
        "code": issue.code,
        location: value,
        "detail": issue.message,
        **{key: text for key, text in texts.items() if text},
    }


ARRAYS = ("points", "rays")
"""Fields of a document whose numbers may be sent as a file."""


def _locate_in_file_or_query(
    pointer: str, file_fields: Collection[str]
) -> tuple[LocationKind, str]:
    """Whether an issue of a posted file and its query is in the file or in a parameter.

    Returns "pointer" or "parameter", and a JSON pointer into the file or to the parameter.
    """
    if first_part(pointer) in ARRAYS:
        return "pointer", pointer
    # In the query, some fields of the surface have no prefix; the file has the others.
    query_pointer = pointer.removeprefix("/surface")
    if query_pointer != pointer and first_part(query_pointer) not in file_fields:
        return "pointer", pointer
    # The empty pointer means the whole file.
    return ("parameter", query_pointer) if pointer else ("pointer", pointer)


def problem_response(
    problem: ProblemKind,
    issues: tuple[Issue, ...] = (),
    location: LocationKind | None = None,
    headers: dict[str, str] | None = None,
    file_fields: Collection[str] = FIELDS,
) -> Response:
    """The error response of a problem; the arguments are those of `problem_document`."""
    content = problem_document(problem, issues, location, file_fields)
    return json_response(content, problem.status, PROBLEM_HEADERS | (headers or {}), MEDIA_TYPE)


def problem_of(error: SurfaceError) -> ProblemKind:
    """The problem of an error: the entry of its class, or of the nearest parent, in `PROBLEMS`.

    A class without an entry is that of a part of a job that failed through an error of the service.
    """
    known = (PROBLEMS[cls] for cls in type(error).__mro__ if cls in PROBLEMS)
    return next(known, INTERNAL_ERROR)
