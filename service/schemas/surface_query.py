"""The fields of a surface as text, for files that have only control points.

In a query they stand beside the options of a mesh; on a command line they are flags.
"""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from service.errors import InvalidRequest, Issue
from service.schemas.query import option_values, pair_from_text

FIELDS: Mapping[str, str] = MappingProxyType(
    {
        "type": "What the control points are: `bezier` or `bspline` for one net, `patches` for "
        "many.",
        "degree": "Degree of a `bspline`: one number, or one for u and one for v.",
        "knots": "Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and "
        "one for v.",
        "up": "The model's vertical axis, `y` or `z`.",
        "name": "Name of the surface.",
    }
)
"""Descriptions of the fields by name, for the documentation."""


def document_from_query(pairs: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """A request without its control points: options of a mesh, and `surface` with its fields.

    Raises
    ------
    InvalidRequest
        A name is repeated, or is not allowed in a query; pointers are `/` and the name. The model
        checks other names and all values later.
    """
    values = option_values(pairs)
    if "surface" in values:
        message, got = "A query has fields of the surface, one by one.", "all of them as one"
        issue = Issue("unknown_field", message, "/surface", got, ", ".join(FIELDS))
        raise InvalidRequest(issue)
    fields = {name: str(value) for name, value in values.items() if name in FIELDS}
    options = {name: value for name, value in values.items() if name not in FIELDS}
    return {"surface": surface_fields(fields)} | options


def surface_fields(texts: Mapping[str, str]) -> dict[str, object]:
    """Fields of a surface as in a document; malformed texts stay texts, which the model refuses."""
    return {name: _value(name, text) for name, text in texts.items()}


def add_fields(net: dict[str, Any], fields: Mapping[str, object]) -> dict[str, Any]:
    """The surface that a file holds, with these fields; a group's axis is that of its members."""
    if net["type"] == "group" and "up" in fields:
        members = [
            member | {"surface": member["surface"] | {"up": fields["up"]}}
            for member in net["members"]
        ]
        net = net | {"members": members}
    return {**fields, **net}


def _value(name: str, text: str) -> object:
    if name == "degree":
        return pair_from_text(text)
    if name == "knots" and "," in text:
        return text.split(",")
    return text
