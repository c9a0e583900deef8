"""Converts options from text (in a query, or on a command line) to the values of a JSON body.

A malformed text stays a string, which the model then refuses.

Caches compare URLs letter by letter. So the module also writes the canonical query of a mesh: equal
options give equal texts. The canonical query has the options in the order of their model, without
options that have their default; each number has the fewest digits; `engine` is at the end.
"""

import re
from collections.abc import Callable, Iterable, Set
from math import inf, isfinite
from typing import Annotated, Any, TypeAlias, get_args, get_origin

import numpy as np
from pydantic import BaseModel, Field

from service.bases.arrays import FloatArray
from service.engine.mesh.mesh import ENGINE
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.accuracy import CAMERA_FIELDS, MAX_COUNT
from service.schemas.check import CheckFields
from service.schemas.curves import CurveOptionFields
from service.schemas.fields import Omittable
from service.schemas.options import MeshOptionFields
from service.schemas.pictures import PictureFields
from service.schemas.scan import shorten
from service.schemas.validation import validate_document

_WHOLE = re.compile(r"-?\d{1,16}", re.ASCII)
_NUMBER = re.compile(r"-?\d{1,30}(?:\.\d{1,30})?(?:[eE][-+]?\d{1,3})?", re.ASCII)

MAX_PARAMETERS = 50
"""The most parameters of a query. The service has fewer options."""


Engine: TypeAlias = Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)]
ENGINE_FIELD: Any = Field(
    default=None,
    description="Version of the engine. With this parameter, the URL of a surface whose id is a "
    "hash always returns the same bytes. A service with another version returns 410.",
    examples=[ENGINE],
    json_schema_extra={"enum": [ENGINE]},
)


class MeshQuery(MeshOptionFields):
    """The options of a mesh, and the version of the engine that computes it."""

    engine: Engine = ENGINE_FIELD


class PictureQuery(PictureFields):
    """The options of a picture, and the version of the engine that draws it."""

    engine: Engine = ENGINE_FIELD


def number_from_text(text: str) -> int | float | str:
    """The number that a text contains, as in a JSON body; any other text is returned unchanged."""
    if _WHOLE.fullmatch(text):
        return int(text)
    number = float(text) if _NUMBER.fullmatch(text) else inf
    return number if isfinite(number) else text


def pair_from_text(text: str) -> object:
    """A whole number, or a list of them if the text has commas: one for u and one for v."""
    numbers = [_parse_whole(part) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else numbers


def _parse_whole(text: str) -> int | str:
    return int(text) if _WHOLE.fullmatch(text) else text


def _parse_float(text: str) -> float | str:
    return float(text) if _NUMBER.fullmatch(text) else text


def _parse_flag(text: str) -> bool | str:
    return {"true": True, "false": False}.get(text, text)


def _split_names(text: str) -> list[str]:
    return text.split(",") if text else []


def _split_numbers(text: str) -> list[float | str]:
    return [_parse_float(part) for part in text.split(",")]


def _find_readers(model: type[BaseModel]) -> dict[str, Callable[[str], object]]:
    """For each field of a model, the function that converts its text; not for fields of text."""
    readers_by_type: dict[Any, Callable[[str], object]] = {
        bool: _parse_flag,
        int: _parse_whole,
        float: _parse_float,
    }
    readers: dict[str, Callable[[str], object]] = {}
    for name, field in model.model_fields.items():
        types = get_args(field.annotation)
        if get_origin(field.annotation) is tuple:
            # `tuple[X, ...]` is a list of names, and `tuple[X, X]` is a pair of whole numbers.
            readers[name] = _split_names if types[-1] is ... else pair_from_text
        elif FloatArray in types:
            readers[name] = _split_numbers
        for kind in types or (field.annotation,):
            if name not in readers and kind in readers_by_type:
                readers[name] = readers_by_type[kind]
    return readers


_READERS = {
    name: read
    for model in (CheckFields, CurveOptionFields, PictureFields, MeshQuery)
    for name, read in _find_readers(model).items()
}
# For curves, too, although their resolution is one number: the model of curves refuses a list.
_READERS["resolution"] = pair_from_text

LIST_NAMES = frozenset(
    {
        name
        for name, read in _READERS.items()
        if read in (_split_names, _split_numbers, pair_from_text)
    }
    | {"degree", "knots"}  # of a surface in a file, for which `file_fields` reads the text
)
"""Names of the parameters that may be lists: repeated (`a=1&a=2`), or with commas (`a=1,2`)."""


def parse_mesh_query(pairs: Iterable[tuple[str, str]]) -> MeshQuery:
    """Parse the options of a mesh from the query of a URL, given as pairs (name, text).

    Raises
    ------
    InvalidRequest
        The pointer of each issue is `/` and the name of the parameter.
    """
    return validate_document(MeshQuery, option_values(pairs))


def parse_picture_query(pairs: Iterable[tuple[str, str]]) -> PictureQuery:
    """Parse the options of a picture from the query of a URL, given as pairs (name, text).

    Raises
    ------
    InvalidRequest
        The pointer of each issue is `/` and the name of the parameter.
    """
    return validate_document(PictureQuery, values_from_text(pairs))


def options_from_text(pairs: Iterable[tuple[str, str]]) -> MeshOptionFields:
    """Parse the options of a mesh from flags of a command line, given as pairs (name, text).

    Raises
    ------
    InvalidRequest
        The pointer of each issue is `/` and the name of the option.
    """
    return validate_document(MeshOptionFields, option_values(pairs))


def option_values(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """The values of options of a mesh, from pairs (name, text), for the model to validate.

    Raises
    ------
    InvalidRequest
        The issues of `values_from_text`, and `unknown_field` for the fields of a camera, which only
        bodies can have.
    """
    values = values_from_text(pairs)
    message = "A query cannot have a camera; the body of a POST can."
    got, needed = "a field of bodies", "tolerance or relative_tolerance, or POST /v1/mesh"
    names = [name for name in CAMERA_FIELDS if name in values]
    if issues := [Issue("unknown_field", message, f"/{name}", got, needed) for name in names]:
        raise InvalidRequest(*issues)
    return values


def values_from_text(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """The values of options from pairs (name, text); `LIST_NAMES` says how lists are written.

    Unknown names get their text as value; the model refuses them later.

    Raises
    ------
    InvalidRequest
        `repeated_key`, for a parameter that is no list, or `too_many_parameters`.
    """
    texts: dict[str, list[str]] = {}
    for name, text in pairs:
        if name in texts and name in LIST_NAMES:
            texts[name].append(text)
            continue
        if name in texts:
            raise InvalidRequest(
                Issue(
                    "repeated_key",
                    "A parameter is given more than once.",
                    pointer([shorten(name)]),
                    "the parameter again",
                    "each parameter once",
                )
            )
        if len(texts) == MAX_PARAMETERS:
            raise InvalidRequest(
                Issue(
                    "too_many_parameters",
                    "There are more parameters than any request needs.",
                    pointer([shorten(name)]),
                    f"more than {MAX_PARAMETERS} parameters",
                    f"at most {MAX_PARAMETERS}",
                )
            )
        texts[name] = [text]
    return {name: _READERS.get(name, str)(",".join(parts)) for name, parts in texts.items()}


def canonical_query(
    options: MeshOptionFields | PictureFields, ignored: Set[str] = frozenset()
) -> str:
    """The canonical query of these options, without the options in `ignored`.

    The text needs no escapes in a URL. Options that have their default can be left out: a change of
    a default requires a new number `ENGINE`, so old URLs keep their meaning.
    """
    parts = []
    model = PictureFields if isinstance(options, PictureFields) else MeshOptionFields
    for name, field in model.model_fields.items():
        value = getattr(options, name)
        if isinstance(value, np.ndarray):
            value = tuple(value.tolist())
        if name not in ignored and value != field.get_default(call_default_factory=True):
            parts.append(f"{name}={_write_value(value)}")
    parts.append(f"engine={ENGINE}")
    return "&".join(parts)


def _write_value(value: object) -> str:
    """The shortest text of a value."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return _write_number(value)
        case tuple():
            # If u and v have the same number, one number stands for both.
            is_same = len(value) == 2 and value[0] == value[1]
            return ",".join(map(_write_value, value[:1] if is_same else value))
        case _:
            return str(value)


def _write_number(number: float) -> str:
    """The shortest text of a number, such as 0.5, 2, 1e-5 or 1e20; −0 becomes 0."""
    mantissa, _, exponent = repr(number + 0.0).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa
