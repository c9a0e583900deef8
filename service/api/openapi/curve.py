"""The operation that answers curves, in the OpenAPI document; its example is computed."""

from functools import cache
from typing import Any

import orjson

from service.api.openapi.headers import timed
from service.api.openapi.operations import file_answer, file_schema, post_operation
from service.api.openapi.references import Json, ref
from service.encoders.curves.format import CurveFormat
from service.encoders.curves.registry import CURVE_FORMATS, CURVES_BY_NAME
from service.pipeline.curve import render_curve
from service.schemas.curves import CurveRequest
from service.schemas.validation import validate_document

_QUARTER: Json = {
    "curve": {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, 0.7071067811865476, 1]},
    "resolution": 2,
}
_SQUARE = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]

REQUESTS: Json = {
    "quarter": {"summary": "A quarter of a circle, exactly, in the plane", "value": _QUARTER},
    "space": {
        "summary": "A cubic in space, as near as a thousandth to its polyline",
        "value": {
            "curve": {
                "type": "bezier",
                "control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]],
                "up": "z",
                "name": "handle",
            },
            "tolerance": 0.001,
        },
    },
    "circle": {
        "summary": "A full circle, exactly: a NURBS curve of nine points",
        "value": {
            "curve": {
                "type": "bspline",
                "control_points": [[x, y] for x, y in _SQUARE],
                "degree": 2,
                "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
                "weights": [1 if x * y == 0 else 0.7071067811865476 for x, y in _SQUARE],
            },
        },
    },
    "closed": {
        "summary": "A closed B-spline of degree 3 through no point of its polygon",
        "value": {
            "curve": {
                "type": "bspline",
                "control_points": [[2, 0, 0], [0, 2, 1], [-2, 0, 0], [0, -2, 1]],
                "knots": "periodic",
            },
            "resolution": 8,
            "arc_lengths": False,
        },
    },
}


def post_curve() -> Json:
    """POST /v1/curve."""
    return post_operation(
        "createCurve",
        "curves",
        "A curve as points, tangents and lengths, or as lines",
        "Samples the curve and answers in the format that `Accept` prefers, or that `format` "
        "names; JSON if neither says anything. In glTF, OOGL and OBJ a curve in the plane lies at "
        "z = 0.",
        request=("CurveRequest", REQUESTS),
        answer=timed(file_answer("The curve.", {f.media_type: _content(f) for f in CURVE_FORMATS})),
        formats=CURVE_FORMATS,
    )


def _content(fmt: CurveFormat) -> Json:
    if fmt.name == "json":
        examples = {"quarter": {"summary": "The quarter of a circle", "value": _example()}}
        return {"schema": ref("Curve"), "examples": examples}
    return {"schema": file_schema(fmt)}


@cache
def _example() -> Any:
    wanted = validate_document(CurveRequest, _QUARTER)
    return orjson.loads(
        render_curve(wanted.to_curve(), wanted.curve_options(), CURVES_BY_NAME["json"])
    )


def _row(text: str) -> Json:
    return {
        "type": "array",
        "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3},
        "description": text,
    }


def _column(text: str) -> Json:
    return {"type": "array", "items": {"type": "number"}, "description": text}


def curve_schema() -> Json:
    """The answer as JSON."""
    bound = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3}
    least = bound | {"description": "Least x, y and, in space, z."}
    greatest = bound | {"description": "Greatest x, y and, in space, z."}
    report: dict[str, Json] = {
        "points": {"type": "integer", "minimum": 2, "description": "Number of points."},
        "pieces": {"type": "integer", "minimum": 1, "description": "Number of Bézier pieces."},
        "length": {
            "type": "number",
            "description": "Length of the curve itself, to about twelve digits.",
        },
        "closed": {
            "type": "boolean",
            "description": "Whether it ends where it begins; the last point is then the first.",
        },
        "deviation_bound": {
            "type": "number",
            "minimum": 0,
            "description": "No point of the curve is further from the lines between the points, as "
            "they are written.",
        },
        "bounds": {
            "type": "object",
            "properties": {"min": least, "max": greatest},
            "required": ["min", "max"],
            "description": "Of the points as stored.",
        },
        "engine": {"type": "integer", "description": "Version of the numbers."},
    }
    return {
        "type": "object",
        "description": "A sampled curve as JSON: columns of float64, row k of each for point k.",
        "properties": {
            "points": _row("Points with as many coordinates as the control points have."),
            "tangents": _row(
                "Unit tangents; left out if `tangents` is false. At a corner or a cusp, that of "
                "what follows."
            ),
            "parameters": _column("Parameters in the domain of the curve."),
            "arc_lengths": _column(
                "Length of the curve up to each point; left out if `arc_lengths` is false."
            ),
            "report": {
                "type": "object",
                "properties": report,
                "required": list(report),
                "description": "What is known about the curve.",
            },
        },
        "required": ["points", "parameters", "report"],
    }
