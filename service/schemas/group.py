"""The JSON language of a group of surfaces."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator
from typing_extensions import TypeAliasType

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.errors import InvalidRequest, pointer
from service.schemas.arrays import NumberGrid, check_total, tuple_schema
from service.schemas.fields import Name, Omittable, StrictModel, UpField, one_of_kinds, optional
from service.schemas.kinds import KINDS, UNKNOWN_KIND, MemberKind
from service.schemas.validation import to_invalid
from service.surface.group import MAX_MEMBERS, GroupSurface, Member, nested_issue


def refuse_group(value: object) -> object:
    """Refuse a group that is a member of a group, before its own members are read."""
    if isinstance(value, dict) and value.get("type") == "group":
        raise to_invalid(nested_issue("/type"))
    return value


MATRIX = NumberGrid(("rows", "numbers"))

Share: TypeAlias = Annotated[float, Field(ge=0, le=1)]

Color: TypeAlias = Annotated[
    tuple[Share, ...], Field(strict=False, min_length=3, max_length=4, fail_fast=True)
]

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
        """Refuse members that together have too many control points."""
        check_total([member.surface for member in self.members], "/members", info)
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
