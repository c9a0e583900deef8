"""Turns the flags of operations into the values that a JSON body would have.

A malformed number stays a string, which the model of the request then refuses.
"""

from collections.abc import Iterable
from typing import Any

from service.errors import InvalidRequest, Issue, MalformedJson

OPERATIONS_FLAG = "operations"
"""The flag whose text is a JSON list of operations."""


def operations_from_text(arguments: Iterable[tuple[str, str]]) -> tuple[list[str], list[Any]]:
    """The flag of each operation, and the operations.

    Parameters
    ----------
    arguments : iterable of (str, str)
        The name of each flag, and its text.

    Raises
    ------
    InvalidRequest
        A text is not a JSON list, or a name is repeated.
    """
    flags: list[str] = []
    operations: list[Any] = []
    for name, text in arguments:
        parsed = _parse_list(text) if name == OPERATIONS_FLAG else [_parse_operation(name, text)]
        operations += parsed
        flags += [name] * len(parsed)
    return flags, operations


def _parse_operation(name: str, text: str) -> dict[str, object]:
    from service.schemas.query import number_from_text

    fields: dict[str, object] = {}
    match name:
        case "elevate":
            degrees = _parse_numbers(text, ",")
            fields = {"degree": degrees[0] if len(degrees) == 1 else degrees}
        case "split" if "=" in text:
            fields = {key: number_from_text(value) for key, value in _parse_pairs(name, text)}
        case "split":
            fields = {"at": _parse_numbers(text, ",")}
        case "restrict":
            fields = {key: _parse_numbers(value, ":") for key, value in _parse_pairs(name, text)}
        case "reverse":
            fields = {"direction": text}
        case "triangle":
            fields = {"half": text}
    return {"op": name} | fields


def _parse_numbers(text: str, separator: str) -> list[int | float | str]:
    from service.schemas.query import number_from_text

    return [number_from_text(part) for part in text.split(separator)]


def _parse_pairs(flag: str, text: str) -> list[tuple[str, str]]:
    """Names and values of "u=…,v=…"; refuses a repeated name."""
    parts = [part.partition("=") for part in text.split(",")]
    names = {key for key, _, _ in parts}
    if len(names) < len(parts):
        raise InvalidRequest(
            Issue(
                "repeated_key",
                "A name is repeated.",
                f"--{flag}",
                "the name again",
                "each name once",
            )
        )
    return [(key, value) for key, _, value in parts]


def _parse_list(text: str) -> list[Any]:
    from service.schemas.document import parse_document

    try:
        value = parse_document(text.encode())
    except (MalformedJson, UnicodeEncodeError):
        value = None
    except InvalidRequest as error:
        raise error.within(f"--{OPERATIONS_FLAG}") from None
    if not isinstance(value, list):
        raise InvalidRequest(
            Issue(
                "wrong_type",
                "This must be a JSON list of operations.",
                "--operations",
                "something else",
                '[{"op": …}, …]',
            )
        )
    return value
