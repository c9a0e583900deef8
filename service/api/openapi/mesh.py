"""The operations that answer meshes, in the OpenAPI document."""

from service.api.answers import BOUND_HEADER
from service.api.openapi.examples import REQUESTS, meshes
from service.api.openapi.operations import file_answer, file_schema, post_operation, problems
from service.api.openapi.schemas import Json, option_parameters, ref
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.surface.examples import EXAMPLES

EXAMPLE_PARAMETER = {
    "name": "example",
    "in": "path",
    "required": True,
    "description": "Id of a built-in surface.",
    "schema": {"type": "string", "enum": list(EXAMPLES)},
    "example": "utah-teapot",
}


def post_mesh() -> Json:
    """POST /v1/mesh."""
    return post_operation(
        "createMesh",
        "meshes",
        "The mesh of a surface",
        "Evaluates the surface and answers in the format that `Accept` prefers, or that `format` "
        "names; JSON if neither says anything.",
        request=("MeshRequest", REQUESTS),
        answer=_mesh_response(),
        formats=FORMATS,
    )


def get_mesh() -> Json:
    """GET /v1/surfaces/{example}/mesh.{suffix}."""
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
        "parameters": [EXAMPLE_PARAMETER, suffix, *option_parameters()],
        "responses": {
            "200": _mesh_response(),
            **problems("UnknownSurface", "InvalidQuery", "InternalError"),
        },
    }


def _mesh_response() -> Json:
    answer = file_answer("The mesh.", {f.media_type: _mesh_content(f) for f in FORMATS})
    answer["headers"][BOUND_HEADER] = {
        "description": "The `deviation_bound` of the report, in model units, for formats that have "
        "no place for a report; OBJ and PLY have it in a comment, too. Not with the exact patches, "
        "and not where nothing is certified.",
        "schema": {"type": "number", "minimum": 0},
    }
    return answer


def _mesh_content(fmt: Format) -> Json:
    if fmt.name == "json":
        examples = {name: {"$ref": f"#/components/examples/{name}"} for name in meshes()}
        return {"schema": ref("Mesh"), "examples": examples}
    return {"schema": file_schema(fmt)}
