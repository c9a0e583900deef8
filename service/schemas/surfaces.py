"""The JSON language of surfaces: the union of all models, and surfaces as documents."""

from collections.abc import Iterable
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import Tag
from typing_extensions import TypeAliasType

from service.schemas.fields import one_of_kinds
from service.schemas.group import GroupDefinition
from service.schemas.kinds import CHANNELS, FIELDS, KINDS, UNKNOWN_KIND, MemberKind
from service.schemas.triangle import write_rows
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.group import Member
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


def definition(surface: SurfaceKind, *, flat: bool = False) -> dict[str, Any]:
    """A surface in the form of a request, with NumPy arrays; omits fields that have no value.

    A triangular net is a list of rows, as in documents; if `flat`, it is one array.
    """
    kind, *names = FIELDS[type(surface)]
    content = {"type": kind} | _write_fields(surface, (*names, "up", "name"), flat)
    return content if flat else write_rows(content)


def _write_fields(value: object, names: Iterable[str], flat: bool) -> dict[str, Any]:
    """The fields of a value as in documents, without those that have no value."""
    fields = {name: _write(_read_field(value, name), flat) for name in names}
    return {
        name: field
        for name, field in fields.items()
        if field is not None and not (isinstance(field, np.ndarray | dict) and not len(field))
    }


def _read_field(value: Any, name: str) -> Any:
    """One field of a surface, of a member of a group, or of a curve."""
    if name == "parts":
        return {part: np.array(numbers, np.int64) for part, numbers in value.parts}
    if name == "attributes":
        return dict(value.channels.attributes)
    return getattr(value.channels if name in CHANNELS else value, name)


def _write(value: object, flat: bool) -> object:
    """A value as in documents."""
    if isinstance(value, tuple):
        return [_write(item, flat) for item in value]
    if isinstance(value, SurfaceKind):
        return definition(value, flat=flat)
    if isinstance(value, Member):
        return _write_fields(value, ("surface", "name", "color", "matrix"), flat)
    if isinstance(value, BezierCurve | BsplineCurve):
        kind, *names = _CURVE_FIELDS[type(value)]
        return {"type": kind} | _write_fields(value, names, flat)
    return value
