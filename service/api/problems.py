"""Every error as `application/problem+json` (RFC 9457), from one table of classes.

The text of an exception that is not a `SurfaceError` never leaves the process.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Literal, TypeAlias

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from service.api.answers import HEADERS, json_response
from service.api.links import route_path
from service.api.observing.record import record_of
from service.errors import (
    Busy,
    DamagedObject,
    InvalidRequest,
    Issue,
    MalformedBody,
    MalformedJson,
    StoreFailed,
    StoreFull,
    SurfaceError,
    TooLarge,
    UnknownSurface,
    UnsupportedByFormat,
    first_part,
)
from service.schemas.surface_query import FIELDS
from service.stopping import OutOfTime

MEDIA_TYPE = "application/problem+json"

PROBLEM_HEADERS = HEADERS | {"Cache-Control": "no-store"}
"""A refusal is of one moment: what is unknown, too large or broken now may not be so later."""

Place: TypeAlias = Literal["pointer", "parameter", "header", "file"]
"""What the pointer of an issue becomes; of a `file`, either the one or the other."""


class InvalidQuery(InvalidRequest):
    """A query parameter does not say anything we can compute."""


class UnknownSuffix(SurfaceError):
    """No format is written under this suffix."""


class NotAcceptable(SurfaceError):
    """Nothing that the client accepts is written here."""


class EngineGone(SurfaceError):
    """The numbers that are meant are those of another version."""


class BodyTooSlow(SurfaceError):
    """The body did not arrive in time."""


class BodyTooLarge(SurfaceError):
    """The body has more bytes than are read."""


class UnsupportedMediaType(SurfaceError):
    """The body is said to be something else than what is read here."""


class KeyNeeded(SurfaceError):
    """Nobody may do this without a key, and none was sent."""


class KeyUnknown(SurfaceError):
    """The key that was sent is none of ours."""


class SignatureInvalid(SurfaceError):
    """The signature of an address is not one of it."""


class SignatureExpired(SurfaceError):
    """The signature of an address was good, and is not any more."""


class RateLimited(SurfaceError):
    """More requests than one may make in this time."""


_TITLES = {413: "Content Too Large", 422: "Unprocessable Content"}
"""Phrases of RFC 9110 where `HTTPStatus` of older Pythons has those of RFC 7231."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What a class of errors is over HTTP.

    `code` is stable and for programs. `place` is where its issues lie: in the body (a JSON
    pointer), in the path or the query (a parameter), in a header, or in the net that a file is and
    the query beside it.
    """

    status: int
    code: str
    about: str
    place: Place = "pointer"

    @property
    def title(self) -> str:
        """The phrase of the status in RFC 9110 (507: RFC 4918)."""
        return _TITLES.get(self.status) or HTTPStatus(self.status).phrase


PROBLEMS: dict[type[SurfaceError], Problem] = {
    MalformedJson: Problem(400, "malformed_json", "The body is not JSON."),
    MalformedBody: Problem(
        400, "malformed_body", "The body is not of the type that it is said to be."
    ),
    KeyNeeded: Problem(401, "key_needed", "A key is needed for this.", "header"),
    KeyUnknown: Problem(401, "key_unknown", "The key is not one of those known here.", "header"),
    SignatureInvalid: Problem(
        403, "signature_invalid", "The signature is not one of this address.", "parameter"
    ),
    SignatureExpired: Problem(
        403, "signature_expired", "The address is not good any more.", "parameter"
    ),
    RateLimited: Problem(
        429,
        "rate_limited",
        "You ask more often than is allowed; `Retry-After` says when to ask again.",
    ),
    UnknownSurface: Problem(404, "unknown_surface", "No surface is known by this id.", "parameter"),
    UnknownSuffix: Problem(404, "unknown_suffix", "No format has this suffix.", "parameter"),
    NotAcceptable: Problem(
        406, "not_acceptable", "Nothing that you accept is written here.", "header"
    ),
    BodyTooSlow: Problem(408, "body_too_slow", "The body did not arrive in time."),
    EngineGone: Problem(
        410,
        "engine_gone",
        "The address names a version of the numbers that is not computed here.",
        "parameter",
    ),
    BodyTooLarge: Problem(413, "body_too_large", "The body has too many bytes."),
    UnsupportedMediaType: Problem(
        415,
        "unsupported_media_type",
        "The body must be of a type that is taken here, and not compressed.",
        "header",
    ),
    InvalidRequest: Problem(
        422, "invalid_request", "The surface or an option says nothing that can be computed."
    ),
    InvalidQuery: Problem(
        422, "invalid_request", "A query parameter says nothing that can be computed.", "parameter"
    ),
    UnsupportedByFormat: Problem(
        422, "unsupported_by_format", "The format cannot hold what was asked for."
    ),
    TooLarge: Problem(
        422, "result_too_large", "The result would be larger than is allowed; nothing was computed."
    ),
    Busy: Problem(
        429,
        "busy",
        "The service has as much to do as it can; nothing was computed. `Retry-After` says when to "
        "come again.",
    ),
    DamagedObject: Problem(
        500,
        "damaged_object",
        "What is kept under this id is damaged, and is not given out. Storing it again mends it.",
    ),
    StoreFailed: Problem(
        503,
        "store_unavailable",
        "The place where surfaces are kept does not work at the moment. It has been logged.",
    ),
    OutOfTime: Problem(
        503,
        "out_of_time",
        "The answer was not there in time: the service has much to do, or the request asks for "
        "much. `Retry-After` says when to come again.",
    ),
    StoreFull: Problem(
        507, "store_full", "There is no room for another surface; nothing was stored."
    ),
}

NOT_FOUND = Problem(404, "not_found", "There is nothing at this address.")
METHOD_NOT_ALLOWED = Problem(
    405,
    "method_not_allowed",
    "This address does not answer this method; `Allow` lists those it does.",
)
INTERNAL_ERROR = Problem(
    500, "internal_error", "The fault is ours. It has been logged; the request may be repeated."
)

# The server's own refusals; no request of theirs comes as far as here.
MALFORMED_REQUEST = Problem(400, "malformed_request", "This is no HTTP request.")
HEAD_TOO_SLOW = Problem(408, "head_too_slow", "The head of the request did not arrive in time.")
HEAD_TOO_LARGE = Problem(
    431, "head_too_large", "The address and the headers together have too many bytes."
)
TOO_MANY_CONNECTIONS = Problem(
    503,
    "too_many_connections",
    "As many connections are open as there may be. `Retry-After` says when to try again.",
)
DRAINING = Problem(
    503,
    "draining",
    "The service is about to stop. The request may be repeated: another instance will answer.",
)


def problem_document(
    problem: Problem, issues: tuple[Issue, ...] = (), place: Place | None = None
) -> dict[str, Any]:
    """The body of an error answer; `place` overrides where the issues are said to lie."""
    return {
        "type": "about:blank",
        "title": problem.title,
        "status": problem.status,
        "code": problem.code,
        "detail": problem.about,
        "errors": [_error(issue, place or problem.place) for issue in issues],
    }


def _error(issue: Issue, place: Place) -> dict[str, str]:
    where = issue.pointer
    if place == "file":
        place, where = _in_file_or_query(where)
    if place != "pointer":
        # A parameter or a header has a name and no inside; the path into a list is of no use there.
        where = first_part(where)
    texts = {"got": issue.got, "needed": issue.needed}
    return {
        "code": issue.code,
        place: where,
        "detail": issue.message,
        **{key: text for key, text in texts.items() if text},
    }


def _in_file_or_query(where: str) -> tuple[Place, str]:
    """A place in the document that a file and a query make together: which of them it is in."""
    inside = where.removeprefix("/surface")
    if inside != where and first_part(inside) not in FIELDS:
        return "pointer", where
    return ("parameter", inside) if where else ("pointer", where)


def problem_response(
    problem: Problem,
    issues: tuple[Issue, ...] = (),
    place: Place | None = None,
    headers: dict[str, str] | None = None,
) -> Response:
    """An answer that is a problem."""
    content = problem_document(problem, issues, place)
    return json_response(content, problem.status, PROBLEM_HEADERS | (headers or {}), MEDIA_TYPE)


def problem_of(error: SurfaceError) -> Problem:
    """The table's row for an error; a subclass inherits its parent's."""
    return next(PROBLEMS[cls] for cls in type(error).__mro__ if cls in PROBLEMS)


def install(app: FastAPI, routes: Sequence[APIRoute]) -> None:
    """Makes every error of `app` a problem; `routes` are those that it has."""

    async def on_http_exception(request: Request, error: Exception) -> Response:
        """The router's own refusals: no such path, no such method."""
        assert isinstance(error, HTTPException)
        headers = dict(error.headers or {})
        problem = NOT_FOUND
        if error.status_code == METHOD_NOT_ALLOWED.status:
            problem = METHOD_NOT_ALLOWED
            allowed = allowed_methods(routes, request)
            if request.method not in allowed:
                # FastAPI names the methods of the first route of the path only.
                headers = {"Allow": ", ".join(allowed)}
        record_of(request.scope).code = problem.code
        return problem_response(problem, headers=headers)

    app.add_exception_handler(SurfaceError, _on_surface_error)
    app.add_exception_handler(HTTPException, on_http_exception)
    app.add_exception_handler(ClientDisconnect, _on_disconnect)
    app.add_exception_handler(Exception, _on_exception)


def allowed_methods(routes: Sequence[APIRoute], request: Request) -> list[str]:
    """The methods that the path of a request answers."""
    path = route_path(request.scope)
    methods = {m for route in routes if route.path_regex.match(path) for m in route.methods or ()}
    return sorted(methods | ({"HEAD"} if "GET" in methods else set()))


async def _on_surface_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, SurfaceError)
    problem = problem_of(error)
    record_of(request.scope).code = problem.code
    place: Place | None = None
    if problem.place == "pointer":
        # Without a body there is nothing to point into: the same option is a parameter.
        if request.method != "POST":
            place = "parameter"
        elif getattr(request.state, "posts_file", False):
            place = "file"
    headers = {}
    if isinstance(error, Busy | OutOfTime):
        headers["Retry-After"] = str(request.app.state.services.workers.retry_after())
    return problem_response(problem, error.issues, place, headers)


async def _on_disconnect(_: Request, error: Exception) -> Response:
    """The client has gone away; the answer only ends the request quietly."""
    assert isinstance(error, ClientDisconnect)
    return Response(status_code=400)


async def _on_exception(request: Request, error: Exception) -> Response:
    """Any error that was not foreseen. The server logs the exception, which is raised again."""
    del error  # its text stays here
    record_of(request.scope).code = INTERNAL_ERROR.code
    return problem_response(INTERNAL_ERROR)
