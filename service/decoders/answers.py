"""Checks the answer of a child process, which is no more trusted than the file that it has read.

The values of the document are checked later, as those of a posted document: here only what is
looked at before that. The report of reading goes to the client as it is, so all of it is checked.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from math import isfinite
from types import MappingProxyType
from typing import Any

from service.decoders.cad.content import Reading, SkippedFace
from service.decoders.columns import unpack_brep
from service.decoders.format import Decoded
from service.errors import InvalidRequest, Issue, MalformedBody, SurfaceError, TooLarge

MAX_TEXT = 500
"""The most characters of a text of an issue or of a report."""

_ERRORS: Mapping[str, type[SurfaceError]] = MappingProxyType(
    {each.__name__: each for each in (InvalidRequest, MalformedBody, TooLarge)}
)
"""The errors that an answer may have."""


def parse_decoded(answer: Mapping[str, Any]) -> Decoded:
    """The content of a file from an answer with `tree` and `reading`.

    Raises
    ------
    ValueError, LookupError, TypeError
        The answer is not that of a reader.
    """
    tree, reading = answer["tree"], answer["reading"]
    _check_surface(tree)
    for name in ("definitions", "members"):
        for item in _list_objects(tree.get(name, [])):
            if "surface" in item:
                _check_surface(item["surface"])
            elif "type" in item:
                _check_surface(item)
    tree = unpack_brep(tree)
    if "definitions" in tree:
        tree["definitions"] = list(map(unpack_brep, tree["definitions"]))
    for name, value in _object(reading).items():
        if not _CHECKS[name](value):
            raise ValueError("a report of another form")
    if not {"format", "faces", "skipped_faces"} <= set(reading):
        raise ValueError("an incomplete report")
    return Decoded(tree, reading)


def parse_mesh(answer: Mapping[str, Any]) -> Decoded:
    """The mesh of a file from an answer with `tree`; raises as `parse_decoded`."""
    return Decoded(_object(answer["tree"]))


def parse_error(answer: Mapping[str, Any]) -> SurfaceError:
    """The error of an answer with `error` and `issues`; raises as `parse_decoded`."""
    return _ERRORS[answer["error"]](*map(_parse_issue, answer["issues"]))


def _parse_issue(texts: list[Any]) -> Issue:
    code, message, pointer, got, needed = (str(text)[:MAX_TEXT] for text in texts)
    return Issue(code, message, pointer, got, needed)


def _check_surface(value: Any) -> None:
    if not _is_text(_object(value)["type"]):
        raise ValueError("a surface without a type")


def _object(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError("something else than an object")
    return value


def _list_objects(value: Any) -> list[dict[str, Any]]:
    if not isinstance(value, list):
        raise TypeError("something else than a list")
    return [_object(item) for item in value]


def _is_text(value: object) -> bool:
    return isinstance(value, str) and len(value) <= MAX_TEXT


def _is_count(value: object) -> bool:
    return type(value) is int and value >= 0


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and isfinite(value)  # type: ignore[arg-type]  # a number


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _are_counts(value: object) -> bool:
    return (
        isinstance(value, dict)
        and all(map(_is_text, value))
        and all(map(_is_count, value.values()))
    )


def _are_faces(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_face, value))


def _is_face(value: object) -> bool:
    names = {"entity", "reason"}
    return isinstance(value, dict) and set(value) == names and _are_texts([*value.values()])


_CHECKS_BY_TYPE: Mapping[object, Callable[[object], bool]] = {
    str: _is_text,
    int: _is_count,
    float: _is_number,
    float | None: _is_number,  # what is not known is left out
    tuple[str, ...]: _are_texts,
    dict[str, int]: _are_counts,
    tuple[SkippedFace, ...]: _are_faces,
}

_CHECKS: Mapping[str, Callable[[object], bool]] = MappingProxyType(
    {field.name: _CHECKS_BY_TYPE[field.type] for field in fields(Reading)}
)
"""For each value of a report the function that checks it."""
