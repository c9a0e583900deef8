"""The operation that estimates meshes, in the OpenAPI document; its examples are computed."""

from functools import cache
from typing import Any

import orjson

from service.api.openapi.bodies import with_files
from service.api.openapi.examples import REQUESTS as MESHES
from service.api.openapi.headers import timed
from service.api.openapi.operations import format_parameter, post_operation
from service.api.openapi.references import Json, ref
from service.encoders.registry import FORMATS
from service.encoders.text import json_text
from service.pipeline.encoding import encode_options
from service.pipeline.estimate import estimate, estimate_object
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.settings.values import Settings, result_limits

REQUESTS: Json = {
    "patch": MESHES["patch"],
    "quads": {
        "summary": "Quads, for which some formats have no place",
        "value": MESHES["patches"]["value"],
    },
    "huge": {
        "summary": "More vertices than are answered in any format",
        "value": MESHES["patch"]["value"] | {"resolution": 60_000},
    },
    "tolerance": {
        "summary": "By tolerance: no more than this comes out",
        "value": MESHES["tolerance"]["value"],
    },
    "tube": {
        "summary": "A tube, whose vertices are counted as many as they may be",
        "value": MESHES["tube"]["value"],
    },
}


def post_estimate() -> Json:
    """POST /v1/estimate."""
    examples = {
        name: {"summary": example["summary"], "value": answer(example["value"])}
        for name, example in REQUESTS.items()
    }
    content = {"schema": ref("Estimate"), "examples": examples}
    operation = post_operation(
        "estimateMesh",
        "meshes",
        "What a mesh would be, before it is made",
        "Takes the body of `POST /v1/mesh` and answers how many vertices and faces the mesh would "
        "have, how many bytes in each format, and whether the request would be refused, at a small "
        "part of the cost of the mesh. What is wrong with the body itself is refused here as well.",
        request=("MeshRequest", REQUESTS),
        answer=timed({"description": "The estimate.", "content": {"application/json": content}}),
    )
    named = format_parameter(FORMATS, "The one format to estimate for; all of them if left out.")
    return with_files(operation | {"parameters": [named]}, options=True)


@cache
def _answer(text: bytes) -> Any:
    wanted = validate_document(MeshRequest, orjson.loads(text))
    limits = result_limits(Settings())
    surface, options = wanted.to_surface(), wanted.mesh_options()
    found = estimate(surface, options, encode_options(wanted), limits)
    return orjson.loads(json_text(estimate_object(found)))


def answer(request: Json) -> Any:
    """What is answered to a request."""
    return _answer(orjson.dumps(request))


def estimate_schema() -> Json:
    """What is answered."""
    names = [fmt.name for fmt in FORMATS]
    issue: dict[str, Json] = {
        "formats": {
            "type": "array",
            "items": {"type": "string", "enum": names},
            "minItems": 1,
            "description": "The formats that it holds for.",
        },
        "code": {"type": "string", "description": "As in an error of `POST /v1/mesh`."},
        "pointer": {"type": "string", "description": "JSON pointer (RFC 6901) into the body."},
        "detail": {"type": "string", "description": "What is wrong, for people."},
        "got": {"type": "string", "description": "What was found."},
        "needed": {"type": "string", "description": "What would be right."},
    }
    size = {"type": "integer", "minimum": 0}
    properties: dict[str, Json] = {
        "vertices": size
        | {"description": "Positions, as in the report: one with several normals counts once."},
        "triangles": size | {"description": "Triangles."},
        "quads": size | {"description": "Quads."},
        "exact": {
            "type": "boolean",
            "description": "Whether these three are those of the report. Else they are upper "
            "bounds: under a tolerance, usually some ten times what comes out, or a budget; of "
            "what is swept along a curve; of wires with faces; of what is refused for its "
            "vertices.",
        },
        "bytes": {
            "type": "object",
            "properties": {name: size | {"description": f"Bytes as {name}."} for name in names},
            "additionalProperties": False,
            "description": "Bytes of the answer in every format that has a place for the mesh: "
            "upper bounds, but for `exact_bytes`. Numbers written as text count as long as they "
            "can be.",
        },
        "exact_bytes": {
            "type": "array",
            "items": {"type": "string", "enum": names},
            "description": "The formats whose number of bytes is exact.",
        },
        "memory": {
            "type": "object",
            "properties": {
                name: size | {"description": f"Bytes of memory for the mesh as {name}."}
                for name in names
            },
            "additionalProperties": False,
            "description": "Bytes of memory that making the answer takes at most, in the formats "
            "in which there would be one. What takes more than the service has for one request is "
            "refused, `too_much_memory`; what takes much may have to wait.",
        },
        "accepted": {
            "type": "boolean",
            "description": "Whether `POST /v1/mesh` would answer this body in one of the formats.",
        },
        "certain": {
            "type": "boolean",
            "description": "Whether nothing else can be refused. Under a tolerance it is so if the "
            "bounds above are within all limits; else, and under a budget, a mesh may turn out to "
            "be too large, or the tolerance too small, when it is made.",
        },
        "refused": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": issue,
                "required": list(issue),
                "description": "One thing for which `POST /v1/mesh` would refuse.",
            },
            "description": "Why it would not, in the formats in which it would not.",
        },
    }
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "description": "What a mesh would be.",
    }
