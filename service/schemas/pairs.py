"""Something for u and something for v: a list of two, or one value that stands for both."""

from collections.abc import Callable
from typing import Any

from pydantic import BeforeValidator, WithJsonSchema

from service.errors import Issue
from service.schemas.validation import refusal, wrong_type


def list_of_two(value: object, needed: str) -> list[Any]:
    """The value, which must be a list of two; `needed` says what else would have done."""
    if not isinstance(value, list):
        raise refusal([((), wrong_type(value, needed))])
    if len(value) != 2:
        got = f"a list of {len(value)}"
        message = "A list has something for u and something for v."
        raise refusal([((), Issue("wrong_length", message, "", got, "a list of two"))])
    return value


def out_of_range(number: int, least: int, most: int) -> Issue:
    """The issue of a number that is none of `least` to `most`."""
    needed = f"{least} to {most}"
    return Issue("out_of_range", "The number is out of range.", "", str(number), needed)


def one_or_two_numbers(
    least: int, most: int, refused: Callable[[int, int, int], Issue] = out_of_range
) -> BeforeValidator:
    """A whole number from `least` to `most` stands for both directions.

    `refused` makes the issue of another number; those in lists are left to the type of the field.
    """

    def pair(value: object) -> object:
        if type(value) is not int:
            return list_of_two(value, "a whole number or a list of two")
        if not least <= value <= most:
            raise refusal([((), refused(value, least, most))])
        return [value, value]

    return BeforeValidator(pair)


def one_or_two(one: dict[str, Any], each: dict[str, Any] | None = None) -> WithJsonSchema:
    """The JSON Schema of one value for both, or of a list of two, each by itself."""
    two = {"type": "array", "items": each or one, "minItems": 2, "maxItems": 2}
    return WithJsonSchema({"oneOf": [one, two]})


def whole_number(least: int, most: int) -> dict[str, Any]:
    """The JSON Schema of a whole number in a range."""
    return {"type": "integer", "minimum": least, "maximum": most}
