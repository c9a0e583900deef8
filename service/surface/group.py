"""A group: surfaces with names, colours and places of their own, equal ones lowered once."""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, pointer
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_COORDINATE, Up, check_up
from service.surface.lowered import Color, GroupModel, PatchModel, PlacedModel
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.placement import checked_matrix, placed_bounds, upright
from service.surface.sizes import SurfaceKind, SurfaceSize, group_sizes
from service.surface.sweep_model import SweepModel
from service.surface.triangle import TriangleSurface

if TYPE_CHECKING:
    from service.surface import Surface

MAX_MEMBERS = 4096
"""Surfaces that differ take half a millisecond each, tubes two, however small they are."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One surface of a group.

    What says nothing is kept as None: the surface's own name, an identity, an opacity of 1.

    Attributes
    ----------
    surface : Surface
        Any kind but a group.
    name : str or None
        Name of its glTF node; None takes the surface's own.
    color : tuple of three or four floats, or None
        Base colour: red, green, blue and, if it is not opaque, a fourth, opacity; sRGB, 0 … 1.
    matrix : ndarray of float64, shape (4, 4), or None
        Where it stands in the group: affine, acts on columns. None: where its points are.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the member.
    """

    surface: "Surface"
    name: str | None = None
    color: tuple[float, ...] | None = None
    matrix: FloatArray | None = None

    def __post_init__(self) -> None:
        if isinstance(self.surface, GroupSurface):
            raise InvalidRequest(nested("/surface/type"))
        if self.name == self.surface.name:
            object.__setattr__(self, "name", None)
        if self.color is not None:
            object.__setattr__(self, "color", _checked_color(self.color))
        if self.matrix is not None:
            try:
                matrix = checked_matrix(self.matrix)
            except InvalidRequest as error:
                raise error.within("/matrix") from None
            identity = np.array_equal(matrix, np.eye(4))
            object.__setattr__(self, "matrix", None if identity else matrix)


@dataclass(frozen=True, eq=False, slots=True)
class GroupSurface(SurfaceKind):
    """Surfaces side by side in one model.

    A member whose vertical axis is not the group's is turned upright, by a quarter turn about x,
    before it is placed. Surfaces that differ in nothing but their name and their `up` are one
    model: it is computed once, and stored once where the format allows it.

    Attributes
    ----------
    members : tuple of Member
        1 to `MAX_MEMBERS`.
    up : "y" or "z"
        The group's vertical axis.
    name : str
        Name of the whole.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the group.
    """

    members: tuple[Member, ...]
    up: Up = "y"
    name: str = "group"
    _different: tuple[list["Surface"], list[int]] = field(init=False, repr=False)
    _sizes: tuple[SurfaceSize, SurfaceSize] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_up(self.up)
        if not 1 <= len(self.members) <= MAX_MEMBERS:
            raise InvalidRequest(
                Issue(
                    "wrong_length",
                    "A group has members, and not more than can be told apart.",
                    "/members",
                    f"{len(self.members)} members",
                    f"1 to {MAX_MEMBERS}",
                )
            )
        for index, member in enumerate(self.members):
            _check_place(member, self.up, index)
        surfaces, numbers = unique_values(self.members)
        object.__setattr__(self, "_different", (surfaces, numbers))
        sizes = group_sizes(
            [surface.size() for surface in surfaces],
            numbers,
            [member.name or member.surface.name for member in self.members],
            name=self.name,
            colored=any(member.color is not None for member in self.members),
        )
        object.__setattr__(self, "_sizes", sizes)

    def size(self) -> SurfaceSize:
        """All members, each copy by itself."""
        return self._sizes[0]

    def stored_size(self) -> SurfaceSize:
        """All members, equal ones once."""
        return self._sizes[1]

    def lower(self) -> GroupModel:
        """The different surfaces, each lowered once, and where their copies stand."""
        surfaces, numbers = self._different
        models: list[PatchModel | SweepModel] = []
        for surface in surfaces:
            model = surface.lower()
            if isinstance(model, GroupModel):
                raise InvalidRequest(nested(""))  # refused when the member was born
            models.append(model)
        placed = tuple(
            PlacedModel(
                member.name or member.surface.name,
                number,
                _with_opacity(member.color),
                upright(member.matrix, member.surface.up, self.up),
            )
            for member, number in zip(self.members, numbers, strict=True)
        )
        return GroupModel(self.name, tuple(models), placed, self.up)


def nested(where: str) -> Issue:
    """The issue of a group that is a member of a group."""
    return Issue(
        "nested_group",
        "A group holds surfaces, not groups.",
        where,
        "a group",
        "its members, placed by the product of both matrices",
    )


def content_key(value: Any) -> Hashable:
    """What is equal for equal values and nothing else: of types, numbers and shapes of arrays."""
    if isinstance(value, np.ndarray):
        # −0 and 0 are one number.
        content = np.ascontiguousarray(value + 0)
        return value.shape, value.dtype.str, sha256(content.data).digest()
    if is_dataclass(value):
        parts = (content_key(getattr(value, f.name)) for f in fields(value) if f.init)
        return type(value), *parts
    if isinstance(value, tuple):
        return tuple(content_key(part) for part in value)
    if isinstance(value, Mapping):
        return tuple((key, content_key(part)) for key, part in value.items())
    return value  # type: ignore[no-any-return]


def unique_values(members: tuple[Member, ...]) -> tuple[list["Surface"], list[int]]:
    """The surfaces that are different models, and the number among them of each member's."""
    found: dict[Hashable, int] = {}
    surfaces: list[Surface] = []
    numbers = []
    for member in members:
        surface = member.surface
        number = found.setdefault((type(surface), *_content_of(surface)), len(surfaces))
        if number == len(surfaces):
            surfaces.append(surface)
        numbers.append(number)
    return surfaces, numbers


def _check_place(member: Member, up: Up, index: int) -> None:
    """Refuses a member whose control points would stand beyond float32."""
    matrix = upright(member.matrix, member.surface.up, up)
    low, high = placed_bounds(_bounds(member.surface), matrix)
    furthest = float(max(-low.min(), high.max()))
    if furthest > MAX_COORDINATE:
        raise InvalidRequest(
            Issue(
                "coordinate_too_large",
                "Coordinates are stored in single precision.",
                pointer(("members", index, "matrix")),
                f"points placed as far as {furthest:.6g}",
                f"at most {MAX_COORDINATE:.7g}",
            )
        )


def _bounds(surface: "Surface") -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates that a surface stays within; it need not be lowered."""
    if isinstance(surface, MultipatchSurface):
        lows, highs = zip(*map(_bounds, surface.surfaces), strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)
    if isinstance(surface, PatchSurface):
        points = surface.vertices
    elif isinstance(surface, BezierSurface | BsplineSurface | TriangleSurface):
        points = surface.control_net.reshape(-1, 3)
    else:
        model = surface.lower()
        if isinstance(model, GroupModel):
            raise InvalidRequest(nested(""))  # refused when the member was born
        return model.bounds
    return points.min(axis=0), points.max(axis=0)


def _with_opacity(color: tuple[float, ...] | None) -> Color | None:
    """The colour as four numbers."""
    if color is None:
        return None
    return color[0], color[1], color[2], color[3] if len(color) > 3 else 1.0


def _content_of(surface: "Surface") -> tuple[Hashable, ...]:
    """What makes a surface another one: all but its name and its vertical axis."""
    names = (f.name for f in fields(surface) if f.name not in ("name", "up"))
    return tuple(content_key(getattr(surface, name)) for name in names)


def _checked_color(color: tuple[float, ...]) -> tuple[float, ...]:
    """The colour, without an opacity of 1."""
    if len(color) not in (3, 4):
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "A colour is red, green, blue and, if it has a fourth number, opacity.",
                "/color",
                f"{len(color)} numbers",
                "three or four",
            )
        )
    for index, value in enumerate(color):
        if not 0 <= value <= 1:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "Colours are between black, 0, and full strength, 1.",
                    f"/color/{index}",
                    f"{value:.6g}",
                    "0 to 1",
                )
            )
    # −0 and 0 are one number.
    shares = tuple(float(value) + 0.0 for value in color)
    return shares[:3] if shares[3:] == (1.0,) else shares
