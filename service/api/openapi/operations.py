"""What the operations of the OpenAPI document have in common."""

from collections.abc import Sequence
from typing import Any

from service.api.openapi.problems import status_of
from service.api.openapi.references import Json, ref
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


def post_operation(
    operation: str,
    tag: str,
    summary: str,
    description: str,
    *,
    request: tuple[str, Json],
    answer: Json,
    formats: Sequence[FileFormat] = (),
) -> Json:
    """A POST of a JSON document.

    Parameters
    ----------
    request : (schema, examples)
    answer : dict
        The response 200.
    formats : sequence of FileFormat
        What the answer may be written in, where there is a choice.
    """
    schema, examples = request
    negotiated = ("NotAcceptable",) if formats else ()
    named = format_parameter(formats, "Format of the answer, stronger than `Accept`.")
    return {
        "operationId": operation,
        "tags": [tag],
        "summary": summary,
        "description": description,
        **({"parameters": [named]} if formats else {}),
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": ref(schema), "examples": examples}},
        },
        "responses": {
            "200": answer,
            **problems("MalformedJson", *negotiated, *_BODY_PROBLEMS),
        },
    }


_BODY_PROBLEMS = (
    "BodyTooSlow",
    "BodyTooLarge",
    "UnsupportedMediaType",
    "InvalidRequest",
    "Busy",
    "InternalError",
    "OutOfTime",
)


def format_parameter(formats: Sequence[FileFormat], description: str) -> Json:
    """The format that a query may name."""
    return {
        "name": "format",
        "in": "query",
        "required": False,
        "description": description,
        "schema": {"type": "string", "enum": [fmt.name for fmt in formats]},
        "example": "glb",
    }


def file_answer(description: str, content: Json) -> Json:
    """An answer that is a file, by media type."""
    return {
        "description": description,
        "headers": {
            "Content-Disposition": {
                "description": "A name to save the file under; not with JSON.",
                "schema": {"type": "string"},
            }
        },
        "content": content,
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
