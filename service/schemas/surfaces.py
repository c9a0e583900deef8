"""The JSON language of surfaces: the union of all kinds, and surfaces as documents."""

from collections.abc import Iterable
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import Tag
from typing_extensions import TypeAliasType

from service.schemas.bezier import write_rows
from service.schemas.brep_writing import WRITERS
from service.schemas.fields import one_of_kinds
from service.schemas.groups import GroupDefinition
from service.schemas.kinds import CHANNELS, FIELDS, KINDS, UNKNOWN_KIND, MemberKind
from service.surface.brep import BrepSurface
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sizes import SurfaceKind

SurfaceDefinition = TypeAliasType(
    "SurfaceDefinition",
    Annotated[
        MemberKind | Annotated[GroupDefinition, Tag("group")],
        *one_of_kinds(
            KINDS, UNKNOWN_KIND, "A surface: its `type` names the kind; the default is `bezier`."
        ),
    ],
)


_CURVE_FIELDS = MappingProxyType(
    {
        BezierCurve: ("bezier", "control_points", "weights"),
        BsplineCurve: ("bspline", "control_points", "degree", "knots", "weights"),
    }
)
"""For each kind of curve, its name and its fields; of the curve of a surface, `up` and `name` are
not written."""


_SIZED = (np.ndarray, dict, list)
"""Types of fields that are not written if they are empty."""


def definition(
    surface: SurfaceKind, *, flat: bool = False, is_part: bool = False
) -> dict[str, Any]:
    """A surface in the form of a request, with NumPy arrays; omits fields that have no value.

    A triangular net is a list of rows, as in documents; if `flat`, it is one array. The unit of a
    surface that is a part of another one (`is_part`) has no effect, and is omitted.
    """
    kind, *names = FIELDS[type(surface)]
    if is_part:
        names = [name for name in names if name != "metres_per_unit"]
    content = {"type": kind} | _write_fields(surface, (*names, "up", "name"), flat)
    return content if flat else write_rows(content)


def _write_fields(value: object, names: Iterable[str], flat: bool) -> dict[str, Any]:
    """The fields of a value as in documents, without those that have no value."""
    fields = {name: _write(_read_field(value, name), flat) for name in names}
    return {
        name: field
        for name, field in fields.items()
        if field is not None and not (isinstance(field, _SIZED) and not len(field))
    }


def _read_field(value: Any, name: str) -> Any:
    """One field of a surface, of a member of a group, or of a curve."""
    if name == "parts":
        return {part: np.array(numbers, np.int64) for part, numbers in value.parts}
    if name == "attributes":
        return dict(value.channels.attributes)
    if isinstance(value, BrepSurface) and name in WRITERS:
        return WRITERS[name](value)
    if isinstance(value, GroupSurface):
        if name == "definitions":
            return value.definitions
        if name == "members" and value.has_definitions:
            return _number_members(value)
    return getattr(value.channels if name in CHANNELS else value, name)


def _number_members(group: GroupSurface) -> list[dict[str, Any]]:
    """The members of a group with definitions, by the numbers of these."""
    number_of = {id(surface): number for number, surface in enumerate(group.definitions)}
    members = []
    for member in group.members:
        fields = {
            "name": member.name,
            "definition": None if member.surface is None else number_of[id(member.surface)],
            "parent": member.parent,
            "color": None if member.color is None else list(member.color),
            "matrix": member.matrix,
        }
        members.append({name: field for name, field in fields.items() if field is not None})
    return members


def _write(value: object, flat: bool) -> object:
    """A value as in documents."""
    if isinstance(value, tuple):
        return [_write(item, flat) for item in value]
    if isinstance(value, SurfaceKind):
        return definition(value, flat=flat, is_part=True)
    if isinstance(value, Member):
        return _write_fields(value, ("surface", "name", "color", "matrix"), flat)
    if isinstance(value, BezierCurve | BsplineCurve):
        kind, *names = _CURVE_FIELDS[type(value)]
        return {"type": kind} | _write_fields(value, names, flat)
    return value
