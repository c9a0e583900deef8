"""Fields of a surface that stand beside a file: in the query of a URL, or in flags of a command.

A file of control points has only these points, so the other fields of its surface are texts beside
it. A CAD file has whole parts: beside it stand a name, the vertical axis, and what happens to
invalid faces.
"""

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from service.errors import InvalidRequest, Issue, MalformedJson
from service.schemas.document import parse_document
from service.schemas.query import option_values, pair_from_text

FIELDS: Mapping[str, str] = MappingProxyType(
    {
        "type": "The kind of surface: `bezier` or `bspline` for one net, `patches` for many.",
        "degree": "Degree of a `bspline`: one number, or one for u and one for v.",
        "knots": "Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and "
        "one for v.",
        "homogeneous": "Whether points of four numbers in an array of NumPy are homogeneous, "
        "[w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight].",
        "up": "The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`.",
        "name": "Name of the surface. A CAD file has names of its own; this is that of the whole.",
        "invalid_faces": "Whether an invalid face of a CAD file is left out and listed in the "
        "report (`skip`, the default), or refuses the file (`refuse`).",
    }
)
"""Descriptions of the fields by name, for the documentation."""

_TRUTH_VALUES = MappingProxyType({"true": True, "false": False})

OPERATIONS = "operations"
"""The field of a conversion that a query has as JSON."""


def document_from_query(pairs: Iterable[tuple[str, str]], known: Sequence[str]) -> dict[str, Any]:
    """The body of a request without its surface, which is a file, from the parameters of a query.

    The fields of the surface are in `surface`; the other parameters, which should be options of
    the call, are beside it. The model checks unknown names and all values later.

    Parameters
    ----------
    known : sequence of str
        Those of `FIELDS` that this format of files takes (`Decoder.fields`).

    Raises
    ------
    InvalidRequest
        A name is repeated, or is not allowed in a query or beside this kind of file; the pointer is
        `/` and the name.
    """
    values = option_values(pairs)
    if "surface" in values:
        message, got = "A query has fields of the surface, one by one.", "all of them as one"
        raise InvalidRequest(Issue("unknown_field", message, "/surface", got, ", ".join(FIELDS)))
    # These values are texts already: no option of a call has the name of one of these fields.
    fields = {name: str(value) for name, value in values.items() if name in FIELDS}
    check_fields(fields, known)
    others = {name: value for name, value in values.items() if name not in FIELDS}
    if OPERATIONS in others:
        others[OPERATIONS] = parse_operations(str(others[OPERATIONS]))
    return {"surface": surface_fields(fields)} | others


def parse_operations(text: str) -> object:
    """The operations of a conversion in a query, from their JSON.

    Raises
    ------
    InvalidRequest
        The text is not JSON; the pointer is `/operations`.
    """
    try:
        return parse_document(text.encode("utf-8", "replace"))
    except (MalformedJson, InvalidRequest) as error:
        raise InvalidRequest(*error.issues).within(f"/{OPERATIONS}") from None


def check_fields(names: Iterable[str], known: Sequence[str]) -> None:
    """Refuse fields of a surface that a file does not take; `known` as in `document_from_query`.

    Raises
    ------
    InvalidRequest
        `unknown_field`; the pointer is `/` and the name.
    """
    needed = "one of " + ", ".join(known)
    issues = [
        Issue("unknown_field", *_explain(name), needed) for name in names if name not in known
    ]
    if issues:
        raise InvalidRequest(*issues)


def _explain(name: str) -> tuple[str, str, str]:
    """Message, pointer and got of the issue for a field that a file does not take."""
    message = "This file says itself what its surfaces are; this field is for control nets."
    got = "a field for files of control points"
    if name == "homogeneous":
        message = "Other files than arrays of NumPy say themselves what the numbers of a point are."
        got = "a field for .npy files"
    elif name == "invalid_faces":
        message = "Only a CAD file has faces that may be invalid; this file has whole surfaces."
        got = "a field for CAD files"
    return message, f"/{name}", got


def surface_fields(texts: Mapping[str, str]) -> dict[str, object]:
    """The fields of a surface as a document has them, from texts by name.

    A malformed text stays a text, which the model refuses later.
    """
    return {name: _parse_value(name, text) for name, text in texts.items()}


def add_fields(
    surface: dict[str, Any], fields: Mapping[str, object], *, is_cad: bool = False
) -> dict[str, Any]:
    """The surface of a file, with these fields in addition.

    A file of control points keeps the fields that it has. If it is a group, `up`, which no such
    file has, is set for its members too. The fields beside a CAD file replace what the file says:
    `up` and `invalid_faces` in every brep, so that none is turned, and `name` of the whole.
    """
    if is_cad:
        return _replace_fields(surface, fields)
    if fields.get("homogeneous") is True and "weights" in surface:
        surface = _join_weights(surface)
    if surface["type"] == "group" and "up" in fields:
        members = [
            member | {"surface": member["surface"] | {"up": fields["up"]}}
            for member in surface["members"]
        ]
        surface = surface | {"members": members}
    return {**fields, **surface}


def _join_weights(surface: dict[str, Any]) -> dict[str, Any]:
    """The surface of an array whose fourth numbers were read as weights, as homogeneous points."""
    name = "vertices" if surface["type"] == "patches" else "control_net"
    points = np.concatenate([surface[name], surface["weights"][..., np.newaxis]], axis=-1)
    return {key: value for key, value in surface.items() if key != "weights"} | {name: points}


def _replace_fields(surface: dict[str, Any], fields: Mapping[str, object]) -> dict[str, Any]:
    own = {name: value for name, value in fields.items() if name != "invalid_faces"}
    inner = {name: value for name, value in fields.items() if name != "name"}
    if surface["type"] != "group":
        return surface | dict(fields)
    changed = surface | own
    if inner:
        changed |= {
            key: [_replace_in(item, inner) for item in surface[key]]
            for key in ("definitions", "members")
            if key in surface
        }
    return changed


def _replace_in(item: dict[str, Any], fields: Mapping[str, object]) -> dict[str, Any]:
    """A definition, or a member with or without a surface of its own, with these fields."""
    if "surface" in item:
        return item | {"surface": _set(item["surface"], fields)}
    return _set(item, fields) if "type" in item else item


def _set(surface: dict[str, Any], fields: Mapping[str, object]) -> dict[str, Any]:
    """A surface with those of the fields that its kind has: only breps have invalid faces."""
    is_brep = surface["type"] == "brep"
    return surface | {
        name: value for name, value in fields.items() if is_brep or name != "invalid_faces"
    }


def _parse_value(name: str, text: str) -> object:
    if name == "degree":
        return pair_from_text(text)
    if name == "homogeneous":
        return _TRUTH_VALUES.get(text, text)
    return text.split(",") if name == "knots" and "," in text else text
