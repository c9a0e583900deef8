"""Validates documents, and translates pydantic's errors to issues of this service.

An issue has a code, a pointer, and texts that say what the service got and what it needed. Of the
input it repeats only numbers, and in the pointer the keys, shortened.
"""

from collections.abc import Iterable, Sized
from dataclasses import replace
from itertools import islice
from typing import Any, TypeAlias, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError, ValidationInfo
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from service.errors import MAX_ISSUES, InvalidRequest, Issue, format_number, pointer
from service.schemas.conventions import explain
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits, parse_document
from service.schemas.field_names import nearest_field
from service.schemas.scan import shorten

Path: TypeAlias = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)

UNIONS = frozenset({"surface", "curve", "mesh"})
"""Fields whose value is one of several models. After such a field, pydantic's paths have an
additional item, the name of the chosen model, which a JSON pointer must not have."""

LISTS_OF_UNIONS = frozenset({"definitions", "operations", "surfaces", "pcurves"})
"""Fields whose value is a list, in which each item is one of several models."""

MAX_INDEX = 2**53
"""The largest index in absolute value. JSON readers represent whole numbers exactly up to it."""

_KINDS = {
    type(None): "null",
    bool: "true or false",
    str: "a string",
    int: "a whole number",
    float: "a number with a fraction or an exponent",
    list: "a list",
    np.ndarray: "a list",
}
"""For each Python type of a JSON value, the text of `kind`."""

_WRONG_TYPE = {
    "bool_type": "true or false",
    "dict_type": "an object",
    "float_type": "a number",
    "int_from_float": "a whole number",
    "int_type": "a whole number",
    "model_attributes_type": "an object",
    "model_type": "an object",
    "string_type": "a string",
    "tuple_type": "a list",
}
"""For each of pydantic's types of error about a wrong type: the type that is needed."""

# Code, message and text of what the service got, for `_TRANSLATIONS`.
_SMALL = ("out_of_range", "The number is too small.", "{number}")
_LARGE = ("out_of_range", "The number is too large.", "{number}")
_SHORT = ("wrong_length", "The list or string is too short.", "a length of {length}")
_LONG = ("wrong_length", "The list or string is too long.", "a length of {length}")

_TRANSLATIONS = {
    "missing": ("missing_field", "A required field is missing.", "nothing", "a value"),
    "extra_forbidden": (
        "unknown_field",
        "No field has this name.",
        "{kind}",
        "a documented name",
    ),
    "literal_error": (
        "wrong_value",
        "The value is not one of those allowed.",
        "{kind}",
        "{expected}",
    ),
    "greater_than_equal": (*_SMALL, "at least {ge:.6g}"),
    "greater_than": (*_SMALL, "above {gt:.6g}"),
    "less_than": (*_LARGE, "below {lt:.6g}"),
    "less_than_equal": (*_LARGE, "at most {le:.6g}"),
    "string_too_short": (*_SHORT, "a length of at least {min_length}"),
    "too_short": (*_SHORT, "a length of at least {min_length}"),
    "string_too_long": (*_LONG, "a length of at most {max_length}"),
    "too_long": (*_LONG, "a length of at most {max_length}"),
    "string_pattern_mismatch": (
        "wrong_value",
        "A name has no control characters.",
        "{kind}",
        "printable characters",
    ),
}
"""For each of pydantic's types of error: the code, the message, and the texts of got and needed."""


def to_invalid(issue: Issue) -> PydanticCustomError:
    """An exception for a validator to raise, with one issue, which its context contains.

    The issue's pointer is relative to the value that the validator checks.
    """
    return PydanticCustomError("issue", "{message}", {"issue": issue, "message": issue.message})


def to_refusal(faults: Iterable[tuple[Path, Issue]]) -> ValidationError:
    """An exception for a validator to raise, with several issues, each at a path of its own.

    Only the first `MAX_ISSUES` faults are read.
    """
    details: list[InitErrorDetails] = [
        {"type": to_invalid(issue), "loc": path, "input": None}
        for path, issue in islice(faults, MAX_ISSUES)
    ]
    return ValidationError.from_exception_data("value", details)


def parse_request(model: type[Model], body: bytes, limits: DocumentLimits) -> Model:
    """Parse the JSON text of a request, and validate it as a `model`.

    Raises
    ------
    MalformedJson
        If the text is not one JSON document in UTF-8.
    InvalidRequest
        With JSON pointers into the document.
    """
    return validate_document(model, parse_document(body, limits.max_depth), limits)


def validate_document(
    model: type[Model], document: object, limits: DocumentLimits = DEFAULT_LIMITS
) -> Model:
    """Validate a document of dict, list, str, numbers and arrays as a `model`.

    Raises
    ------
    InvalidRequest
        With JSON pointers into the document.
    """
    try:
        return model.model_validate(document, context=limits)
    except ValidationError as error:
        refused = invalid_request(error, model)

    def is_valid(request: dict[str, Any]) -> bool:
        """Whether the fields of a request have no error; further ones may be missing."""
        try:
            build = getattr(model.model_validate(request, context=limits), "build", bool)
            build()
        except InvalidRequest:
            return False
        except ValidationError as error:
            return not any(
                each["loc"][:1] == (name,) for each in error.errors() for name in request
            )
        return True

    raise InvalidRequest(*explain(document, refused.issues, is_valid))


def limits_of(info: ValidationInfo) -> DocumentLimits:
    """The limits with which `validate_document` was called."""
    return info.context if isinstance(info.context, DocumentLimits) else DEFAULT_LIMITS


def invalid_request(error: ValidationError, model: type[BaseModel] = BaseModel) -> InvalidRequest:
    """The errors that pydantic found in a document of this model, as issues of this service."""
    details = [d for d in error.errors(include_url=False) if not _is_consequence(d)]
    return InvalidRequest(*(_issue(detail, model) for detail in details[:MAX_ISSUES]))


def _is_consequence(detail: ErrorDetails) -> bool:
    """Whether the error only follows from others: pydantic does not count invalid items of a list.

    So if a list has enough items, but too few valid ones, pydantic also reports it as too short.
    """
    value = detail["input"]
    is_short = detail["type"] == "too_short" and isinstance(value, Sized)
    return is_short and len(value) >= detail["ctx"]["min_length"]


def kind(value: object) -> str:
    """The kind of a JSON value as a text for clients, which does not contain the value."""
    return _KINDS.get(type(value), "an object")


def wrong_type(value: object, needed: str) -> Issue:
    """The issue for a value of the wrong type.

    Null is always wrong: to get the default of a field, a client omits the field.
    """
    if value is None:
        return Issue("null_value", "This field cannot be null.", got="null", needed=needed)
    return Issue("wrong_type", f"This must be {needed}.", got=kind(value), needed=needed)


def index_too_large() -> Issue:
    """The issue for an index above `MAX_INDEX`."""
    return Issue(
        "index_out_of_range", "No list is that long.", got="a number beyond 2^53", needed="an index"
    )


def empty_list(needed: str) -> Issue:
    """The issue for an empty list."""
    return Issue("empty_list", "The list is empty.", got="an empty list", needed=needed)


def ragged_triangle(got: str, needed: str) -> Issue:
    """The issue for rows that do not form a triangle."""
    return Issue(
        "ragged",
        "The rows of a triangle shorten by one: n + 1 rows have n + 1, n, … 1 entries.",
        got=got,
        needed=needed,
    )


def _issue(detail: ErrorDetails, model: type[BaseModel]) -> Issue:
    """The issue for one detail of a pydantic error, with a pointer into the document."""
    context: dict[str, Any] = detail.get("ctx", {})
    issue = context.get("issue")
    if not isinstance(issue, Issue):
        issue = _translate(detail["type"], detail["input"], context)
    if detail["type"] == "extra_forbidden" and (nearest := nearest_field(model, detail["loc"])):
        issue = replace(issue, needed=f"`{nearest}`, or another documented name")
    return replace(issue, pointer=_pointer(detail["loc"]) + issue.pointer)


def _translate(name: str, value: object, context: dict[str, Any]) -> Issue:
    """The issue for one of pydantic's own error types."""
    if name in _WRONG_TYPE or (value is None and name not in ("missing", "extra_forbidden")):
        return wrong_type(value, _WRONG_TYPE.get(name, "a value, or the field left out"))
    other_error = ("wrong_value", "The value is not allowed.", "{kind}", "")
    code, message, got, needed = _TRANSLATIONS.get(name, other_error)
    return Issue(
        code,
        message,
        "",
        got.format(
            number=format_number(value) if isinstance(value, int | float) else "",
            kind=kind(value),
            length=len(value) if isinstance(value, str | list | dict) else 0,
        ),
        needed.format(**context),
    )


def _pointer(path: Path) -> str:
    """The JSON pointer for a path of pydantic; the names of models in the path are omitted."""
    pointer_items: list[str | int] = []
    item_before_last: str | int | None = None
    last_item: str | int | None = None
    for item in path:
        is_after_union = last_item in UNIONS or (
            item_before_last in LISTS_OF_UNIONS and isinstance(last_item, int)
        )
        if is_after_union and isinstance(item, str):  # the name of a model
            item_before_last = last_item = None
            continue
        item_before_last, last_item = last_item, item
        if item != "[key]":  # pydantic adds this if the error is in the key, not in its value
            pointer_items.append(item if isinstance(item, int) else shorten(item))
    return pointer(pointer_items)
