"""What the operations of the OpenAPI document have in common."""

from typing import Any

from service.api.openapi.problems import status_of
from service.api.openapi.schemas import Json, ref
from service.encoders.format import FileFormat


def get_operation(operation: str, tag: str, summary: str, answer: str, *errors: str) -> Json:
    """A GET that answers JSON."""
    return {
        "operationId": operation,
        "tags": [tag],
        "summary": summary,
        "responses": {
            "200": {
                "description": f"{summary}.",
                "content": {"application/json": {"schema": ref(answer)}},
            },
            **problems(*errors, "InternalError"),
        },
    }


_BINARY = frozenset({"glb", "stl", "ply"})


def file_schema(fmt: FileFormat) -> Json:
    """What an answer in a format other than our JSON is: an object, a text or bytes."""
    about: Json = {"description": f"{fmt.title}."}
    if fmt.media_type.endswith("json"):
        return about | {"type": "object", "additionalProperties": True}
    return about | {"type": "string"} | ({"format": "binary"} if fmt.name in _BINARY else {})


def problems(*names: str) -> dict[str, Any]:
    """References to error answers, by status."""
    return {status_of(name): {"$ref": f"#/components/responses/{name}"} for name in names}
