"""Builds the application: settings, routes, error handlers, the store, and middleware.

`uvicorn service.api.app:create_app --factory` serves it.
"""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

from fastapi import APIRouter, FastAPI
from starlette.types import ASGIApp, Receive, Scope, Send

from service import __version__
from service.api import page_files, problem_handlers
from service.api.cache_middleware import CacheMiddleware
from service.api.caching.cache import ResponseCache
from service.api.cors import Origins
from service.api.guard.guard import build_guard, build_keys, build_signer
from service.api.guard.policy import needs_keys
from service.api.job_engine import build_jobs
from service.api.observing.health import is_ready
from service.api.observing.middleware import Write, add_telemetry
from service.api.openapi.document import describe
from service.api.routes import (
    checks,
    evaluation,
    images,
    job_events,
    job_files,
    job_results,
    jobs,
    meshes,
    meshes_by_url,
    operations,
    pages,
    queries,
    stored,
    surfaces,
)
from service.api.services import ComputationMiddleware, Services
from service.api.single_flight import SingleFlight
from service.api.static_files import StaticFiles
from service.api.threads import Threads
from service.decoders.child_processes import PROCESSES
from service.jobs.limits import part_limits
from service.settings.environment import read_environment
from service.settings.limits import document_limits, result_limits
from service.settings.runtime import collect_rarely, limit_plans, pin_blas, share_heap
from service.settings.values import Settings
from service.storage.address import open_store

CLOSING_SECONDS = 5.0
"""The most seconds that the end of the service waits for that of the work in the background."""


def create_app(settings: Settings | None = None, log: Write | None = None) -> "Application":
    """The service as an ASGI application.

    Parameters
    ----------
    settings : Settings, optional
        Default: the settings in the environment.
    log : callable, optional
        Writes a line of the access log. Default: the service writes no access log.

    Raises
    ------
    InvalidSettings
    """
    # For the whole process: BLAS on one thread, one heap, and fewer garbage collections.
    pin_blas()
    share_heap()
    collect_rarely()
    settings = settings or read_environment()
    limit_plans(settings.memory_bytes)
    PROCESSES.starts_ahead = True
    app = Application(
        # With `include_router`, FastAPI would search every router twice.
        routes=[route for router in _select_routers(settings) for route in router.routes],
        title="Surface Service",
        version=__version__,
        openapi_url=None,  # `routes.pages` serves the document, compressed and with an entity tag
        # Each path has one spelling: with an extra slash the response is 404, not a redirect.
        redirect_slashes=False,
        lifespan=_lifespan,
        # Not FastAPI's spans, metrics and logs: `observing/` has those of this service.
        telemetry={"tracing": False, "metrics": False, "logs": False, "auto_configure": False},
    )
    services = app.state.services = _build_services(app, settings)
    problem_handlers.add_error_handlers(app)
    app.state.ready = True
    app.state.is_ready = partial(is_ready, app.state)
    inner = ComputationMiddleware(partial(FastAPI.__call__, app), services.threads)
    cached = CacheMiddleware(
        inner, services.cache, services.store, services.threads.unread, services.origins
    )
    guard = build_guard(cached, settings, services.keys, services.signer, services.threads.accounts)
    app.outermost = add_telemetry(app, guard, log)
    return app


class Application(FastAPI):
    """FastAPI behind the middleware of this service.

    Attributes
    ----------
    outermost : ASGIApp
        The first middleware; it passes requests on to the next, and the last to FastAPI.
    """

    outermost: ASGIApp

    def openapi(self) -> dict[str, Any]:
        """The OpenAPI document, for the settings of this service."""
        if self.openapi_schema is None:
            self.openapi_schema = describe(self, self.state.services.settings)
        return self.openapi_schema

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request; events of the server's start and end go to FastAPI alone."""
        if scope["type"] == "http":
            await self.outermost(scope, receive, send)
        else:
            await super().__call__(scope, receive, send)


def _build_services(app: FastAPI, settings: Settings) -> Services:
    cache = ResponseCache(settings.cache_bytes)
    threads = Threads(settings, cache)
    store = open_store(settings.store, settings.store_quota, settings.store_create)
    return Services(
        settings=settings,
        document_limits=document_limits(settings),
        limits=result_limits(settings),
        store=store,
        threads=threads,
        cache=cache,
        flights=SingleFlight(threads),
        origins=Origins(settings.cors_origins),
        keys=build_keys(settings),
        signer=build_signer(settings),
        static_files=StaticFiles(page_files.list_files(app.openapi, settings)),
        jobs=build_jobs(settings, store, threads),
        part_limits=part_limits(settings),
    )


def _select_routers(settings: Settings) -> list[APIRouter]:
    """The routers of this service, without those that are switched off."""
    routers = [
        meshes.meshes,
        meshes.estimates,
        evaluation.points,
        evaluation.conversions,
        evaluation.curves,
        queries.projections,
        queries.intersections,
        queries.measures,
        checks.checks,
        surfaces.reading,
        surfaces.storing,
        meshes_by_url.by_url,
        images.images,
        images.by_url,
        operations.catalogue,
        operations.health,
        pages.pages,
    ]
    if settings.jobs:
        routers += [jobs.asking, job_files.files, jobs.jobs, job_events.events, job_results.results]
    if settings.allow_delete:
        routers.append(surfaces.deleting)
    if needs_keys(settings):
        routers.append(stored.listing)
    if settings.signing_keys and needs_keys(settings):
        routers.append(surfaces.signing)
    if settings.metrics != "off":
        routers.append(operations.metrics)
    return routers


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Works on jobs and maintains the store while the service runs; at the end it is not ready."""
    services: Services = app.state.services
    store = services.store
    work: list[Coroutine[Any, Any, None]] = [store.watch(), store.maintain()]
    if services.jobs is not None:
        work.append(services.jobs.run())
    tasks = [asyncio.create_task(each) for each in work]
    yield
    app.state.ready = False
    for task in tasks:
        task.cancel()
    # Job processes end, and jobs are left to other instances; a store that hangs delays no end.
    await asyncio.wait(tasks, timeout=CLOSING_SECONDS)
    if app.state.tracing is not None:  # `add_telemetry` has set it
        await app.state.tracing.close()
