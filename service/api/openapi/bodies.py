"""Bodies that are files of control points, in the OpenAPI document, and the queries beside them."""

import json
from collections.abc import Mapping
from types import MappingProxyType

from service.api.openapi.references import Json
from service.api.openapi.requests import option_parameters
from service.decoders.registry import DECODERS
from service.schemas.options import MeshOptionFields
from service.schemas.surface_query import FIELDS
from service.surface.knots import NAMED

_ABOUT: Mapping[str, Json] = MappingProxyType(
    {
        "npy": {
            "type": "string",
            "format": "binary",
            "description": "A file as `numpy.save` writes it, of float32 or float64 in either "
            "order of bytes and of axes. An array (p+1, q+1, 3) is one control net, of a Bézier "
            "patch or, with `type=bspline`, of a B-spline; an array (P, p+1, q+1, 3) is P Bézier "
            "patches, which meet where their control points are equal. With 4 numbers a point the "
            "last is its weight, by which the others are not multiplied. Errors point into the "
            "document that the array stands for: `/surface/control_net/i/j/k`, or, of several "
            "patches, `/surface/vertices/n/k` for the n-th point of the array.",
        },
        "oogl": {
            "type": "string",
            "description": "A BEZ or BBP object of OOGL, or a LIST of such, in ASCII: any number "
            "of Bézier patches, control points u fastest, (wx, wy, wz, w) where there are four "
            "numbers. Texture coordinates and colours of the corners are read; lines and "
            "appearances are passed over. Patches of several degrees become a `group`. Errors "
            "tell the line. What the service writes with `oogl=bez` is read.",
        },
        "teapot": {
            "type": "string",
            "description": "The text of the Utah teapot: the number of patches; the indices of "
            "each, counted from 1, (p+1)² for degree p, in one line or in p + 1; the number of "
            "vertices; x, y, z of each. Commas or blanks part the numbers. Errors tell the line.",
        },
    }
)

_EXAMPLES: Mapping[str, Json] = MappingProxyType(
    {
        "oogl": {
            "rational": {
                "summary": "A quarter of a cylinder, exactly: degrees (2, 1), weights",
                "value": "BEZ214\n1 0 0 1  1 1 0 1  0 2 0 2\n1 0 1 1  1 1 1 1  0 2 2 2\n",
            }
        },
        "teapot": {
            "strip": {
                "summary": "Two patches of degree (1, 1) that share an edge",
                "value": "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n",
            }
        },
    }
)

_PAIR = MappingProxyType({"style": "form", "explode": False})

_FIELD_SCHEMAS: Mapping[str, Json] = MappingProxyType(
    {
        "type": {
            "type": "string",
            "enum": list(dict.fromkeys(kind for d in DECODERS for kind in d.kinds)),
            "examples": ["bspline"],
        },
        "degree": {
            "type": "array",
            "items": {"type": "integer", "minimum": 1, "maximum": 64},
            "minItems": 1,
            "maxItems": 2,
            "examples": [[3], [3, 2]],
        },
        "knots": {
            "type": "array",
            "items": {"type": "string", "enum": list(NAMED)},
            "minItems": 1,
            "maxItems": 2,
            "examples": [["clamped"], ["clamped", "periodic"]],
        },
        "up": {"type": "string", "enum": ["y", "z"], "examples": ["z"]},
        "name": {"type": "string", "minLength": 1, "maxLength": 100, "examples": ["sail"]},
    }
)


def with_files(operation: Json, *, options: bool) -> Json:
    """A POST of a surface as JSON, with the files that it takes as well.

    Parameters
    ----------
    options : bool
        Whether it takes options of a mesh, which then stand in the query.
    """
    body = operation["requestBody"]
    files = {decoder.media_type: _content(decoder.name) for decoder in DECODERS}
    beside = [*_fields(), *(_options() if options else ())]
    return operation | {
        "requestBody": body | {"content": body["content"] | files},
        "parameters": [*operation.get("parameters", []), *beside],
    }


def _content(name: str) -> Json:
    examples = _EXAMPLES.get(name)
    return {"schema": _ABOUT[name]} | ({"examples": examples} if examples else {})


def _fields() -> list[Json]:
    return [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": f"Beside a file: {about}",
            "schema": _FIELD_SCHEMAS[name],
            **(_PAIR if _FIELD_SCHEMAS[name]["type"] == "array" else {}),
        }
        for name, about in FIELDS.items()
    ]


def _options() -> list[Json]:
    """The options of a mesh: examples within their schemas, defaults in words.

    Pages on which calls are tried begin with the examples and defaults of parameters, and beside
    JSON these must be empty.
    """
    return [
        _beside_a_file(parameter)
        for parameter in option_parameters()
        # The engine, too, is a parameter, but of addresses.
        if parameter["name"] in MeshOptionFields.model_fields
    ]


def _beside_a_file(parameter: Json) -> Json:
    schema = dict(parameter["schema"])
    about = f"Beside a file: {parameter['description']}"
    if "example" in parameter:
        schema["examples"] = [parameter["example"]]
    if "default" in schema:
        about += f" Left out: {json.dumps(schema.pop('default'))}."
    kept = {key: value for key, value in parameter.items() if key != "example"}
    return kept | {"description": about, "schema": schema}
