"""Routes for the list of formats, health and metrics."""

import asyncio
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

from service import __version__
from service.api.compression import compress_response
from service.api.models.surfaces import FormatList, Health
from service.api.negotiation import refuse_parameters
from service.api.observing import metrics as service_metrics
from service.api.observing.health import is_ready
from service.api.openapi.parameters import Json
from service.api.openapi.responses import CODED, error, success
from service.api.responses import HEADERS, json_response
from service.api.services import ContextDep
from service.encoders.libraries import list_compressions
from service.encoders.registry import FORMATS
from service.engine.mesh.mesh import ENGINE

catalogue = APIRouter()


@catalogue.get(
    "/v1/formats",
    operation_id="listFormats",
    tags=["catalogue"],
    summary="The formats of meshes",
    response_model=FormatList,
    response_description="The formats of meshes.",
    responses={200: success(CODED), 422: error("InvalidQuery"), 500: error("InternalError")},
)
async def list_formats(request: Request, context: ContextDep) -> Response:
    """Lists the formats of meshes, and what each can store."""
    refuse_parameters(request.query_params)
    accepted = request.headers.get("accept-encoding", "").encode("latin-1")
    response = json_response({"formats": formats()})
    return await compress_response(response, accepted, context.computation)


def formats() -> list[dict[str, Any]]:
    """The entries of `GET /v1/formats`."""
    return [
        {
            "name": f.name,
            "title": f.title,
            "media_type": f.media_type,
            "suffix": f.suffix,
            "quads": f.has_quads,
            "overlays": f.has_overlays,
            "uvs": "uvs" in f.carries,
            "colors": "colors" in f.carries,
            "attributes": "attribute" in f.carries,
            "precision": "float32" if f.is_float32 else "float64",
            "quantize": f.compact,
            "compression": list_compressions() if f.compact else (),
        }
        for f in FORMATS
    ]


_READY: Json = {
    "content": {
        "application/json": {
            "example": {
                "status": "ready",
                "computing": "ready",
                "store": "ready",
                "writes": "ready",
            }
        }
    }
}
_FAILING = {
    "status": "unready",
    "computing": "ready",
    "store": "unavailable",
    "writes": "unavailable",
}
_UNREADY: Json = {
    "description": "Send no new requests here: a part does not work, or the service is about to "
    "stop.",
    "content": {
        "application/json": {
            "examples": {
                "store": {"value": _FAILING},
                "draining": {"value": {"status": "draining"}},
            }
        }
    },
}

_HEADERS = HEADERS | {"Cache-Control": "no-store"}

health = APIRouter()


@health.get(
    "/health",
    operation_id="getHealth",
    tags=["operations"],
    summary="State and versions, for people",
    response_model=Health,
    response_description="State and versions, for people.",
    responses={500: error("InternalError")},
)
async def get_health(request: Request) -> Response:
    """The state of the service, its version, and the version of its numbers (`engine`)."""
    state = "ready" if request.app.state.ready else "draining"
    return json_response({"status": state, "version": __version__, "engine": ENGINE})


@health.get(
    "/health/live",
    operation_id="getLiveness",
    tags=["operations"],
    summary="200 while the process runs",
    response_model=Health,
    response_description="The process runs.",
    responses={500: error("InternalError")},
)
async def get_liveness() -> Response:
    """Responds at once, without any check."""
    return json_response({"status": "live"}, headers=_HEADERS)


@health.get(
    "/health/ready",
    operation_id="getReadiness",
    tags=["operations"],
    summary="200 while the service is ready for new requests",
    response_model=Health,
    response_description="The service is ready for new requests.",
    responses={200: _READY, 500: error("InternalError"), 503: _UNREADY | {"model": Health}},
)
async def get_readiness(request: Request) -> Response:
    """Whether the service is ready for new requests.

    The service is ready if a self-test (a tiny mesh, at most once in 5 s) gave the right numbers,
    stored surfaces can be read (also if none can be stored), and the service is not about to stop.
    """
    state = request.app.state
    if not state.ready:
        return json_response({"status": "draining"}, 503, _HEADERS)
    store = state.services.store
    computes, has_store = await asyncio.gather(state.self_test.passes(), store.is_ready())
    # A single failure of the store does not make the service unready.
    is_service_ready = is_ready(state)
    content = {
        "status": "ready" if is_service_ready else "unready",
        "computing": "ready" if computes else "unavailable",
        "store": "ready" if has_store else "unavailable",
        "writes": store.writes,
    }
    return json_response(content, 200 if is_service_ready else 503, _HEADERS)


_COUNTER = """\
# HELP surface_cache_hits_total Responses sent from the cache.
# TYPE surface_cache_hits_total counter
surface_cache_hits_total 1204.0
"""
_OPEN_COUNTER = """\
# HELP surface_cache_hits Responses sent from the cache.
# TYPE surface_cache_hits counter
surface_cache_hits_total 1204.0
# EOF
"""
_METRICS: Json = {
    "content": {
        "text/plain": {"example": _COUNTER},
        "application/openmetrics-text": {"schema": {"type": "string"}, "example": _OPEN_COUNTER},
    }
}

metrics = APIRouter()
metrics.get(
    "/metrics",
    operation_id="getMetrics",
    tags=["operations"],
    summary="Metrics of the service, for Prometheus",
    description="In the text format of Prometheus, or as OpenMetrics if `Accept` names it. "
    "The operator decides whether this call exists, and whether it needs a key.",
    response_class=PlainTextResponse,
    response_description="All metrics.",
    responses={200: _METRICS, 422: error("InvalidQuery"), 500: error("InternalError")},
)(service_metrics.metrics)
