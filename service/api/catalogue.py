"""What there is: examples, formats, and whether the service is well."""

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from service import __version__
from service.api.answers import json_response
from service.api.links import mesh_path, surface_address
from service.api.parameters import no_parameters
from service.encoders.compression import compressions
from service.encoders.registry import FORMATS
from service.engine.mesh import ENGINE
from service.surface.examples import EXAMPLES, Example
from service.surface.lowered import GroupModel, Model
from service.surface.sweep_model import SweepModel


async def list_surfaces(request: Request) -> Response:
    """GET /v1/surfaces: the built-in examples."""
    no_parameters(request.query_params)
    root = request.scope.get("root_path", "")
    return json_response({"surfaces": [_summary(e, root) for e in EXAMPLES.values()]})


async def list_formats(request: Request) -> Response:
    """GET /v1/formats."""
    no_parameters(request.query_params)
    return json_response({"formats": formats()})


def formats() -> list[dict[str, Any]]:
    """The formats as they are listed."""
    return [
        {
            "name": f.name,
            "title": f.title,
            "media_type": f.media_type,
            "suffix": f.suffix,
            "quads": f.quads,
            "overlays": f.overlays,
            "uvs": "uvs" in f.carries,
            "colors": "colors" in f.carries,
            "attributes": "attribute" in f.carries,
            "precision": "float32" if f.single else "float64",
            "quantize": f.compact,
            "compression": compressions() if f.compact else (),
        }
        for f in FORMATS
    ]


async def health(request: Request) -> Response:
    """GET /health: version and state, for people."""
    state = "ready" if request.app.state.ready else "draining"
    return json_response({"status": state, "version": __version__, "engine": ENGINE})


async def live(_: Request) -> Response:
    """GET /health/live: the event loop turns."""
    return json_response({"status": "live"})


async def ready(request: Request) -> Response:
    """GET /health/ready: 503 once no new requests should come here.

    It says whether the store answers, and stays 200 if it does not: meshes of posted surfaces and
    of examples need no store, and replicas that share one would all be taken out at once, for a
    fault that no other replica can make good.
    """
    if not request.app.state.ready:
        return json_response({"status": "draining"}, status=503)
    answers = await request.app.state.store.answers()
    return json_response({"status": "ready", "store": "ready" if answers else "unavailable"})


def _summary(example: Example, root: str) -> dict[str, Any]:
    surface = example.surface()
    model = surface.lower()
    return {
        "id": example.id,
        "title": example.title,
        "description": example.description,
        "up": surface.up,
        "patches": model.patch_count,
        "degree": _degree(model),
        "links": {
            "self": surface_address(root, example.id),
            "mesh": {f.suffix: mesh_path(root, example.id, f.suffix) for f in FORMATS},
        },
    }


def _degree(model: Model) -> list[int]:
    """The highest degree along u and along v of any patch; of a sweep, that of its curve and 0."""
    degrees = [(0, 0)]
    for each in model.models if isinstance(model, GroupModel) else (model,):
        if isinstance(each, SweepModel):
            degrees.append((each.pieces.degree, 0))
            continue
        sides = [batch.side_degrees for batch in each.batches]
        degrees += [(of[2], of[0]) for of in sides]
    u, v = zip(*degrees, strict=True)
    return [max(u), max(v)]
