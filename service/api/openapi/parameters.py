"""Parameters and bodies of requests, as the decorators of routes tell them to FastAPI."""

import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias

from fastapi import Path
from pydantic import WithJsonSchema

from service.api.caching.codings import CODINGS
from service.api.guard.signatures import EXPIRES, SIGNATURE
from service.api.openapi.requests import REQUESTS, Json
from service.api.stored import content_id
from service.decoders.registry import DECODERS
from service.encoders.format import FileFormat
from service.encoders.registry import FORMATS
from service.schemas.options import MeshOptionFields
from service.schemas.query import LIST_NAMES, MeshQuery
from service.schemas.surface_query import FIELDS
from service.surface.checks import MAX_DEGREE
from service.surface.examples import EXAMPLES
from service.surface.knots import NAMED

_HASH = {"type": "string", "pattern": "^[0-9a-f]{64}$"}

SurfaceId: TypeAlias = Annotated[
    str,
    WithJsonSchema({"anyOf": [{"type": "string", "enum": list(EXAMPLES)}, _HASH]}),
    Path(
        description="Id of a surface: the name of a built-in one, or what storing it answered.",
        openapi_examples={"teapot": {"value": "utah-teapot"}},
    ),
]
StoredId: TypeAlias = Annotated[
    str,
    WithJsonSchema(_HASH),
    Path(
        description="Id of a stored surface: what storing it answered.",
        openapi_examples={"saddle": {"value": content_id("saddle")}},
    ),
]
Suffix: TypeAlias = Annotated[
    str,
    WithJsonSchema({"type": "string", "enum": [f.suffix for f in FORMATS]}),
    Path(
        description="Suffix of the format of the answer; `Accept` is not read.",
        openapi_examples={"glb": {"value": "glb"}},
    ),
]


def _parameter(place: str, name: str, description: str, schema: Json, **more: Any) -> Json:
    about = {"name": name, "in": place, "required": False, "description": description}
    return about | {"schema": schema} | more


IF_NONE_MATCH = _parameter(
    "header",
    "If-None-Match",
    "Tags of answers that the client has, or `*`.",
    {"type": "string"},
    example='"3q2-7wEAAAAAAAAAAAAAAA"',
)
ACCEPT_ENCODING = _parameter(
    "header",
    "Accept-Encoding",
    "Codings that the client takes, with weights if it likes: "
    + ", ".join(f"`{coding}`" for coding in CODINGS)
    + ". Small bodies, and those that would not become smaller, are sent as they are.",
    {"type": "string"},
    example="zstd, gzip",
)
SIGNED = [
    _parameter(
        "query",
        EXPIRES,
        "Of a signed address: until when it is good, in Unix time.",
        {"type": "integer", "minimum": 0, "examples": [1800000000]},
    ),
    _parameter(
        "query",
        SIGNATURE,
        "Of a signed address, as `POST /v1/sign` makes it: its last parameter.",
        {"type": "string", "pattern": "^[A-Za-z0-9_-]{43}$"},
    ),
]


def format_parameter(
    formats: Sequence[FileFormat],
    description: str = "Format of the answer, stronger than `Accept`.",
) -> Json:
    """The format that a query may name."""
    names = {"type": "string", "enum": [fmt.name for fmt in formats]}
    return _parameter("query", "format", description, names, example="glb")


def option_parameters() -> list[Json]:
    """The options of a mesh and the engine as query parameters, lists comma-separated."""
    parameters = []
    for name, schema in MeshQuery.model_json_schema()["properties"].items():
        description, examples = schema.pop("description"), schema.pop("examples", [])
        more = {"example": examples[0]} if examples else {}
        parameters.append(_parameter("query", name, description, schema, **more, **_style(name)))
    return parameters


def _style(name: str) -> Json:
    return {"style": "form", "explode": False} if name in LIST_NAMES else {}


def json_body(operation: str, *parameters: Json) -> Json:
    """The examples of a body that is JSON, and parameters, as `openapi_extra` takes them."""
    body = {"content": {"application/json": {"examples": REQUESTS[operation]}}}
    return {"requestBody": body, "parameters": list(parameters)}


def surface_body(operation: str, *parameters: Json, has_options: bool = True) -> Json:
    """A surface as JSON, or as a file with its fields in the query, as `openapi_extra` takes it.

    Parameters
    ----------
    operation : str
        Its id, by which the examples are listed.
    parameters : dict
        Other parameters of the query.
    has_options : bool
        Whether the query has the options of a mesh, too.
    """
    extra = json_body(operation)
    extra["requestBody"]["content"] |= {d.media_type: _FILES[d.name] for d in DECODERS}
    beside = [_beside_a_file(option) for option in option_parameters()] if has_options else []
    # The engine, too, is a parameter, but of addresses.
    beside = [option for option in beside if option["name"] in MeshOptionFields.model_fields]
    return extra | {"parameters": [*parameters, *_field_parameters(), *beside]}


def _beside_a_file(option: Json) -> Json:
    """An option whose example is within its schema, and whose default is in words.

    Pages on which calls are tried begin with the examples and defaults of parameters, and beside
    JSON these must be empty.
    """
    parameter = {key: value for key, value in option.items() if key != "example"}
    schema = dict(option["schema"])
    default = schema.pop("default", None)
    left_out = "" if default is None else f" Left out: {json.dumps(default)}."
    if "example" in option:
        schema["examples"] = [option["example"]]
    text = f"Beside a file: {option['description']}{left_out}"
    return parameter | {"description": text, "schema": schema}


def _pair(item: Json, examples: list[Any]) -> Json:
    return {"type": "array", "items": item, "minItems": 1, "maxItems": 2, "examples": examples}


_KINDS = list(dict.fromkeys(kind for decoder in DECODERS for kind in decoder.kinds))
_FIELD_SCHEMAS: Mapping[str, Json] = MappingProxyType(
    {
        "type": {"type": "string", "enum": _KINDS, "examples": ["bspline"]},
        "degree": _pair({"type": "integer", "minimum": 1, "maximum": MAX_DEGREE}, [[3], [3, 2]]),
        "knots": _pair(
            {"type": "string", "enum": list(NAMED)}, [["clamped"], ["clamped", "periodic"]]
        ),
        "up": {"type": "string", "enum": ["y", "z"], "examples": ["z"]},
        "name": {"type": "string", "minLength": 1, "maxLength": 100, "examples": ["sail"]},
    }
)


def _field_parameters() -> list[Json]:
    """The fields of a surface that stand beside a file."""
    lists = {"style": "form", "explode": False}
    return [
        _parameter(
            "query",
            name,
            f"Beside a file: {about}",
            _FIELD_SCHEMAS[name],
            **(lists if _FIELD_SCHEMAS[name]["type"] == "array" else {}),
        )
        for name, about in FIELDS.items()
    ]


def _text_file(description: str, name: str, summary: str, value: str) -> Json:
    examples = {name: {"summary": summary, "value": value}}
    return {"schema": {"type": "string", "description": description}, "examples": examples}


_FILES: Mapping[str, Json] = MappingProxyType(
    {
        "npy": {
            "schema": {
                "type": "string",
                "format": "binary",
                "description": "A file as `numpy.save` writes it, of float32 or float64 in either "
                "order of bytes and of axes. An array (p+1, q+1, 3) is one control net, of a "
                "Bézier patch or, with `type=bspline`, of a B-spline; an array (P, p+1, q+1, 3) is "
                "P Bézier patches, which meet where their control points are equal. With 4 numbers "
                "a point the last is its weight, by which the others are not multiplied. Errors "
                "point into the document that the array stands for: `/surface/control_net/i/j/k`, "
                "or, of several patches, `/surface/vertices/n/k` for the n-th point of the array.",
            }
        },
        "oogl": _text_file(
            "A BEZ or BBP object of OOGL, or a LIST of such, in ASCII: any number of Bézier "
            "patches, control points u fastest, (wx, wy, wz, w) where there are four numbers. "
            "Texture coordinates and colours of the corners are read; lines and appearances are "
            "passed over. Patches of several degrees become a `group`. Errors tell the line. What "
            "the service writes with `oogl=bez` is read.",
            "rational",
            "A quarter of a cylinder, exactly: degrees (2, 1), weights",
            "BEZ214\n1 0 0 1  1 1 0 1  0 2 0 2\n1 0 1 1  1 1 1 1  0 2 2 2\n",
        ),
        "teapot": _text_file(
            "The text of the Utah teapot: the number of patches; the indices of each, counted from "
            "1, (p+1)² for degree p, in one line or in p + 1; the number of vertices; x, y, z of "
            "each. Commas or blanks part the numbers. Errors tell the line.",
            "strip",
            "Two patches of degree (1, 1) that share an edge",
            "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n",
        ),
    }
)
