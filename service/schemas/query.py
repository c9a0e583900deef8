"""Options as text, in a query or on a command line: strings to the values a body would hold.

What is not of the right form stays a string, and the model refuses it like any other.
"""

import re
from collections.abc import Iterable
from math import inf, isfinite
from types import MappingProxyType

from service.errors import InvalidRequest, Issue, pointer
from service.schemas.accuracy import SEEN
from service.schemas.curve_request import CurveOptionFields
from service.schemas.options import MeshOptionFields
from service.schemas.request import mesh_options
from service.schemas.scan import shortened

_WHOLE = re.compile(r"-?\d{1,16}", re.ASCII)
_NUMBER = re.compile(r"-?\d{1,30}(?:\.\d{1,30})?(?:[eE][-+]?\d{1,3})?", re.ASCII)
_FLAGS = MappingProxyType({"true": True, "false": False})
_FLAG_NAMES = frozenset(
    name
    for model in (MeshOptionFields, CurveOptionFields)
    for name, field in model.model_fields.items()
    if field.annotation is bool
)
_NUMBER_NAMES = frozenset(
    {"crease_angle", "tolerance", "relative_tolerance", "angle_tolerance", "wire_width"}
)
_WHOLE_NAMES = frozenset({"wire_sides", "max_triangles", "max_bytes", "engine"})
_PAIR_NAMES = frozenset({"resolution", "isocurves"})
LIST_NAMES = _PAIR_NAMES | {"overlays"}
"""Options that may be lists."""

MAX_PARAMETERS = 50
"""More than there are options; a query that has more is not worth reading to its end."""


def options_from_text(pairs: Iterable[tuple[str, str]]) -> MeshOptionFields:
    """The options that a query gives.

    Raises
    ------
    InvalidRequest
        With pointers `/name of the option`.
    """
    return mesh_options(option_values(pairs))


def option_values(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """The values of options of a mesh, as `values_from_text`; what only a body has is refused."""
    values = values_from_text(pairs)
    seen = [
        Issue(
            "unknown_field",
            "A camera has no place in a query; the body of a POST has one.",
            pointer([name]),
            "an option of bodies",
            "tolerance or relative_tolerance, or POST /v1/mesh",
        )
        for name in SEEN
        if name in values
    ]
    if seen:
        raise InvalidRequest(*seen)
    return values


def values_from_text(pairs: Iterable[tuple[str, str]]) -> dict[str, object]:
    """Values of options given as (name, text); lists are comma-separated.

    Raises
    ------
    InvalidRequest
        `repeated_key` or `too_many_parameters`. Unknown names are left for the model to refuse.
    """
    values: dict[str, object] = {}
    for name, text in pairs:
        if name in values:
            raise InvalidRequest(
                Issue(
                    "repeated_key",
                    "A parameter is given more than once.",
                    pointer([shortened(name)]),
                    "the parameter again",
                    "each parameter once",
                )
            )
        if len(values) == MAX_PARAMETERS:
            raise InvalidRequest(
                Issue(
                    "too_many_parameters",
                    "There are more parameters than any request needs.",
                    pointer([shortened(name)]),
                    f"more than {MAX_PARAMETERS} parameters",
                    f"at most {MAX_PARAMETERS}",
                )
            )
        values[name] = _value(name, text)
    return values


def _value(name: str, text: str) -> object:
    if name in _PAIR_NAMES:
        return pair_from_text(text)
    if name == "overlays":
        return text.split(",") if text else []
    if name in _WHOLE_NAMES:
        return _whole(text)
    if name in _NUMBER_NAMES:
        return float(text) if _NUMBER.fullmatch(text) else text
    if name in _FLAG_NAMES:
        return _FLAGS.get(text, text)
    return text


def pair_from_text(text: str) -> object:
    """One whole number, or a list of them: one for u and one for v."""
    numbers = [_whole(part) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else numbers


def number_from_text(text: str) -> int | float | str:
    """A number as a body would hold it; what is none stays a string."""
    if _WHOLE.fullmatch(text):
        return int(text)
    number = float(text) if _NUMBER.fullmatch(text) else inf
    return number if isfinite(number) else text


def _whole(text: str) -> int | str:
    return int(text) if _WHOLE.fullmatch(text) else text
