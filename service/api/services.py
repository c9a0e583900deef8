"""What the routes work with: parts of the application, and the job of the request."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from fastapi import Depends, Request
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.caching.answers import AnswerCache
from service.api.caching.flights import Flights
from service.api.cors import Origins
from service.api.guard.signatures import Signer
from service.api.static_files import StaticFiles
from service.api.workers import Job, Workers
from service.pipeline.limits import Limits
from service.schemas.document import DocumentLimits
from service.settings.values import Settings
from service.storage.store import SurfaceStore


@dataclass(frozen=True, slots=True)
class Services:
    """The parts of one application."""

    settings: Settings
    documents: DocumentLimits
    limits: Limits
    store: SurfaceStore
    workers: Workers
    answers: AnswerCache
    flights: Flights
    origins: Origins
    signer: Signer | None
    static_files: StaticFiles


class Context(NamedTuple):
    """What a route works with; one dependency, as each costs FastAPI 30 µs."""

    services: Services
    job: Job


async def context_of(request: Request) -> Context:
    """The parts of the application, and what this request holds of the workers."""
    return Context(request.app.state.services, request.state.job)


ContextDep = Annotated[Context, Depends(context_of)]


class JobMiddleware:
    """Gives every request its job, as `request.state.job`; ends it after the answer was sent."""

    def __init__(self, app: ASGIApp, workers: Workers) -> None:
        self._app = app
        self._workers = workers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        job = scope.setdefault("state", {})["job"] = Job(self._workers, receive)
        try:
            await self._app(scope, receive, send)
        finally:
            del scope["state"]["job"]
            job.close()
