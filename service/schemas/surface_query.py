"""Fields of a surface as text, for uploaded files that have only control points.

In a query, these fields are parameters, together with the options of a mesh. On a command line they
are flags.
"""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from service.errors import InvalidRequest, Issue
from service.schemas.query import option_values, pair_from_text

FIELDS: Mapping[str, str] = MappingProxyType(
    {
        "type": "The kind of surface: `bezier` or `bspline` for one net, `patches` for many.",
        "degree": "Degree of a `bspline`: one number, or one for u and one for v.",
        "knots": "Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and "
        "one for v.",
        "up": "The model's vertical axis, `y` or `z`.",
        "name": "Name of the surface.",
    }
)
"""Descriptions of the fields by name, for the documentation."""


def document_from_query(pairs: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """The body of a request without its control points, from the parameters of a query.

    The fields of the surface are in `surface`; the other parameters, which should be options of a
    mesh, are beside it. The model checks unknown names and all values later.

    Raises
    ------
    InvalidRequest
        A name is repeated, or is not allowed in a query; the pointer is `/` and the name.
    """
    values = option_values(pairs)
    if "surface" in values:
        message, got = "A query has fields of the surface, one by one.", "all of them as one"
        issue = Issue("unknown_field", message, "/surface", got, ", ".join(FIELDS))
        raise InvalidRequest(issue)
    # These values are texts already: no option of a mesh has the name of one of these fields.
    fields = {name: str(value) for name, value in values.items() if name in FIELDS}
    options = {name: value for name, value in values.items() if name not in FIELDS}
    return {"surface": surface_fields(fields)} | options


def surface_fields(texts: Mapping[str, str]) -> dict[str, object]:
    """The fields of a surface as a document has them, from texts by name.

    A malformed text stays a text, which the model refuses later.
    """
    return {name: _parse_value(name, text) for name, text in texts.items()}


def add_fields(surface: dict[str, Any], fields: Mapping[str, object]) -> dict[str, Any]:
    """The surface of a file, with these fields in addition; a field that the file has is kept.

    If the surface is a group, the field `up`, which no file has, is set for its members, too.
    """
    if surface["type"] == "group" and "up" in fields:
        members = [
            member | {"surface": member["surface"] | {"up": fields["up"]}}
            for member in surface["members"]
        ]
        surface = surface | {"members": members}
    return {**fields, **surface}


def _parse_value(name: str, text: str) -> object:
    if name == "degree":
        return pair_from_text(text)
    if name == "knots" and "," in text:
        return text.split(",")
    return text
