"""The OpenAPI document: every call, every media type, every error, with examples that are true.

Routes read the raw request, so nothing could be derived from their signatures. The language comes
from the pydantic models, formats and ids from their registries, and the examples of meshes and
errors from the code that makes them.
"""

from functools import cache
from typing import Any

from service import __version__
from service.api.openapi_examples import REQUESTS, meshes
from service.api.openapi_problems import responses, status_of
from service.api.openapi_schemas import Json, option_parameters, ref, schemas
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, FORMATS
from service.surface.examples import EXAMPLES

_DESCRIPTION = """\
Parametric surfaces in, meshes out: post a control net, get vertices and faces.

A request carries a surface and, beside it, the options of its mesh. Built-in examples answer by
URL, with the same options as query parameters. `GET` calls answer `HEAD` as well.

Errors are problems (RFC 9457) with a stable `code` and, for each thing that is wrong, a JSON
pointer into the body or the name of a parameter, what was got and what was needed. The input is
never repeated. A request that would cost too much is refused before anything is computed.
"""

_TAGS = [
    {"name": "meshes", "description": "Surfaces to meshes."},
    {"name": "catalogue", "description": "What there is to ask for."},
    {"name": "operations", "description": "Whether the service is well."},
]

_EXAMPLE = {
    "name": "example",
    "in": "path",
    "required": True,
    "description": "Id of a built-in surface.",
    "schema": {"type": "string", "enum": list(EXAMPLES)},
    "example": "utah-teapot",
}


@cache
def document() -> Json:
    """The whole document, OpenAPI 3.1."""
    return {
        "openapi": "3.1.0",
        "info": {"title": "Surface Service", "version": __version__, "description": _DESCRIPTION},
        "tags": _TAGS,
        "paths": _paths(),
        "components": {"schemas": schemas(), "responses": responses(), "examples": meshes()},
    }


def _paths() -> Json:
    return {
        "/v1/mesh": {"post": _post_mesh()},
        "/v1/surfaces": {
            "get": _get(
                "listSurfaces", "catalogue", "The built-in surfaces", "SurfaceList", "InvalidQuery"
            )
        },
        "/v1/surfaces/{example}": {
            "get": _get(
                "getSurface",
                "catalogue",
                "The definition of a built-in surface, as a body for `POST /v1/mesh`",
                "SurfaceDocument",
                "UnknownSurface",
                "InvalidQuery",
            )
            | {"parameters": [_EXAMPLE]}
        },
        "/v1/surfaces/{example}/mesh.{suffix}": {"get": _get_mesh()},
        "/v1/formats": {
            "get": _get(
                "listFormats", "catalogue", "The formats written here", "FormatList", "InvalidQuery"
            )
        },
        "/health": {
            "get": _get("getHealth", "operations", "State and versions, for people", "Health")
        },
        "/health/live": {
            "get": _get("getLiveness", "operations", "200 as long as the process works", "Health")
        },
        "/health/ready": {"get": _ready()},
    }


def _post_mesh() -> Json:
    return {
        "operationId": "createMesh",
        "tags": ["meshes"],
        "summary": "The mesh of a surface",
        "description": "Evaluates the surface and answers in the format that `Accept` prefers, or "
        "that `format` names; JSON if neither says anything.",
        "parameters": [
            {
                "name": "format",
                "in": "query",
                "required": False,
                "description": "Format of the answer, stronger than `Accept`.",
                "schema": {"type": "string", "enum": list(BY_NAME)},
                "example": "glb",
            }
        ],
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": ref("MeshRequest"), "examples": REQUESTS}},
        },
        "responses": {
            "200": _mesh_response(),
            **_problems(
                "MalformedJson",
                "NotAcceptable",
                "BodyTooSlow",
                "BodyTooLarge",
                "UnsupportedMediaType",
                "InvalidRequest",
                "InternalError",
            ),
        },
    }


def _get_mesh() -> Json:
    suffix = {
        "name": "suffix",
        "in": "path",
        "required": True,
        "description": "Suffix of the format of the answer; `Accept` is not read.",
        "schema": {"type": "string", "enum": [f.suffix for f in FORMATS]},
        "example": "glb",
    }
    return {
        "operationId": "getSurfaceMesh",
        "tags": ["meshes"],
        "summary": "The mesh of a built-in surface",
        "description": "For programs that fetch meshes by URL.",
        "parameters": [_EXAMPLE, suffix, *option_parameters()],
        "responses": {
            "200": _mesh_response(),
            **_problems("UnknownSurface", "InvalidQuery", "InternalError"),
        },
    }


def _mesh_response() -> Json:
    return {
        "description": "The mesh.",
        "headers": {
            "Content-Disposition": {
                "description": "A name to save the file under; not with JSON.",
                "schema": {"type": "string"},
            }
        },
        "content": {f.media_type: _mesh_content(f) for f in FORMATS},
    }


def _mesh_content(fmt: Format) -> Json:
    if fmt.name == "json":
        examples = {name: {"$ref": f"#/components/examples/{name}"} for name in meshes()}
        return {"schema": ref("Mesh"), "examples": examples}
    return {"schema": {"description": f"{fmt.title}."}}


def _get(operation: str, tag: str, summary: str, answer: str, *errors: str) -> Json:
    return {
        "operationId": operation,
        "tags": [tag],
        "summary": summary,
        "responses": {
            "200": {
                "description": f"{summary}.",
                "content": {"application/json": {"schema": ref(answer)}},
            },
            **_problems(*errors, "InternalError"),
        },
    }


def _ready() -> Json:
    operation = _get(
        "getReadiness", "operations", "200 as long as new requests are welcome", "Health"
    )
    operation["responses"]["503"] = {
        "description": "The service is about to stop.",
        "content": {"application/json": {"schema": ref("Health")}},
    }
    return operation


def _problems(*names: str) -> dict[str, Any]:
    """References to error answers, by status."""
    return {status_of(name): {"$ref": f"#/components/responses/{name}"} for name in names}
