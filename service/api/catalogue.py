"""What there is: examples and formats."""

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import json_response
from service.api.links import mesh_path, surface_address
from service.api.parameters import no_parameters
from service.encoders.compression import compressions
from service.encoders.registry import FORMATS
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
