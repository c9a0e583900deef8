"""The application: settings, routes, problems, the store, and what answers in front of all these.

`uvicorn service.api.app:create_app --factory` serves it.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI
from starlette.types import ASGIApp, Receive, Scope, Send

from service import __version__
from service.api import (
    catalogue,
    convert,
    curve,
    docs,
    estimate,
    mesh,
    mesh_by_url,
    page,
    points,
    problems,
    sign,
    surfaces,
)
from service.api.admission.admission import Admission
from service.api.admission.visits import Visits
from service.api.caching.answers import AnswerCache
from service.api.caching.flights import Flights
from service.api.caching.front import Front
from service.api.cors import CrossOrigin, Origins
from service.api.guard.means import guarded, signer_of
from service.api.observing import health
from service.api.observing.access_log import Write
from service.api.observing.metrics import metrics
from service.api.observing.middleware import add_telemetry
from service.api.openapi.document import document
from service.api.static_files import StaticFiles
from service.errors import InvalidSettings
from service.settings.environment import from_environment
from service.settings.process import free_at_once, pin_blas
from service.settings.values import Settings
from service.storage.address import InvalidStore, open_store
from service.storage.store import SurfaceStore


def create_app(settings: Settings | None = None, log: Write | None = None) -> "Application":
    """The service as an ASGI application; settings come from the environment if not given.

    `log` takes the lines about requests, of which there are none without it.
    """
    pin_blas()
    free_at_once()
    app = Application(
        title="Surface Service",
        version=__version__,
        # Described by hand, since routes read the raw request; served below.
        openapi_url=None,
        # A path has one spelling: the other one is a 404, not a redirect.
        redirect_slashes=False,
        lifespan=_lifespan,
        telemetry={"tracing": False, "metrics": False, "logs": False, "auto_configure": False},
    )
    app.state.settings = settings or from_environment()
    app.state.store = _store(app.state.settings)
    app.state.signer = signer_of(app.state.settings)
    app.state.ready = True
    app.openapi = document  # type: ignore[method-assign]
    _add_routes(app)
    problems.install(app)
    _add_front(app)
    app.front = add_telemetry(app, app.front, log)
    return app


class Application(FastAPI):
    """FastAPI, behind what answers before it sees a request; its handler of errors included."""

    front: ASGIApp

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        await self.front(scope, receive, send)


def _add_front(app: Application) -> None:
    """What is kept in memory, and the front door that looks there first."""
    app.state.origins = Origins(app.state.settings.cors_origins)
    app.state.answers = AnswerCache(app.state.settings.cache_bytes)
    app.state.admission = Admission(app.state.settings, app.state.answers)
    app.state.answers.freed = app.state.admission.large.memory.settle
    app.state.flights = Flights(app.state.admission)
    app.state.static_files = StaticFiles({**docs.FILES, **page.FILES})
    visits = Visits(partial(FastAPI.__call__, app), app.state.admission)
    reachable = CrossOrigin(visits, app.state.origins)
    front = Front(reachable, app.state.answers, app.state.origins)
    app.front = guarded(front, app.state.settings, app.state.origins)


def _add_routes(app: FastAPI) -> None:
    app.add_route("/v1/mesh", mesh.post_mesh, methods=["POST"])
    app.add_route("/v1/estimate", estimate.post_estimate, methods=["POST"])
    app.add_route("/v1/points", points.post_points, methods=["POST"])
    app.add_route("/v1/convert", convert.post_convert, methods=["POST"])
    app.add_route("/v1/curve", curve.post_curve, methods=["POST"])
    app.add_route("/v1/surfaces", surfaces.collection, methods=["GET", "POST"])
    # Where nothing may be deleted, DELETE is a method that the address does not answer.
    delete = ["DELETE"] if app.state.settings.allow_delete else []
    app.add_route("/v1/surfaces/{id}", surfaces.item, methods=["GET", *delete])
    app.add_route("/v1/surfaces/{id}/mesh.{suffix}", mesh_by_url.get_mesh)
    app.add_route("/v1/sign", sign.post_sign, methods=["POST"])
    app.add_route("/v1/formats", catalogue.list_formats)
    app.add_route("/health", health.health)
    app.add_route("/health/live", health.live)
    app.add_route("/health/ready", health.ready)
    if app.state.settings.metrics != "off":
        app.add_route("/metrics", metrics)
    app.add_route("/openapi.json", docs.openapi)
    app.add_route("/docs", docs.page)
    app.add_route("/docs/{asset}", docs.asset)
    app.add_route("/", page.home)
    app.add_route("/page/{file}", page.part)


def _store(settings: Settings) -> SurfaceStore:
    """Where surfaces are kept; a place that is none must stop the start."""
    try:
        return open_store(settings.store, settings.store_quota)
    except InvalidStore as error:
        raise InvalidSettings(f"SURFACE_STORE: {error}") from None


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Tends the store; says that the service is draining as soon as it is asked to stop."""
    tending = asyncio.create_task(app.state.store.tend())
    yield
    app.state.ready = False
    tending.cancel()
    if app.state.tracing is not None:
        await app.state.tracing.close()
