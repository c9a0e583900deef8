"""The JSON language of groups: surfaces, and members that place them."""

from collections.abc import Iterable, Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, Field, ValidationInfo, model_validator
from typing_extensions import TypeAliasType

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue, count_nouns, pointer
from service.schemas.arrays import NumberGrid, check_total, tuple_schema
from service.schemas.brep import BrepDefinition, check_faces
from service.schemas.brep_parts import Index
from service.schemas.document import MEMBERS_FACTOR
from service.schemas.fields import (
    Color,
    MetresPerUnit,
    Name,
    Omittable,
    StrictModel,
    UpField,
    conflict_issue,
    one_of_kinds,
    optional,
)
from service.schemas.kinds import KINDS, UNKNOWN_KIND, MemberKind
from service.schemas.validation import limits_of, to_invalid, to_refusal
from service.surface.group import GroupSurface, needs_definitions, nested_issue
from service.surface.member import Member
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

_PATCH = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}


class MemberDefinition(StrictModel):
    """One member of a group: a surface with a name, a base colour and a placement.

    A member has a `surface`, or the number of one as its `definition`. A member with neither is a
    frame for others, such as an assembly.
    """

    surface: Annotated[MemberSurfaceDefinition | None, Omittable()] = optional(
        "The surface, of any kind except `group`.", _PATCH
    )
    definition: Annotated[Index | None, Omittable()] = optional(
        "The number, from 0, of the surface in `definitions`, in place of `surface`.", 0
    )
    parent: Annotated[Index | None, Omittable()] = optional(
        "The number, from 0, of an earlier member. This member is then in the frame of that one: "
        "its matrix is multiplied from the left by the matrices of all members above it, and "
        "without a `color` it has the colour of the nearest of them that has one. At most 100 "
        "levels.",
        0,
    )
    name: Annotated[Name | None, Omittable()] = optional(
        "Name of the member: of its node in glTF, and of its part in other formats, there after "
        "the names of its parents: `machine/bolt`. The default is the name of the surface, or "
        "`assembly` without one.",
        "left wing",
    )
    color: Annotated[Color | None, Omittable()] = optional(
        "Base colour: red, green, blue and, as an optional fourth number, opacity; sRGB, each from "
        "0 to 1.",
        [0.8, 0.2, 0.1],
    )
    matrix: Annotated[FloatArray | None, MATRIX] = Field(
        default=None,
        description="Placement of the surface, and of the members below this one: an affine 4 × 4 "
        "matrix, row by row, that acts on columns (x, y, z, 1). Its last row is 0, 0, 0, 1. It may "
        "mirror, but must not flatten. The default is the identity.",
        examples=[[[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]],
        json_schema_extra=tuple_schema(tuple_schema({"type": "number"}, 4), 4),
    )

    @model_validator(mode="after")
    def _check_surface(self) -> "MemberDefinition":
        if self.surface is not None and self.definition is not None:
            message = "A member has a surface of its own, or names one of the definitions."
            raise to_invalid(conflict_issue("surface", "definition", message, is_neither=False))
        return self

    def to_member(self, surfaces: Sequence[SurfaceKind]) -> Member:
        """The member as a value; raises `InvalidRequest` with pointers relative to the member.

        `surfaces` are the definitions of the group.
        """
        surface: SurfaceKind | None = None
        if self.definition is not None:
            surface = surfaces[self.definition]
        elif self.surface is not None:
            try:
                surface = self.surface.to_surface()
            except InvalidRequest as error:
                raise error.within("/surface") from None
        return Member(surface, self.name, self.color, self.matrix, self.parent, self.definition)


def _limit_members(value: object, info: ValidationInfo) -> object:
    """Refuse a list with too many members, before any of them is read."""
    if isinstance(value, list):
        most = limits_of(info).max_members * MEMBERS_FACTOR
        _check_count(len(value), "members", most)
        _limit_surfaces(
            [item for item in value if isinstance(item, dict) and "surface" in item], info
        )
    return value


def _limit_surfaces(value: object, info: ValidationInfo) -> object:
    """Refuse a list with too many surfaces, before any of them is read."""
    if isinstance(value, list):
        _check_count(len(value), "surfaces", limits_of(info).max_members)
    return value


def _check_count(count: int, nouns: str, limit: int) -> None:
    if count > limit:
        message = f"The group has more {nouns} than this service takes (SURFACE_MAX_MEMBERS)."
        needed = f"1 to {limit}"
        raise to_invalid(Issue("wrong_length", message, "", count_nouns(count, nouns), needed))


class GroupDefinition(StrictModel):
    """Several surfaces in one model, each with a name, a base colour and a placement.

    In glTF every member is a named node, below that of its `parent`, and equal surfaces share one
    mesh. In other formats the group is one mesh, and its parts have the names of the members. If
    the `up` of a surface differs from that of the group, the surface is rotated by a quarter turn
    about x before it is placed; members below it are not.
    """

    type: Literal["group"] = Field(description="The kind of surface.")
    definitions: Annotated[
        tuple[MemberSurfaceDefinition, ...],
        Field(strict=False, fail_fast=True),
        BeforeValidator(_limit_surfaces),
    ] = Field(
        default=(),
        description="Surfaces that members name by their numbers, from 0. If the group has a "
        "`parent`, a member without a surface, or a `brep`, a surface counts once in the limits of "
        "the document, however often it is placed; otherwise it counts for each member.",
        examples=[[_PATCH]],
    )
    members: Annotated[
        tuple[MemberDefinition, ...],
        Field(strict=False, min_length=1, fail_fast=True),
        BeforeValidator(_limit_members),
    ] = Field(
        description="The members. The limit of control points is for all of them together.",
        examples=[[{"surface": _PATCH, "name": "sail", "color": [0.9, 0.8, 0.6]}]],
    )
    metres_per_unit: MetresPerUnit = None
    up: UpField = "y"
    name: Name = Field(
        default="group",
        description="Name of the group, and of the root node of a glTF file.",
        examples=["tea service"],
    )

    @model_validator(mode="after")
    def _check_size(self, info: ValidationInfo) -> "GroupDefinition":
        """Refuse unknown definitions, and surfaces with too many control points or faces."""
        count = len(self.definitions)
        for number, member in enumerate(self.members):
            if member.definition is not None and not 0 <= member.definition < count:
                message = "A member names one of the definitions by its number."
                needed = f"0 to {count - 1}" if count else "`definitions`"
                issue = Issue(
                    "unknown_definition", message, "", f"definition {member.definition}", needed
                )
                raise to_refusal([(("members", number, "definition"), issue)])
        own = [member.surface for member in self.members if member.surface is not None]
        counted: list[BaseModel] = [*self.definitions, *own]
        if not self._has_definitions(own):
            # The stored group has a surface in each member.
            used = [
                self.definitions[m.definition] for m in self.members if m.definition is not None
            ]
            counted = [*used, *own]
        check_total(counted, "/members", info)
        check_faces(counted, "/members", info)
        return self

    def _has_definitions(self, own: Iterable[BaseModel]) -> bool:
        """`GroupSurface.has_definitions` of the group; `own` are the surfaces of members."""
        members = self.members
        return needs_definitions(
            len(members),
            has_parents=any(member.parent is not None for member in members),
            has_frames=any(
                member.definition is None and member.surface is None for member in members
            ),
            has_breps=any(isinstance(each, BrepDefinition) for each in (*own, *self.definitions)),
        )

    def to_surface(self) -> GroupSurface:
        """The group as a value; raises `InvalidRequest` with pointers relative to the group."""
        surfaces: list[SurfaceKind] = []
        for number, definition in enumerate(self.definitions):
            checkpoint()
            try:
                surfaces.append(definition.to_surface())
            except InvalidRequest as error:
                raise error.within(pointer(("definitions", number))) from None
        members = []
        for number, member in enumerate(self.members):
            checkpoint()
            try:
                members.append(member.to_member(surfaces))
            except InvalidRequest as error:
                raise error.within(pointer(("members", number))) from None
        return GroupSurface(tuple(members), self.up, self.name, self.metres_per_unit)
