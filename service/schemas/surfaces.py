"""The JSON language of surfaces: groups, the union of all kinds, and surfaces as documents."""

from collections.abc import Iterable
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, Tag, ValidationInfo, model_validator
from typing_extensions import TypeAliasType

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.errors import InvalidRequest, pointer
from service.schemas.arrays import NumberGrid, check_total, tuple_schema
from service.schemas.bezier import write_rows
from service.schemas.brep import check_faces
from service.schemas.brep_writing import WRITERS
from service.schemas.fields import (
    Color,
    Name,
    Omittable,
    StrictModel,
    UpField,
    one_of_kinds,
    optional,
)
from service.schemas.kinds import CHANNELS, FIELDS, KINDS, UNKNOWN_KIND, MemberKind
from service.schemas.validation import to_invalid
from service.surface.brep import BrepSurface
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.group import MAX_MEMBERS, GroupSurface, Member, nested_issue
from service.surface.sizes import SurfaceKind


def refuse_group(value: object) -> object:
    """Refuse a group that is a member of a group, before its own members are read."""
    if isinstance(value, dict) and value.get("type") == "group":
        raise to_invalid(nested_issue("/type"))
    return value


MATRIX = NumberGrid(("rows", "numbers"))

MemberSurfaceDefinition = TypeAliasType(
    "MemberSurfaceDefinition",
    Annotated[
        MemberKind,
        # `KINDS` has `group` too: it is a known name, and `refuse_group` has an error of its own.
        *one_of_kinds(KINDS, UNKNOWN_KIND, "A surface in a group: any but a group."),
        BeforeValidator(refuse_group),
    ],
)


class MemberDefinition(StrictModel):
    """One surface of a group, with its name, its base colour and its placement."""

    surface: MemberSurfaceDefinition = Field(
        description="The surface, of any kind except `group`.",
        examples=[{"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}],
    )
    name: Annotated[Name | None, Omittable()] = optional(
        "Name of the member: of its node in glTF, and of its part in other formats. The default is "
        "the name of the surface.",
        "left wing",
    )
    color: Annotated[Color | None, Omittable()] = optional(
        "Base colour: red, green, blue and, as an optional fourth number, opacity; sRGB, each from "
        "0 to 1.",
        [0.8, 0.2, 0.1],
    )
    matrix: Annotated[FloatArray | None, MATRIX] = Field(
        default=None,
        description="Placement of the surface: an affine 4 × 4 matrix, row by row, that acts on "
        "columns (x, y, z, 1). Its last row is 0, 0, 0, 1. It may mirror the surface, but must not "
        "flatten it. The default is the identity.",
        examples=[[[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]],
        json_schema_extra=tuple_schema(tuple_schema({"type": "number"}, 4), 4),
    )

    def to_member(self) -> Member:
        """The member as a value; raises `InvalidRequest` with pointers relative to the member."""
        try:
            surface = self.surface.to_surface()
        except InvalidRequest as error:
            raise error.within("/surface") from None
        return Member(surface, self.name, self.color, self.matrix)


class GroupDefinition(StrictModel):
    """Several surfaces in one model, each with a name, a base colour and a placement.

    In glTF every member is a named node, and equal surfaces share one mesh. In other formats the
    group is one mesh, and its parts have the names of the members. If the `up` of a surface differs
    from that of the group, the surface is rotated by a quarter turn about x before it is placed.
    """

    type: Literal["group"] = Field(description="The kind of surface.")
    members: Annotated[
        tuple[MemberDefinition, ...],
        Field(strict=False, min_length=1, max_length=MAX_MEMBERS, fail_fast=True),
    ] = Field(
        description="The surfaces. The limit of control points is for all of them together.",
        examples=[
            [
                {
                    "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]},
                    "name": "sail",
                    "color": [0.9, 0.8, 0.6],
                }
            ]
        ],
    )
    up: UpField = "y"
    name: Name = Field(
        default="group",
        description="Name of the group, and of the root node of a glTF file.",
        examples=["tea service"],
    )

    @model_validator(mode="after")
    def _check_size(self, info: ValidationInfo) -> "GroupDefinition":
        """Refuse members that together have too many control points or faces."""
        surfaces = [member.surface for member in self.members]
        check_total(surfaces, "/members", info)
        check_faces(surfaces, "/members", info)
        return self

    def to_surface(self) -> GroupSurface:
        """The group as a value; raises `InvalidRequest` with pointers relative to the group."""
        members = []
        for index, definition in enumerate(self.members):
            checkpoint()
            try:
                members.append(definition.to_member())
            except InvalidRequest as error:
                raise error.within(pointer(("members", index))) from None
        return GroupSurface(tuple(members), self.up, self.name)


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
