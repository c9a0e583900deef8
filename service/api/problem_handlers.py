"""Responds to every error of the application with its problem document.

The text of an exception that is not a `SurfaceError` never leaves the process.
"""

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from service.api.errors import ComputeLimited
from service.api.problems import (
    INTERNAL_ERROR,
    METHOD_NOT_ALLOWED,
    NOT_FOUND,
    LocationKind,
    problem_of,
    problem_response,
)
from service.api.record import record_of, route_path
from service.api.threads import Threads
from service.cancellation import OutOfTime
from service.errors import Busy, StoreFailed, SurfaceError, TooManyJobs
from service.storage.watch import CHECK_INTERVAL


def add_error_handlers(app: FastAPI) -> None:
    """Makes `app` respond to every error with a problem."""
    app.add_exception_handler(SurfaceError, _on_surface_error)
    app.add_exception_handler(HTTPException, _on_http_exception)
    app.add_exception_handler(ClientDisconnect, _on_disconnect)
    app.add_exception_handler(Exception, _on_exception)


async def _on_http_exception(request: Request, error: Exception) -> Response:
    """Handles errors of the router: unknown path, wrong method."""
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {})
    problem = NOT_FOUND
    if error.status_code == METHOD_NOT_ALLOWED.status:
        problem = METHOD_NOT_ALLOWED
        allowed = find_allowed_methods(request)
        if request.method not in allowed:
            # FastAPI names only the methods of the first route of the path. A route that refuses
            # its own method (DELETE of an example) has named the allowed ones itself.
            headers = {"Allow": ", ".join(allowed)}
    record_of(request.scope).code = problem.code
    return problem_response(problem, headers=headers)


def find_allowed_methods(request: Request) -> list[str]:
    """The methods that the path of a request supports, HEAD included."""
    routes, path = request.app.routes, route_path(request.scope)
    methods = {m for route in routes if route.path_regex.match(path) for m in route.methods or ()}
    return sorted(methods | ({"HEAD"} if "GET" in methods else set()))


async def _on_surface_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, SurfaceError)
    problem = problem_of(error)
    record_of(request.scope).code = problem.code
    location: LocationKind | None = None
    file_fields: tuple[str, ...] = ()
    if problem.location == "pointer":
        # Only a POST has a body for a JSON pointer; otherwise the option is a query parameter.
        if request.method != "POST":
            location = "parameter"
        elif hasattr(request.state, "file_fields"):
            location, file_fields = "file", request.state.file_fields
    headers = {}
    threads: Threads = request.app.state.services.threads
    if isinstance(error, Busy | OutOfTime | TooManyJobs):
        headers["Retry-After"] = str(threads.retry_after())
    elif isinstance(error, ComputeLimited):
        headers["Retry-After"] = str(error.retry_after)
    elif isinstance(error, StoreFailed):
        headers["Retry-After"] = f"{CHECK_INTERVAL:.0f}"
    return problem_response(problem, error.issues, location, headers, file_fields)


async def _on_disconnect(_: Request, error: Exception) -> Response:
    """Ends a request whose client has disconnected; no client gets this response."""
    assert isinstance(error, ClientDisconnect)
    return Response(status_code=400)


async def _on_exception(request: Request, _: Exception) -> Response:
    """The response to an unexpected error, without the text of the error.

    Starlette raises the error again; the log gets it.
    """
    record_of(request.scope).code = INTERNAL_ERROR.code
    return problem_response(INTERNAL_ERROR)
