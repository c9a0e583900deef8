"""The operation that converts surfaces, in the OpenAPI document; its examples are computed."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

import orjson

from service.api.openapi.headers import timed
from service.api.openapi.operations import post_operation
from service.api.openapi.references import Json, ref
from service.pipeline.conversion import converted
from service.schemas.convert import ConvertRequest
from service.schemas.validation import validate_document
from service.surface.convert.nets import Allowed

_PATCH: Json = {
    "control_net": [[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]
}
_ARC: Json = {
    "control_net": [[[1, 0, 0], [1, 1, 0], [0, 1, 0]], [[1, 0, 1], [1, 1, 1], [0, 1, 1]]],
    "weights": [[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]],
    "up": "z",
    "name": "quarter",
}
_SPLINE: Json = {
    "type": "bspline",
    "control_net": [[[i, j, (i % 2) * (j % 2)] for j in range(3)] for i in range(4)],
    "degree": 2,
    "knots": "uniform",
}
_TRIANGLE: Json = {
    "type": "triangle",
    "control_net": [[[0, 0, 0], [2, 0, 2], [4, 0, 0]], [[0, 2, 2], [2, 2, 0]], [[0, 4, 0]]],
}

_EXAMPLES: Mapping[str, tuple[str, Json, list[Json]]] = MappingProxyType(
    {
        "elevate": (
            "A patch of degree (1, 2) raised until p = q",
            _PATCH,
            [{"op": "elevate", "degree": [2, 2]}],
        ),
        "split": (
            "Four pieces of a patch, over shared vertices",
            _PATCH,
            [{"op": "split", "u": 0.5, "v": 0.5}],
        ),
        "restrict": (
            "Half of a quarter of a cylinder",
            _ARC,
            [{"op": "restrict", "v": [0, 0.5]}],
        ),
        "transpose": ("u and v exchanged", _PATCH, [{"op": "transpose"}]),
        "reverse": (
            "Both parameters run backwards: the normal stays on its side",
            _PATCH,
            [{"op": "reverse", "direction": "u"}, {"op": "reverse", "direction": "v"}],
        ),
        "bezier": ("A B-spline as two Bézier patches", _SPLINE, [{"op": "bezier"}]),
        "triangle": (
            "Half of a patch of degree (1, 2), as a triangle of degree 3",
            _PATCH,
            [{"op": "triangle", "half": "lower"}],
        ),
        "third": (
            "Three triangles that meet in the middle of one",
            _TRIANGLE,
            [{"op": "split", "at": [0.25, 0.25, 0.5]}],
        ),
        "refine": (
            "A B-spline in a higher degree, clamped: as smooth as before",
            _SPLINE,
            [{"op": "elevate", "degree": [3, 2]}],
        ),
    }
)


def post_convert() -> Json:
    """POST /v1/convert."""
    examples = _examples()
    requests = {
        name: {"summary": summary, "value": request}
        for name, (summary, request, _) in examples.items()
    }
    answers = {
        name: {"summary": summary, "value": answer}
        for name, (summary, _, answer) in examples.items()
    }
    content = {"schema": ref("SurfaceDocument"), "examples": answers}
    return post_operation(
        "convertSurface",
        "surfaces",
        "A surface in another form, with the same points",
        "Does the operations one after the other and answers the surface that comes out, as a body "
        "for the other calls. Corner points keep their digits, and patches that shared an edge "
        "share it afterwards. Colours, texture coordinates and attributes come along.",
        request=("ConvertRequest", requests),
        answer=timed({"description": "The surface.", "content": {"application/json": content}}),
    )


@cache
def _examples() -> dict[str, tuple[str, Json, Any]]:
    """Summary, request and answer of each example."""
    found: dict[str, tuple[str, Json, Any]] = {}
    for name, (summary, surface, operations) in _EXAMPLES.items():
        request: Json = {"surface": surface, "operations": operations}
        wanted = validate_document(ConvertRequest, request)
        answer = converted(wanted.to_surface(), wanted.to_operations(), Allowed())
        found[name] = summary, request, orjson.loads(answer)
    return found
