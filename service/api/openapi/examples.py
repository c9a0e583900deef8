"""Examples of JSON responses, computed from the examples of requests.

A route's module calls `show_responses` beside the route. The examples are computed when the
document is built, not before.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeVar

import orjson
from pydantic import BaseModel

from service.api.openapi.parameters import Json
from service.schemas.validation import validate_document

Model = TypeVar("Model", bound=BaseModel)

EXAMPLE_RESPONSES: dict[str, Callable[[], Json]] = {}
"""Functions that compute the examples of JSON responses, by the id of the operation."""


def show_responses(
    operation: str, examples: Json, model: type[Model], respond: Callable[[Model], bytes]
) -> None:
    """Adds the responses to these examples of requests to the OpenAPI document.

    Parameters
    ----------
    operation : str
        Id of the operation.
    examples : dict
        For each name a summary and the value of a request's body.
    model : type
        The model of the body.
    respond : callable
        Computes the JSON response to a body.
    """

    def compute() -> Json:
        return {
            name: {
                "summary": example["summary"],
                "value": orjson.loads(respond(validate_document(model, example["value"]))),
            }
            for name, example in examples.items()
        }

    EXAMPLE_RESPONSES[operation] = cache(compute)
