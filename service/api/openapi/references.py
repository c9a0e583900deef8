"""What every part of the OpenAPI document is made of: JSON, and references among its schemas."""

from typing import Any, TypeAlias

Json: TypeAlias = dict[str, Any]


def ref(name: str) -> Json:
    """Reference to a schema among the components."""
    return {"$ref": f"#/components/schemas/{name}"}
