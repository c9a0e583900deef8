"""Validates every JSON example of a document by the models of datamodel-code-generator.

This program runs in the environment of the generators; its folder has the generated module
`models`. The argument is the OpenAPI document. It prints the number of examples, and one line for
each that its model refuses.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import models
from pydantic import TypeAdapter, ValidationError

DOCUMENT = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
SCHEMAS = DOCUMENT["components"]["schemas"]


def find_model(schema: dict[str, Any]) -> Any:
    """The model of a schema that refers to a component."""
    return getattr(models, schema["$ref"].rpartition("/")[2])


def list_bodies() -> Iterator[tuple[str, dict[str, Any]]]:
    """The JSON of each request and each response, with its place."""
    for path, item in DOCUMENT["paths"].items():
        for method, operation in item.items():
            bodies = {"request": operation.get("requestBody", {}), **operation["responses"]}
            for name, body in bodies.items():
                yield f"{method} {path} {name}", body
    yield from DOCUMENT["components"]["responses"].items()


def list_examples() -> Iterator[tuple[str, Any, Any]]:
    """Place, model and value of each example: of bodies, and of the properties of schemas."""
    for place, body in list_bodies():
        for media_type, content in body.get("content", {}).items():
            if "json" in media_type and "$ref" in content.get("schema", {}):
                for name, example in content.get("examples", {}).items():
                    yield f"{place} {name}", find_model(content["schema"]), example["value"]
    for name, schema in SCHEMAS.items():
        for example in schema.get("examples", ()):
            yield name, getattr(models, name), example
        for key, field in schema.get("properties", {}).items():
            for example in field.get("examples", ()):
                yield f"{name}.{key}", find_field(name, key), example


def find_field(name: str, key: str) -> Any:
    """The type of a property, with its limits; fields have aliases for names such as `from`."""
    for field, info in getattr(models, name).model_fields.items():
        if key in (field, info.alias):
            return info.rebuild_annotation()
    raise KeyError(f"{name}.{key}")


count = 0
for place, model, value in list_examples():
    count += 1
    try:
        TypeAdapter(model).validate_json(json.dumps(value))
    except ValidationError as error:
        print(place, error.errors()[0])
print(count)
