"""Converts options from text, in a query or on a command line, to the values of a JSON body.

A malformed text stays a string, which the model then refuses.

Caches compare URLs letter by letter. So all queries that mean the same mesh have one canonical
text: the options in the order of their model, defaults left out, each number in its fewest digits,
`engine` at the end. Reading that text gives the options back.
"""

import re
from collections.abc import Callable, Iterable, Set
from math import inf, isfinite
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, Field

from service.engine.mesh.report import ENGINE
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.accuracy import MAX_COUNT, SEEN
from service.schemas.curves import CurveOptionFields
from service.schemas.fields import Omittable
from service.schemas.options import MeshOptionFields
from service.schemas.scan import shorten
from service.schemas.validation import validate_document

_WHOLE = re.compile(r"-?\d{1,16}", re.ASCII)
_NUMBER = re.compile(r"-?\d{1,30}(?:\.\d{1,30})?(?:[eE][-+]?\d{1,3})?", re.ASCII)

MAX_PARAMETERS = 50
"""The service has fewer options than this; it does not read a longer query to its end."""


class MeshQuery(MeshOptionFields):
    """The options of a mesh, and the version of the numbers."""

    engine: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = Field(
        default=None,
        description="Version of the numbers. With it the URL of a surface whose id is a hash "
        "stands for the same mesh for ever. A service with another version returns 410.",
        examples=[ENGINE],
        json_schema_extra={"enum": [ENGINE]},
    )


def number_from_text(text: str) -> int | float | str:
    """A number as in a JSON body; a text that is not a number stays a string."""
    if _WHOLE.fullmatch(text):
        return int(text)
    number = float(text) if _NUMBER.fullmatch(text) else inf
    return number if isfinite(number) else text


def pair_from_text(text: str) -> object:
    """One whole number, or a list of them: one for u and one for v."""
    numbers = [_parse_whole(part) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else numbers


def _parse_whole(text: str) -> int | str:
    return int(text) if _WHOLE.fullmatch(text) else text


def _parse_float(text: str) -> float | str:
    return float(text) if _NUMBER.fullmatch(text) else text


def _flag(text: str) -> bool | str:
    return {"true": True, "false": False}.get(text, text)


def _names(text: str) -> list[str]:
    return text.split(",") if text else []


def _readers(model: type[BaseModel]) -> dict[str, Callable[[str], object]]:
    """The functions that read the text of each field, by name; fields that are texts need none."""
    simple: dict[Any, Callable[[str], object]] = {
        bool: _flag,
        int: _parse_whole,
        float: _parse_float,
    }
    readers: dict[str, Callable[[str], object]] = {}
    for name, field in model.model_fields.items():
        types = get_args(field.annotation)
        if get_origin(field.annotation) is tuple:
            readers[name] = _names if types[-1] is ... else pair_from_text
        for kind in types or (field.annotation,):
            if name not in readers and kind in simple:
                readers[name] = simple[kind]
    return readers


_READERS = _readers(CurveOptionFields) | _readers(MeshQuery)
_READERS["resolution"] = pair_from_text  # also of curves: their model refuses a list

LIST_NAMES = frozenset(name for name, read in _READERS.items() if read in (_names, pair_from_text))
"""Options that may be lists."""


def parse_mesh_query(pairs: Iterable[tuple[str, str]]) -> MeshQuery:
    """The options of a mesh in the query of a URL.

    Raises
    ------
    InvalidRequest
        Pointers are `/` and the name of the parameter.
    """
    return validate_document(MeshQuery, option_values(pairs))


def options_from_text(pairs: Iterable[tuple[str, str]]) -> MeshOptionFields:
    """The options that a command line gives; raises `InvalidRequest` as `parse_mesh_query` does."""
    return validate_document(MeshOptionFields, option_values(pairs))


def option_values(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """The values of options of a mesh, as `values_from_text`; refuses fields of bodies."""
    values = values_from_text(pairs)
    message = "A query cannot have a camera; the body of a POST can."
    got, needed = "a field of bodies", "tolerance or relative_tolerance, or POST /v1/mesh"
    names = [name for name in SEEN if name in values]
    if issues := [Issue("unknown_field", message, f"/{name}", got, needed) for name in names]:
        raise InvalidRequest(*issues)
    return values


def values_from_text(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """Values of options given as (name, text); lists are comma-separated.

    Raises
    ------
    InvalidRequest
        `repeated_key` or `too_many_parameters`. The model refuses unknown names later.
    """
    values: dict[str, object] = {}
    for name, text in pairs:
        if name in values:
            where = pointer([shorten(name)])
            message = "A parameter is given more than once."
            got, needed = "the parameter again", "each parameter once"
            raise InvalidRequest(Issue("repeated_key", message, where, got, needed))
        if len(values) == MAX_PARAMETERS:
            where = pointer([shorten(name)])
            message = "There are more parameters than any request needs."
            got, needed = f"more than {MAX_PARAMETERS} parameters", f"at most {MAX_PARAMETERS}"
            raise InvalidRequest(Issue("too_many_parameters", message, where, got, needed))
        values[name] = _READERS.get(name, str)(text)
    return values


def canonical_query(options: MeshOptionFields, ignored: Set[str] = frozenset()) -> str:
    """The canonical text of these options, without those that `ignored` names.

    It needs no escapes in a URL. Defaults may be left out, because a new default would raise
    `ENGINE`: it changes the mesh of a URL.
    """
    parts = []
    for name, field in MeshOptionFields.model_fields.items():
        value = getattr(options, name)
        if name not in ignored and value != field.get_default(call_default_factory=True):
            parts.append(f"{name}={_text(value)}")
    parts.append(f"engine={ENGINE}")
    return "&".join(parts)


def _text(value: object) -> str:
    """A value in its fewest letters."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return _digits(value)
        case tuple():
            # One number stands for both directions.
            return ",".join(map(_text, value[:1] if len(set(value)) == 1 else value))
        case _:
            return str(value)


def _digits(number: float) -> str:
    """The fewest digits that give the same number: 0.5, 2, 1e-5, 1e20; zero has no sign."""
    mantissa, _, exponent = repr(number + 0.0).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa
