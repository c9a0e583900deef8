"""A group: surfaces with names, colours and placements; equal surfaces are lowered once."""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from hashlib import sha256
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, count_nouns, pointer
from service.surface.checks import Up, check_up
from service.surface.lowered import Color, GroupModel, PlacedModel, SingleModel
from service.surface.placement import check_box, place_box, turn_upright, validate_matrix
from service.surface.sizes import SurfaceKind, SurfaceSize, group_sizes

MAX_MEMBERS = 4096
"""The most members of a group: meshing even a small member takes at least 0.5 ms, a tube 2 ms."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One surface of a group.

    A name that equals the surface's name becomes None; a matrix that is the identity becomes None,
    too. An opacity of 1 is removed from the colour. So equal members have equal values.

    Attributes
    ----------
    surface : SurfaceKind
        Of any kind except a group.
    name : str or None
        Name of its glTF node; None stands for the name of the surface.
    color : tuple of three or four floats, or None
        Base colour: red, green, blue and, unless it is 1, the opacity. sRGB, from 0 to 1.
    matrix : ndarray of float64, shape (4, 4), or None
        Placement in the group: affine, acts on columns. None stands for the identity.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the member.
    """

    surface: SurfaceKind
    name: str | None = None
    color: tuple[float, ...] | None = None
    matrix: FloatArray | None = None

    def __post_init__(self) -> None:
        if isinstance(self.surface, GroupSurface):
            raise InvalidRequest(nested_issue("/surface/type"))
        if self.name == self.surface.name:
            object.__setattr__(self, "name", None)
        if self.color is not None:
            object.__setattr__(self, "color", _validate_color(self.color))
        if self.matrix is not None:
            try:
                matrix = validate_matrix(self.matrix)
            except InvalidRequest as error:
                raise error.within("/matrix") from None
            is_identity = np.array_equal(matrix, np.eye(4))
            object.__setattr__(self, "matrix", None if is_identity else matrix)


@dataclass(frozen=True, eq=False, slots=True)
class GroupSurface(SurfaceKind):
    """Several surfaces in one model.

    If the vertical axes of a member and of the group differ, the member is rotated by a quarter
    turn about x before it is placed. Surfaces that differ only in name and `up` share one lowered
    model, which is computed only once, and stored only once if the format allows it.

    Attributes
    ----------
    members : tuple of Member
        1 to `MAX_MEMBERS`.
    up : "y" or "z"
        The group's vertical axis.
    name : str
        Name of the group.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the group.
    """

    members: tuple[Member, ...]
    up: Up = "y"
    name: str = "group"
    _distinct: tuple[list[SurfaceKind], list[int]] = field(init=False, repr=False)
    _sizes: tuple[SurfaceSize, SurfaceSize] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_up(self.up)
        if not 1 <= len(self.members) <= MAX_MEMBERS:
            raise InvalidRequest(
                Issue(
                    "wrong_length",
                    f"A group has 1 to {MAX_MEMBERS} members.",
                    "/members",
                    count_nouns(len(self.members), "members"),
                    f"1 to {MAX_MEMBERS}",
                )
            )
        for index, member in enumerate(self.members):
            matrix = turn_upright(member.matrix, member.surface.up, self.up)
            where = pointer(("members", index, "matrix"))
            check_box(place_box(member.surface.bounds(), matrix), where, "points placed")
        surfaces, numbers = distinct_surfaces(self.members)
        object.__setattr__(self, "_distinct", (surfaces, numbers))
        sizes = group_sizes(
            [surface.size() for surface in surfaces],
            numbers,
            [member.name or member.surface.name for member in self.members],
            name=self.name,
            is_colored=any(member.color is not None for member in self.members),
        )
        object.__setattr__(self, "_sizes", sizes)

    def size(self) -> SurfaceSize:
        """The size of all members; if members are equal, each of them counts."""
        return self._sizes[0]

    def stored_size(self) -> SurfaceSize:
        """The size of the distinct members; members that are equal count once."""
        return self._sizes[1]

    def lower(self) -> GroupModel:
        """The distinct surfaces, each lowered once, and the placements of their copies."""
        surfaces, numbers = self._distinct
        models: list[SingleModel] = []
        for surface in surfaces:
            model = surface.lower()
            if isinstance(model, GroupModel):
                # Never reached, because `Member` refuses groups; for mypy.
                raise InvalidRequest(nested_issue(""))
            models.append(model)
        members = tuple(
            PlacedModel(
                member.name or member.surface.name,
                number,
                _with_opacity(member.color),
                turn_upright(member.matrix, member.surface.up, self.up),
            )
            for member, number in zip(self.members, numbers, strict=True)
        )
        return GroupModel(self.name, tuple(models), members, self.up)


def nested_issue(where: str) -> Issue:
    """The issue for a group that is a member of a group."""
    return Issue(
        "nested_group",
        "A group holds surfaces, not groups.",
        where,
        "a group",
        "its members, placed by the product of both matrices",
    )


def content_key(value: Any, omitted: tuple[str, ...] = ()) -> Hashable:
    """A key that is equal for two values if and only if they have equal content.

    Two surfaces are compared field by field, arrays by shape, type and numbers, and mappings by
    their entries in order. The fields `omitted` of a surface are not compared.
    """
    if isinstance(value, np.ndarray):
        # Adding 0 turns −0 into 0, so that equal numbers have equal bytes.
        content = np.ascontiguousarray(value + 0)
        return value.shape, value.dtype.str, sha256(content.data).digest()
    if is_dataclass(value):
        names = (f.name for f in fields(value) if f.init and f.name not in omitted)
        return type(value), *(content_key(getattr(value, name)) for name in names)
    if isinstance(value, tuple):
        return tuple(content_key(part) for part in value)
    if isinstance(value, Mapping):
        return tuple((key, content_key(part)) for key, part in value.items())
    return value  # type: ignore[no-any-return]


def distinct_surfaces(members: tuple[Member, ...]) -> tuple[list[SurfaceKind], list[int]]:
    """The distinct surfaces of the members, and for each member the number of its surface."""
    number_of: dict[Hashable, int] = {}
    surfaces: list[SurfaceKind] = []
    numbers = []
    for member in members:
        surface = member.surface
        number = number_of.setdefault(content_key(surface, ("name", "up")), len(surfaces))
        if number == len(surfaces):
            surfaces.append(surface)
        numbers.append(number)
    return surfaces, numbers


def _with_opacity(color: tuple[float, ...] | None) -> Color | None:
    """The colour as four numbers."""
    if color is None:
        return None
    return color[0], color[1], color[2], color[3] if len(color) > 3 else 1.0


def _validate_color(color: tuple[float, ...]) -> tuple[float, ...]:
    """Check a colour; an opacity of 1 is removed."""
    if len(color) not in (3, 4):
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "A colour is red, green, blue and, if it has a fourth number, opacity.",
                "/color",
                count_nouns(len(color), "numbers"),
                "three or four",
            )
        )
    for index, value in enumerate(color):
        if not 0 <= value <= 1:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The numbers of a colour are from 0 (dark) to 1 (full).",
                    f"/color/{index}",
                    f"{value:.6g}",
                    "0 to 1",
                )
            )
    # Adding 0 turns −0 into 0, so that equal colours have equal bytes.
    numbers = tuple(float(value) + 0.0 for value in color)
    return numbers[:3] if numbers[3:] == (1.0,) else numbers
