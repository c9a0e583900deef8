"""The operation that answers points, in the OpenAPI document; its example is computed."""

from functools import cache
from typing import Any

import orjson

from service.api.openapi.headers import timed
from service.api.openapi.operations import post_operation
from service.api.openapi.references import Json, ref
from service.engine.points.answer import COLUMNS
from service.pipeline.points import plan_points
from service.schemas.points import PointsRequest
from service.schemas.validation import validate_document

_VECTORS = {
    "positions": "The points [x, y, z].",
    "du": "First partials along u, in the parameters of the surface.",
    "dv": "First partials along v.",
    "normals": "Unit normals along du × dv; where that vanishes, their limits from inside the "
    "surface.",
    "duu": "Second partials along u.",
    "duv": "Mixed second partials.",
    "dvv": "Second partials along v.",
}

_ALWAYS = frozenset({"positions", "normals"})
"""What double precision can hold of every surface that is taken; else there may be a null."""

_CURVATURE = "null where it grows beyond all bounds, as at the apex of a cone, or has no limit."
_NUMBERS = {
    "gaussian_curvature": f"Gaussian curvatures, k1 · k2; {_CURVATURE}",
    "mean_curvature": "Mean curvatures, (k1 + k2)/2; positive where the surface bends towards its "
    f"normal, so that a sphere with outward normals has −1/r; {_CURVATURE}",
}

_DEGENERATE = (
    "Whether du × dv vanishes, as at a pole: normals and curvatures there are limits, taken along "
    "the line that leads straight inwards."
)
_PRINCIPAL = f"Principal curvatures [k1, k2], k1 ≥ k2; {_CURVATURE}"

_PATCH = {
    "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]},
    "uv": [[0, 0], [0.5, 0.25]],
    "derivatives": 2,
}
_REQUESTS: Json = {
    "patch": {"summary": "Two points of a patch, and how it bends there", "value": _PATCH},
    "triangle": {
        "summary": "The middle of a triangle of degree 1",
        "value": {
            "surface": {
                "type": "triangle",
                "control_net": [[[0, 0, 0], [1, 0, 0]], [[0, 1, 1]]],
            },
            "barycentric": [[0.25, 0.25, 0.5]],
        },
    },
    "patches": {
        "summary": "The middle of each of two patches",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]],
                "patches": [[[0, 1], [2, 3]], [[2, 3], [4, 5]]],
            },
            "uv": [[0.5, 0.5], [0.5, 0.5]],
            "patch": [0, 1],
        },
    },
}


def post_points() -> Json:
    """POST /v1/points."""
    content = {"schema": ref("Points"), "examples": {"patch": {"value": _answer()}}}
    return post_operation(
        "queryPoints",
        "points",
        "Points of a surface, with derivatives and curvatures",
        "Evaluates the surface at the parameters given, in float64, and answers in columns: row k "
        "of each belongs to place k of `uv` or `barycentric`. Partials are those with respect to "
        "the surface's own parameters, right-continuous at knots. Tubes, ribbons and groups have "
        "none (`not_parametric`).",
        request=("PointsRequest", _REQUESTS),
        answer=timed({"description": "The points.", "content": {"application/json": content}}),
    )


def points_schema() -> Json:
    """What is answered: the columns that the order of derivatives brings."""
    properties: Json = {}
    for name, width in (column for columns in COLUMNS for column in columns):
        if width == 0:
            properties[name] = _column({"type": "boolean"}, _DEGENERATE)
        elif name in _VECTORS:
            number = "number" if name in _ALWAYS else ["number", "null"]
            properties[name] = _column(_row({"type": number}, width), _VECTORS[name])
        elif width > 1:
            properties[name] = _column(_row({"type": ["number", "null"]}, width), _PRINCIPAL)
        else:
            properties[name] = _column({"type": ["number", "null"]}, _NUMBERS[name])
    return {
        "type": "object",
        "properties": properties,
        "required": ["positions"],
        "description": "Points of a surface in columns, float64, a row for every place asked for.",
    }


def _column(items: Json, description: str) -> Json:
    return {"type": "array", "items": items, "description": description}


def _row(items: Json, width: int) -> Json:
    return {"type": "array", "items": items, "minItems": width, "maxItems": width}


@cache
def _answer() -> Any:
    wanted = validate_document(PointsRequest, _PATCH)
    return orjson.loads(plan_points(wanted.to_surface(), wanted.to_query()).run())
