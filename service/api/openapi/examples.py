"""Examples of JSON responses, computed from the examples of requests.

A route's module calls `show_answers` beside the route. Nothing is computed until a document is
asked for.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeVar

import orjson
from pydantic import BaseModel

from service.api.openapi.parameters import Json
from service.schemas.validation import validate_document

Model = TypeVar("Model", bound=BaseModel)

ANSWERS: dict[str, Callable[[], Json]] = {}
"""Functions that compute the examples of JSON responses, by the id of the operation."""


def show_answers(
    operation: str, examples: Json, model: type[Model], answer: Callable[[Model], bytes]
) -> None:
    """Shows the responses to these examples of requests in the OpenAPI document.

    Parameters
    ----------
    operation : str
        Id of the operation.
    examples : dict
        By name: a summary and the value of a request's body.
    model : type
        The model of the body.
    answer : callable
        Computes the JSON response to a body.
    """

    def compute() -> Json:
        return {
            name: {
                "summary": example["summary"],
                "value": orjson.loads(answer(validate_document(model, example["value"]))),
            }
            for name, example in examples.items()
        }

    ANSWERS[operation] = cache(compute)
