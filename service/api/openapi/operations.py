"""What the operations of the OpenAPI document have in common."""

from typing import Any

from service.api.openapi.problems import status_of
from service.api.openapi.schemas import Json, ref


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


def problems(*names: str) -> dict[str, Any]:
    """References to error answers, by status."""
    return {status_of(name): {"$ref": f"#/components/responses/{name}"} for name in names}
