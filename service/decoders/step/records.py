"""The parser of one record: keywords with nested lists of parameters.

Parameters stay tokens of the text until a value is asked for: most records have more parameters
than a reader needs. `#12` is a reference, `.T.` an enumeration, `'text'` a string, `$` an omitted
and `*` a derived parameter.

References
----------
ISO 10303-21, clauses 7 and 11: tokens, and the mapping of entities.
"""

import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

from service.decoders.step.faults import Fault
from service.decoders.step.strings import decode_string

MAX_NESTING = 32
"""The most lists inside each other."""

MAX_COMMAS = 2_100_000
"""The most commas of a record: a net of a million points with their weights has fewer."""

MAX_NUMBER = 1e12
"""The largest coordinate; larger numbers are damage."""

MAX_NAME = 1000
"""The most characters of a name that are kept."""

_TOKENS = re.compile(r"'[^']*+'(?:'[^']*+')*+|\"[^\"]*+\"|[(),;]|[^\s,()';\"]++|['\"]")
# Most records: a name, at most one list, and parameters without parentheses.
_USUAL = re.compile(
    r"\s*+([A-Za-z_][A-Za-z0-9_]*+)\s*+\(\s*+('[^']*+')\s*+,\s*+(?:\(([^()'\"]*+)\)\s*+(,?)\s*+)?+"
    r"([^()'\"]*+)\)\s*+(?:;|\Z)"
)
_KEYWORD = re.compile(r"!?[A-Za-z_][A-Za-z0-9_]*+")


class Typed(NamedTuple):
    """A parameter with the keyword of its type, such as `LENGTH_MEASURE(25.4)`."""

    keyword: str
    parameters: list[Any]  # of Parameter


Parameter: TypeAlias = str | list[Any] | Typed
"""A token, a list of parameters, or one with the keyword of its type."""


def parse_record(text: str) -> dict[str, list[Parameter]]:
    """The keywords of a record, in capital letters, and the parameters of each.

    A simple record `LINE('',#1,#2);` has one keyword; a complex one, `(A()B('',#1));`, has several,
    in any order. What follows the record is ignored, and a missing semicolon does not matter.

    Raises
    ------
    Fault
        Parentheses do not match, lists are nested too deeply or too long, or there is no keyword.
    """
    if len(text) > MAX_COMMAS and text.count(",") > MAX_COMMAS:
        raise Fault("its lists are too long")
    match = _USUAL.match(text)
    if match is not None:
        keyword, name, listed, comma, rest = match.groups()
        parameters: list[Parameter] = [name]
        if listed is not None:
            parameters.append(_split(listed))
        if listed is None or comma:
            parameters += _split(rest)
        return {keyword.upper(): parameters}
    top = _parse_lists(_TOKENS.findall(text))
    if len(top) == 1:
        (record,) = top
        if isinstance(record, Typed):
            return {record.keyword: record.parameters}
        if isinstance(record, list):
            parts = {part.keyword: part.parameters for part in record if isinstance(part, Typed)}
            if parts:
                return parts
    raise Fault("it is not a record")


def _split(text: str) -> list[Parameter]:
    """Parameters without strings and parentheses; those that are empty are left out."""
    return list(filter(None, "".join(text.split()).split(",")))


def _parse_lists(tokens: list[str]) -> list[Parameter]:
    """The parameters outside all lists, up to the end of the first list."""
    top: list[Parameter] = []
    stack: list[list[Parameter]] = []
    previous = ""
    for token in tokens:
        if token == ",":
            pass
        elif token == "(":
            if len(stack) == MAX_NESTING:
                raise Fault("its lists are nested too deeply")
            items: list[Parameter] = []
            is_typed = _KEYWORD.fullmatch(previous) is not None
            if is_typed:
                top.pop()
            top.append(Typed(previous.upper(), items) if is_typed else items)
            stack.append(top)
            top = items
        elif token == ")" and stack:
            top = stack.pop()
            if not stack:
                break
        elif token in (";", ")"):
            break
        else:
            top.append(token)
        previous = token
    if stack:
        raise Fault("its parentheses do not match")
    return top


def as_reference(parameter: Parameter) -> int:
    """The number of the entity to which a parameter refers."""
    if isinstance(parameter, str) and parameter[:1] == "#":
        try:
            return int(parameter[1:20])
        except ValueError:
            pass
    raise Fault("a parameter is not a reference")


def as_references(parameter: Parameter) -> list[int]:
    """The numbers of the entities in a list."""
    return [as_reference(item) for item in as_list(parameter)]


def as_list(parameter: Parameter) -> list[Parameter]:
    """The items of a list."""
    if isinstance(parameter, list):
        return parameter
    raise Fault("a parameter is not a list")


def as_number(parameter: Parameter) -> float:
    """A finite number, with or without the keyword of its type."""
    if isinstance(parameter, Typed) and len(parameter.parameters) == 1:
        parameter = parameter.parameters[0]
    if isinstance(parameter, str):
        try:
            number = float(parameter)
        except ValueError:
            number = math.nan
        if math.isfinite(number):
            return number
    raise Fault("a parameter is not a number")


def as_numbers(parameter: Parameter) -> list[float]:
    """The finite numbers in a list."""
    try:
        numbers = [float(item) for item in as_list(parameter)]  # type: ignore[arg-type] # checked
    except (TypeError, ValueError):
        return [as_number(item) for item in as_list(parameter)]
    if not all(map(math.isfinite, numbers)):
        raise Fault("a parameter is not a number")
    return numbers


def as_integer(parameter: Parameter) -> int:
    """A whole number."""
    number = as_number(parameter)
    if number != int(number):
        raise Fault("a parameter is not a whole number")
    return int(number)


def as_flag(parameter: Parameter) -> bool:
    """A logical value; an unknown one (`.U.`) counts as true."""
    if isinstance(parameter, str):
        letter = parameter[1:2].upper()
        if letter in ("T", "U"):
            return True
        if letter == "F":
            return False
    raise Fault("a parameter is neither true nor false")


def as_enumeration(parameter: Parameter) -> str:
    """The name of an enumeration, in capital letters without points; empty if it is omitted."""
    if isinstance(parameter, str):
        if parameter[:1] == ".":
            return parameter.strip(".").upper()
        if parameter in ("$", "*"):
            return ""
    raise Fault("a parameter is not an enumeration")


def as_text(parameter: Parameter) -> str:
    """The text of a string; empty for anything else, because a name is never worth an entity."""
    if isinstance(parameter, Typed) and parameter.parameters:
        parameter = parameter.parameters[0]
    if isinstance(parameter, str) and parameter[:1] == "'" and len(parameter) > 1:
        return decode_string(parameter[1:-1][: 12 * MAX_NAME])[:MAX_NAME]
    return ""


def is_omitted(parameter: Parameter) -> bool:
    """Whether a parameter is omitted or derived."""
    return parameter in ("$", "*")


def find_references(parameters: Sequence[Parameter]) -> list[int]:
    """All references among parameters, those in lists included, in order."""
    found: list[int] = []
    pending: list[Parameter] = list(reversed(parameters))
    while pending:
        parameter = pending.pop()
        if isinstance(parameter, Typed):
            pending.extend(reversed(parameter.parameters))
        elif isinstance(parameter, list):
            pending.extend(reversed(parameter))
        elif parameter[:1] == "#":
            found.append(as_reference(parameter))
    return found
