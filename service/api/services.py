"""The parts of the application that routes use, and the computation of each request."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple

from fastapi import Depends, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.cache import ResponseCache
from service.api.callers import caller_of
from service.api.computation import Computation
from service.api.cors import Origins
from service.api.guard.key_file import KnownKeys
from service.api.guard.signatures import Signer
from service.api.single_flight import SingleFlight
from service.api.static_files import StaticFiles
from service.api.threads import Threads
from service.jobs.manager import Jobs
from service.pipeline.calls import CallLimits
from service.pipeline.limits import Limits
from service.schemas.document import DocumentLimits
from service.settings.values import Settings
from service.storage.store import SurfaceStore


@dataclass(frozen=True, slots=True)
class Services:
    """The parts of one application.

    `limits` are those of results, and `part_limits` those of the parts of jobs. `signer` is None
    without secrets, and `jobs` if the settings switch jobs off.
    """

    settings: Settings
    document_limits: DocumentLimits
    limits: Limits
    store: SurfaceStore
    threads: Threads
    cache: ResponseCache
    flights: SingleFlight
    origins: Origins
    keys: KnownKeys | None
    signer: Signer | None
    static_files: StaticFiles
    jobs: Jobs | None
    part_limits: CallLimits


class Context(NamedTuple):
    """The application's parts, the request and its computation: what a route's function needs.

    `computation` holds the request's share of the threads; `format` is the response's format where
    the route's class chooses it (`service.api.body`).
    """

    services: Services
    computation: Computation
    request: Request
    format: Any = None


async def context_of(request: Request) -> Context:
    """The context of a request: the only dependency, because FastAPI takes 30 µs for each."""
    return Context(request.app.state.services, request.scope["state"]["computation"], request)


ContextDep = Annotated[Context, Depends(context_of)]


@dataclass(frozen=True, eq=False, slots=True)
class ComputationMiddleware:
    """Gives each request its `scope["state"]["computation"]`, and closes it after the response.

    Passes a HEAD request on as GET and drops the body: a GET route of FastAPI does not answer HEAD.
    """

    app: ASGIApp
    threads: Threads

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        if scope["method"] == "HEAD":
            scope, send = {**scope, "method": "GET"}, partial(_send_head, send)
        computation = Computation(self.threads, receive, partial(caller_of, scope))
        scope.setdefault("state", {})["computation"] = computation
        try:
            await self.app(scope, receive, send)
        finally:
            del scope["state"]["computation"]
            computation.close()


async def _send_head(send: Send, message: Message) -> None:
    """Sends the head of a response, and an empty body."""
    if message["type"] == "http.response.start":
        await send(message)
    elif not message.get("more_body"):
        await send({**message, "body": b""})
