"""The operations that answer meshes, in the OpenAPI document."""

from service.api.answers import BOUND_HEADER
from service.api.openapi.bodies import with_files
from service.api.openapi.examples import REQUESTS, meshes
from service.api.openapi.headers import (
    ACCEPT_ENCODING,
    COUNT_HEADERS,
    IF_NONE_MATCH,
    SERVER_TIMING,
    URL_HEADERS,
    unchanged_headers,
)
from service.api.openapi.operations import file_answer, file_schema, post_operation, problems
from service.api.openapi.references import Json, ref
from service.api.openapi.requests import option_parameters
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.surface.examples import EXAMPLES

ID_PARAMETER = {
    "name": "id",
    "in": "path",
    "required": True,
    "description": "Id of a surface: the name of a built-in one, or what storing it answered.",
    "schema": {
        "anyOf": [
            {"type": "string", "enum": list(EXAMPLES)},
            {"type": "string", "pattern": "^[0-9a-f]{64}$"},
        ],
    },
    "example": "utah-teapot",
}


def post_mesh() -> Json:
    """POST /v1/mesh."""
    operation = post_operation(
        "createMesh",
        "meshes",
        "The mesh of a surface",
        "Evaluates the surface and answers in the format that `Accept` prefers, or that `format` "
        "names; JSON if neither says anything. The body is a JSON document with the options in it, "
        "or a file of control points with the options in the query.",
        request=("MeshRequest", REQUESTS),
        answer=_mesh_response(),
        formats=FORMATS,
    )
    return with_files(operation, options=True)


def get_mesh() -> Json:
    """GET /v1/surfaces/{id}/mesh.{suffix}."""
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
        "summary": "The mesh of a surface, by URL",
        "description": _BY_URL,
        "parameters": [ID_PARAMETER, suffix, *option_parameters(), IF_NONE_MATCH, ACCEPT_ENCODING],
        "responses": {
            "200": _with_headers(_mesh_response(), URL_HEADERS),
            "304": _with_headers({"description": _UNCHANGED}, unchanged_headers()),
            **problems(
                "UnknownSurface",
                "CodingNotAcceptable",
                "EngineGone",
                "InvalidQuery",
                "Busy",
                "DamagedObject",
                "Unavailable",
            ),
        },
    }


_BY_URL = """\
For browsers, and for everything between them and this service that keeps answers. An address is a
pure function of its parts: the same mesh comes from every service with the same version of the
numbers. Processors and libraries of another kind may round the last digit of a number differently;
then the tag is another, too. `Link` names the canonical spelling of the address: options in one
order, without defaults, `engine` at the end. Under that address the mesh of a surface whose id is a
hash may be kept for ever; all others for an hour, after which `ETag` tells whether they changed.

Equal requests that come together are computed once. Answers are kept in memory, compressed as well.
"""

_UNCHANGED = (
    "The client has the mesh already: `If-None-Match` lists the tag of an answer that it takes."
)


def _mesh_response() -> Json:
    answer = file_answer("The mesh.", {f.media_type: _mesh_content(f) for f in FORMATS})
    answer["headers"] |= COUNT_HEADERS
    answer["headers"][BOUND_HEADER] = {
        "description": "The `deviation_bound` of the report, in model units, for formats that have "
        "no place for a report; OBJ and PLY have it in a comment, too. Not with the exact patches, "
        "and not where nothing is certified.",
        "schema": {"type": "number", "minimum": 0},
        "example": 0.0005,
    }
    answer["headers"]["Server-Timing"] = SERVER_TIMING
    return answer


def _with_headers(answer: Json, headers: Json) -> Json:
    return answer | {"headers": answer.get("headers", {}) | headers}


def _mesh_content(fmt: Format) -> Json:
    if fmt.name == "json":
        examples = {name: {"$ref": f"#/components/examples/{name}"} for name in meshes()}
        return {"schema": ref("Mesh"), "examples": examples}
    return {"schema": file_schema(fmt)}
