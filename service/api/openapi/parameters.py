"""Parameters and bodies of requests, as the decorators of routes tell them to FastAPI."""

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias

from fastapi import Path
from pydantic import WithJsonSchema

from service.api.caching.codings import CODINGS
from service.api.guard.signatures import EXPIRES, SIGNATURE
from service.api.stored import content_id
from service.decoders.format import Decoder
from service.decoders.registry import DECODERS
from service.encoders.format import FileFormat
from service.encoders.registry import FORMATS
from service.schemas.options import MeshOptionFields
from service.schemas.query import LIST_NAMES, MeshQuery
from service.schemas.surface_query import FIELDS
from service.surface.checks import MAX_DEGREE
from service.surface.examples import EXAMPLES
from service.surface.knots import NAMED

Json: TypeAlias = dict[str, Any]

REQUESTS: dict[str, Json] = json.loads(files(__package__).joinpath("requests.json").read_bytes())
"""Examples of bodies, by operation: a summary and a value by name."""

_MESHES = REQUESTS["createMesh"]


def _of_mesh(name: str, summary: str, **changed: Any) -> Json:
    return {"summary": summary, "value": _MESHES[name]["value"] | changed}


REQUESTS["estimateMesh"] = {
    "patch": _MESHES["patch"],
    "quads": _of_mesh("patches", "Quads, for which some formats have no place"),
    "huge": _of_mesh("patch", "More vertices than are answered in any format", resolution=60_000),
    "tolerance": _of_mesh("tolerance", "By tolerance: no more than this comes out"),
    "tube": _of_mesh("tube", "A tube, whose vertices are counted as many as they may be"),
}
REQUESTS["storeSurface"] = {
    name: _MESHES[name] | {"value": {"surface": _MESHES[name]["value"]["surface"]}}
    for name in ("patch", "rational", "nurbs", "group")
}

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
    is_list = name in LIST_NAMES or name in ("degree", "knots")
    return {"style": "form", "explode": False} if is_list else {}


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
    extra["requestBody"]["content"] |= {d.media_type: _file(d) for d in DECODERS}
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
    return [
        _parameter("query", name, f"Beside a file: {about}", _FIELD_SCHEMAS[name], **_style(name))
        for name, about in FIELDS.items()
    ]


def _file(decoder: Decoder) -> Json:
    """A body that is a file."""
    schema = {"type": "string", "description": decoder.about}
    if decoder.example is None:
        return {"schema": schema | {"format": "binary"}}
    summary, text = decoder.example
    return {"schema": schema, "examples": {decoder.name: {"summary": summary, "value": text}}}
