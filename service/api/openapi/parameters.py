"""Parameters and request bodies for the OpenAPI document, as FastAPI's decorators take them."""

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias, get_args

from fastapi import Path
from pydantic import BaseModel, WithJsonSchema, create_model

from service.api.caching.codings import CODINGS
from service.api.guard.signatures import EXPIRES, SIGNATURE
from service.api.stored import content_id
from service.decoders.format import Decoder
from service.decoders.registry import DECODERS, NET_DECODERS
from service.encoders.format import FileFormat
from service.encoders.registry import FORMATS
from service.schemas.file_fields import FIELDS, OPERATIONS
from service.schemas.options import MeshOptionFields
from service.schemas.pictures import PictureFields
from service.schemas.query import LIST_NAMES, MeshQuery, PictureQuery
from service.surface.brep import InvalidFaces
from service.surface.checks import MAX_DEGREE
from service.surface.examples.catalogue import EXAMPLES
from service.surface.knots import NAMED

Json: TypeAlias = dict[str, Any]

REQUESTS: Mapping[str, Json] = MappingProxyType(
    json.loads(files(__package__).joinpath("requests.json").read_bytes())
)
"""Long examples of bodies, by operation: a summary and a value for each name.

Short examples are beside their routes.
"""

_HASH = {"type": "string", "pattern": "^[0-9a-f]{64}$"}

SurfaceId: TypeAlias = Annotated[
    str,
    WithJsonSchema({"anyOf": [{"type": "string", "enum": list(EXAMPLES)}, _HASH]}),
    Path(
        description="Id of a surface: the name of a built-in one, or the id of a stored one.",
        openapi_examples={"teapot": {"value": "utah-teapot"}},
    ),
]
StoredId: TypeAlias = Annotated[
    str,
    WithJsonSchema(_HASH),
    Path(
        description="Id of a stored surface.",
        openapi_examples={"saddle": {"value": content_id("saddle")}},
    ),
]
Suffix: TypeAlias = Annotated[
    str,
    WithJsonSchema({"type": "string", "enum": [f.suffix for f in FORMATS]}),
    Path(
        description="Suffix of the response's format; `Accept` is not read.",
        openapi_examples={"glb": {"value": "glb"}},
    ),
]


def parameter(location: str, name: str, description: str, schema: Json, **fields: Any) -> Json:
    """An optional parameter; `location` is "query" or "header", `fields` are further fields."""
    parameter = {"name": name, "in": location, "required": False, "description": description}
    return parameter | {"schema": schema} | fields


IF_NONE_MATCH = parameter(
    "header",
    "If-None-Match",
    "Entity tags of responses that the client has, or `*`.",
    {"type": "string"},
    example='"3q2-7wEAAAAAAAAAAAAAAA"',
)
ACCEPT_ENCODING = parameter(
    "header",
    "Accept-Encoding",
    "Codings that the client accepts, optionally with quality values: "
    + ", ".join(f"`{coding}`" for coding in CODINGS)
    + ". Small bodies, and bodies that would not become smaller, are not compressed.",
    {"type": "string"},
    example="zstd, gzip",
)
SIGNED = [
    parameter(
        "query",
        EXPIRES,
        "Only in a signed URL: when it expires, in Unix time.",
        {"type": "integer", "minimum": 0, "examples": [1800000000]},
    ),
    parameter(
        "query",
        SIGNATURE,
        "Only in a signed URL, as `POST /v1/sign` makes it: its last parameter.",
        {"type": "string", "pattern": "^[A-Za-z0-9_-]{43}$"},
    ),
]


MAX_LIMIT, DEFAULT_LIMIT = 1000, 100
"""Most entries of a page of a list, and their number if the request names none."""

PAGE = [
    parameter(
        "query",
        "after",
        "The last id of the page before; by default, the list begins with the first.",
        {"type": "string", "pattern": "^[0-9a-f]{64}$"},
    ),
    parameter(
        "query",
        "limit",
        "Most entries of the page.",
        {"type": "integer", "minimum": 1, "maximum": MAX_LIMIT, "default": DEFAULT_LIMIT},
    ),
]


def format_parameter(
    formats: Sequence[FileFormat],
    description: str = "Format of the response; takes precedence over `Accept`.",
) -> Json:
    """The query parameter `format`."""
    names = [fmt.name for fmt in formats]
    example = "glb" if "glb" in names else "step"
    schema = {"type": "string", "enum": names, "examples": [example]}
    return parameter("query", "format", description, schema)


def picture_parameters() -> list[Json]:
    """The options of a picture and `engine` as query parameters."""
    return _parameters_of(PictureQuery)


def option_parameters() -> list[Json]:
    """The options of a mesh and `engine` as query parameters.

    Their examples are in their schemas, not in the parameters: Swagger UI fills in all examples of
    parameters at once, and some options exclude each other.
    """
    return _parameters_of(MeshQuery)


def _parameters_of(model: type[BaseModel]) -> list[Json]:
    return [
        parameter("query", name, schema.pop("description"), schema, **_style(name))
        for name, schema in model.model_json_schema()["properties"].items()
    ]


def _style(name: str) -> Json:
    """For an option or a field of a surface that is a list: the parameter is repeated.

    The service takes lists with commas, too; some generators of clients can write only one form.
    """
    return {"style": "form", "explode": True} if name in LIST_NAMES else {}


def json_body(examples: Json, *parameters: Json) -> Json:
    """A JSON body with its examples, and parameters: the argument `openapi_extra` of a route."""
    body = {"content": {"application/json": {"examples": examples}}}
    return {"requestBody": body, "parameters": list(parameters)}


_NAMED_SURFACE = parameter(
    "query",
    "surface",
    "With a file: the id of a built-in or a stored surface.",
    {"type": "string", "examples": ["sphere"]},
)


def array_body(
    examples: Json, model: type[BaseModel], array: str, about: str, *parameters: Json
) -> Json:
    """A body that is a document as JSON, or one of its arrays with the other fields in the query.

    Parameters
    ----------
    model : type
        The model of the document.
    array, about : str
        The field whose numbers may be sent as a file, and the axes of that array.
    parameters : dict
        More query parameters.
    """
    extra = json_body(examples)
    text = f"`{array}` as a file of `numpy.save`, of float32 or float64: {about}."
    schema = {"type": "string", "format": "binary", "description": text}
    extra["requestBody"]["content"]["application/x-npy"] = {"schema": schema}
    return extra | {"parameters": [*parameters, _NAMED_SURFACE, *scalar_options(model)]}


def mesh_body(examples: Json, model: type[BaseModel], decoders: Sequence[Decoder]) -> Json:
    """A body that is a document as JSON, or a file with its mesh and the other fields in the query.

    `examples` are bodies, `model` has the other fields, and `decoders` read the files.
    """
    extra = json_body(examples)
    extra["requestBody"]["content"] |= {each.media_type: _file(each) for each in decoders}
    return extra | {"parameters": [_NAMED_SURFACE, *scalar_options(model)]}


def surface_body(examples: Json, *parameters: Json, options: Sequence[Json] = ()) -> Json:
    """A body that is a surface as JSON, or a file with a surface and other fields in the query.

    The result is the argument `openapi_extra` of a route.

    Parameters
    ----------
    examples : dict
        Examples of bodies: a summary and a value for each name.
    parameters : dict
        More query parameters.
    options : sequence of dict
        Parameters of the fields beside the surface, which only a request with a file has.
    """
    extra = json_body(examples)
    extra["requestBody"]["content"] |= file_bodies()
    return extra | {"parameters": [*parameters, *_field_parameters(), *options]}


def file_bodies() -> Json:
    """The bodies that are files with a surface, by media type."""
    return {decoder.media_type: _file(decoder) for decoder in DECODERS}


def mesh_options() -> list[Json]:
    """The options of a mesh as query parameters of a request with a file."""
    # `engine` is a parameter too, but only of meshes by URL.
    names = MeshOptionFields.model_fields
    return [_file_option(each) for each in option_parameters() if each["name"] in names]


def picture_options() -> list[Json]:
    """The options of a picture as query parameters of a request with a file."""
    names = PictureFields.model_fields
    return [_file_option(each) for each in picture_parameters() if each["name"] in names]


def scalar_options(model: type[BaseModel]) -> list[Json]:
    """The fields of a document that are not lists, as query parameters of a request with a file."""
    # Without the surface, whose schema is long.
    fields: dict[str, Any] = {
        name: (field.rebuild_annotation(), field)
        for name, field in model.model_fields.items()
        if name != "surface"
    }
    options = create_model(model.__name__, **fields).model_json_schema()["properties"]
    return [
        _file_option(parameter("query", name, schema.pop("description"), schema))
        for name, schema in options.items()
        if schema.get("type") in ("number", "boolean", "string")
    ]


OPERATIONS_PARAMETER = parameter(
    "query",
    OPERATIONS,
    "With a file: the operations, as JSON.",
    {"type": "string", "examples": ['[{"op": "untrim", "face": 0}]']},
)


def _file_option(option: Json) -> Json:
    """The parameter of an option for a body that is a file, with its default in the description.

    Swagger UI would fill in a default of the schema, but with a JSON body the parameter must stay
    empty.
    """
    schema = dict(option["schema"])
    default = schema.pop("default", None)
    default_text = "" if default is None else f" Default: {json.dumps(default)}."
    text = f"With a file: {option['description']}{default_text}"
    return option | {"description": text, "schema": schema}


def _one_or_two(item: Json, examples: list[Any]) -> Json:
    """The schema of a list with one item for both directions, or with an item for each."""
    return {"type": "array", "items": item, "minItems": 1, "maxItems": 2, "examples": examples}


_KINDS = list(dict.fromkeys(kind for decoder in NET_DECODERS for kind in decoder.kinds))
_FIELD_SCHEMAS: Mapping[str, Json] = MappingProxyType(
    {
        "type": {"type": "string", "enum": _KINDS, "examples": ["bspline"]},
        "degree": _one_or_two(
            {"type": "integer", "minimum": 1, "maximum": MAX_DEGREE}, [[3], [3, 2]]
        ),
        "knots": _one_or_two(
            {"type": "string", "enum": list(NAMED)}, [["clamped"], ["clamped", "periodic"]]
        ),
        "homogeneous": {"type": "boolean", "examples": [True]},
        "up": {"type": "string", "enum": ["y", "z"], "examples": ["z"]},
        "name": {"type": "string", "minLength": 1, "maxLength": 100, "examples": ["sail"]},
        "invalid_faces": {
            "type": "string",
            "enum": list(get_args(InvalidFaces)),
            "examples": ["skip"],
        },
    }
)


def _field_parameters() -> list[Json]:
    """The fields of a surface as query parameters, for a body that is a file."""
    return [
        parameter("query", name, f"With a file: {about}", _FIELD_SCHEMAS[name], **_style(name))
        for name, about in FIELDS.items()
    ]


def _file(decoder: Decoder) -> Json:
    """The schema and example of a body that is a file."""
    schema = {"type": "string", "description": decoder.about}
    if decoder.example is None:
        return {"schema": schema | {"format": "binary"}}
    summary, text = decoder.example
    return {"schema": schema, "examples": {decoder.name: {"summary": summary, "value": text}}}
