"""A group: surfaces with names, colours and placements; equal surfaces are lowered once."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.errors import InvalidRequest, Issue, pointer
from service.surface.brep import BrepSurface
from service.surface.checks import MAX_COORDINATE, Up, check_metres_per_unit, check_up
from service.surface.content_key import find_keys, number_equal
from service.surface.frames import Frames, find_depths, multiply_frames
from service.surface.lowered import Color, GroupModel, GroupNode, PlacedModel, SingleModel
from service.surface.member import Member
from service.surface.placement import (
    check_box,
    place_boxes,
    turn_matrices,
    turn_upright,
)
from service.surface.sizes import SurfaceKind, SurfaceSize, group_sizes

MAX_MEMBERS = 4096
"""The most members of a group that has neither parents nor breps: with more, equal surfaces are
stored once (`GroupSurface.has_definitions`)."""

MAX_PATH_BYTES = 32 << 20
"""The most bytes of the paths of all members together."""

_MODEL_FIELDS = ("name", "up", "metres_per_unit")
"""Fields of surfaces that do not change their lowered models, except for the names in these."""


@dataclass(frozen=True, eq=False, slots=True)
class GroupSurface(SurfaceKind):
    """Several surfaces in one model.

    If the vertical axes of a member and of the group differ, the surface of the member is rotated
    by a quarter turn about x before it is placed; the frame of the member is not, so the members
    below it do not change. Surfaces that differ only in name and `up` share one lowered model,
    which is computed only once, and stored only once if the format allows it.

    Attributes
    ----------
    members : tuple of Member
        At least one, of which at least one has a surface. If `has_definitions`, equal surfaces are
        one object.
    up : "y" or "z"
        The group's vertical axis.
    name : str
        Name of the group.
    metres_per_unit : float or None
        The unit of the coordinates; None if it is not known.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the group.
    """

    members: tuple[Member, ...]
    up: Up = "y"
    name: str = "group"
    metres_per_unit: float | None = None
    _distinct: tuple[list[SurfaceKind], list[int]] = field(init=False, repr=False)
    _frames: Frames | None = field(init=False, repr=False)
    _placements: FloatArray = field(init=False, repr=False)
    _sizes: tuple[SurfaceSize, SurfaceSize, SurfaceSize] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_field = partial(object.__setattr__, self)
        check_up(self.up)
        check_metres_per_unit(self.metres_per_unit)
        self._check_members()
        parents = [member.parent for member in self.members]
        depths = find_depths(parents)
        keys = find_keys(self._surfaces(), _MODEL_FIELDS)
        if self.has_definitions:
            set_field("members", _unite_surfaces(self.members, keys))
        numbers = number_equal(keys)
        surfaces = dict(zip(reversed(numbers), reversed(self._surfaces()), strict=True))
        set_field("_distinct", ([surfaces[number] for number in sorted(surfaces)], numbers))
        matrices = [member.matrix for member in self.members]
        # Without parents the matrix of a member is its frame.
        frames = multiply_frames(matrices, parents, depths) if depths.any() else None
        set_field("_frames", frames)
        set_field("_placements", self._place())
        self._check_boxes()
        set_field("_sizes", self._count())

    @property
    def has_definitions(self) -> bool:
        """Whether the stored group has each distinct surface once, among its `definitions`."""
        members = self.members
        return needs_definitions(
            len(members),
            has_parents=any(member.parent is not None for member in members),
            has_frames=any(member.surface is None for member in members),
            has_breps=any(isinstance(member.surface, BrepSurface) for member in members),
        )

    @property
    def unit(self) -> float | None:
        """Metres in one unit of the coordinates; None if this is not known."""
        return self.metres_per_unit

    @property
    def definitions(self) -> tuple[SurfaceKind, ...]:
        """The distinct surfaces in the order of first use; none unless `has_definitions`."""
        if not self.has_definitions:
            return ()
        return tuple({id(surface): surface for surface in self._surfaces()}.values())

    def size(self) -> SurfaceSize:
        """The size of all members; if members are equal, each of them counts."""
        return self._sizes[0]

    def stored_size(self) -> SurfaceSize:
        """The size of the distinct members; members that are equal count once."""
        return self._sizes[1]

    def written_size(self) -> SurfaceSize:
        """The size of a document; each surface counts once if it has definitions."""
        return self._sizes[2] if self.has_definitions else self._sizes[0]

    def exact_patches(self) -> "GroupSurface":
        """The group with tubes as patches; pointers of errors lead to the member or definition."""
        exact: dict[int, SurfaceKind] = {}
        for member, number in self._placed():
            surface = member.surface
            if surface is None or id(surface) in exact:
                continue
            try:
                exact[id(surface)] = surface.exact_patches()
            except InvalidRequest as error:
                where = pointer(("members", number, "surface"))
                if member.definition is not None:
                    where = pointer(("definitions", member.definition))
                raise error.within(where) from None
        if all(exact[id(surface)] is surface for surface in self._surfaces()):
            return self
        members = tuple(
            each if each.surface is None else replace(each, surface=exact[id(each.surface)])
            for each in self.members
        )
        return replace(self, members=members)

    def lower(self) -> GroupModel:
        """The distinct surfaces, each lowered once, and the placements of their copies."""
        surfaces, numbers = self._distinct
        models: list[SingleModel] = []
        for surface in surfaces:
            model = surface.lower()
            if isinstance(model, GroupModel):
                raise InvalidRequest(nested_issue(""))  # never reached: `_check_members`
            models.append(model)
        paths, colors = self._inherit()
        matrices, is_moved = self._placements, self._find_moved().tolist()
        members = []
        for place, (_, number) in enumerate(self._placed()):
            frames = self._frames
            chain = None
            if frames is not None and frames.levels[number] > 1:
                chain = (
                    frames.levels.item(number),
                    frames.stretches.item(number),
                    frames.reaches.item(number),
                )
            members.append(
                PlacedModel(
                    paths[number],
                    numbers[place],
                    colors[number],
                    matrices[place] if is_moved[place] else None,
                    chain,
                )
            )
        return GroupModel(
            self.name,
            tuple(models),
            tuple(members),
            self.up,
            self._list_nodes(),
            tuple(number for _, number in self._placed()),
            tuple(member.definition for member, _ in self._placed()),
        )

    def _placed(self) -> Iterator[tuple[Member, int]]:
        """The members with a surface, and their numbers."""
        return (
            (member, number)
            for number, member in enumerate(self.members)
            if member.surface is not None
        )

    def _surfaces(self) -> list[SurfaceKind]:
        """The surfaces of the members that have one."""
        return [member.surface for member in self.members if member.surface is not None]

    def _check_members(self) -> None:
        """Refuse a group without surfaces, and groups in groups."""
        surfaces = self._surfaces()
        if not surfaces:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "At least one member of a group has a surface, or names a definition.",
                    "/members/0/surface" if self.members else "/members",
                    "no surface",
                    "a surface in one of the members",
                )
            )
        for member, number in self._placed():
            if isinstance(member.surface, GroupSurface):
                raise InvalidRequest(nested_issue(pointer(("members", number, "surface", "type"))))

    def _place(self) -> FloatArray:
        """The placements of all surfaces, (N, 4, 4): frames after the turns to the group's axis."""
        placed = list(self._placed())
        if self._frames is None:
            matrices = np.broadcast_to(np.eye(4), (len(placed), 4, 4)).copy()
            given = [k for k, (member, _) in enumerate(placed) if member.matrix is not None]
            if given:
                matrices[given] = np.array([placed[k][0].matrix for k in given])
        else:
            matrices = self._frames.matrices[[number for _, number in placed]]
        turned = [k for k, surface in enumerate(self._surfaces()) if surface.up != self.up]
        if turned:
            matrices[turned] = turn_matrices(matrices[turned], self.up)
        matrices.flags.writeable = False
        return matrices

    def _find_moved(self) -> Bools:
        """Whether the placement of each surface is not the identity, (N,)."""
        is_moved: Bools = (self._placements != np.eye(4)).any(axis=(1, 2))
        return is_moved

    def _check_boxes(self) -> None:
        """Refuse members with coordinates that float32 cannot store."""
        surfaces, numbers = self._distinct
        lows, highs = (np.array(ends) for ends in zip(*(s.bounds() for s in surfaces), strict=True))
        # The other boxes were checked with their surfaces.
        moved = np.flatnonzero(self._find_moved())
        rows = np.array(numbers, np.intp)[moved]
        lows, highs = place_boxes(lows[rows], highs[rows], self._placements[moved])
        is_outside = (np.maximum(-lows, highs) > MAX_COORDINATE).any(axis=1)
        if is_outside.any():
            row = int(is_outside.argmax())
            _, number = list(self._placed())[moved[row]]
            where = pointer(("members", number, "matrix"))
            check_box((lows[row], highs[row]), where, "points placed")

    def _inherit(self) -> tuple[list[str], list[Color | None]]:
        """The path of each member, and its colour or that of the nearest member above it."""
        paths: list[str] = []
        colors: list[Color | None] = []
        for member in self.members:
            path, color = member.full_name, _with_opacity(member.color)
            if member.parent is not None:
                path = f"{paths[member.parent]}/{path}"
                color = color or colors[member.parent]
            paths.append(path)
            colors.append(color)
        return paths, colors

    def _measure_paths(self) -> list[int]:
        """The bytes of the path of each member; raises `InvalidRequest` if they are too many."""
        lengths: list[int] = []
        for member in self.members:
            length = len(member.full_name.encode())
            lengths.append(length if member.parent is None else lengths[member.parent] + 1 + length)
        if sum(lengths) > MAX_PATH_BYTES:
            message = "The names of all members, each with those of its parents, are too long."
            got, needed = f"{sum(lengths)} bytes", f"at most {MAX_PATH_BYTES}"
            raise InvalidRequest(Issue("wrong_length", message, "/members", got, needed))
        return lengths

    def _list_nodes(self) -> tuple[GroupNode, ...]:
        """The tree of nodes; none if each member is a surface and stands below the root."""
        is_flat = self._frames is None and len(self._placements) == len(self.members)
        if is_flat:
            return ()
        parents = {member.parent for member in self.members}
        nodes: list[GroupNode] = []
        node_of: list[int] = []
        place = 0
        for number, member in enumerate(self.members):
            parent = None if member.parent is None else node_of[member.parent]
            node_of.append(len(nodes))
            surface = member.surface
            if surface is None:
                nodes.append(GroupNode(member.full_name, parent, member.matrix))
                continue
            if number not in parents:
                matrix = turn_upright(member.matrix, surface.up, self.up)
                nodes.append(GroupNode(member.full_name, parent, matrix, place))
            elif surface.up == self.up:
                nodes.append(GroupNode(member.full_name, parent, member.matrix, place))
            else:  # the turn is of the surface alone
                turn = turn_upright(None, surface.up, self.up)
                nodes.append(GroupNode(member.full_name, parent, member.matrix))
                nodes.append(GroupNode(member.full_name, node_of[number], turn, place))
            place += 1
        return tuple(nodes)

    def _count(self) -> tuple[SurfaceSize, SurfaceSize, SurfaceSize]:
        """Compute the three sizes of the group, once, on creation."""
        surfaces, numbers = self._distinct
        lengths = self._measure_paths()
        return group_sizes(
            [surface.size() for surface in surfaces],
            numbers,
            [lengths[number] for _, number in self._placed()],
            name=self.name,
            frame_bytes=[
                len(member.full_name.encode())
                for number, member in enumerate(self.members)
                if member.surface is None
            ],
            is_colored=any(member.color is not None for member in self.members),
        )


def needs_definitions(count: int, *, has_parents: bool, has_frames: bool, has_breps: bool) -> bool:
    """Whether a group of `count` members is stored with `definitions`.

    It is if a member has a parent, no surface or a brep, or if there are more than `MAX_MEMBERS`.
    Other groups have a surface in each member: so their ids stay as they were when all groups were
    such groups.
    """
    return count > MAX_MEMBERS or has_parents or has_frames or has_breps


def nested_issue(where: str) -> Issue:
    """The issue for a group that is a member of a group."""
    return Issue(
        "nested_group",
        "A group holds surfaces, not groups.",
        where,
        "a group",
        "its members, with a member without a surface as their `parent`",
    )


def _unite_surfaces(members: tuple[Member, ...], keys: Sequence[Hashable]) -> tuple[Member, ...]:
    """The members with one object for all surfaces that differ in their names alone.

    A member whose surface had another name gets this name. `keys` are those of the surfaces,
    without `_MODEL_FIELDS`.
    """
    first_of: dict[tuple[Hashable, Up], SurfaceKind] = {}
    united: list[Member] = []
    rest = iter(keys)
    for member in members:
        surface = member.surface
        if surface is not None:
            surface = first_of.setdefault((next(rest), surface.up), surface)
        is_same = surface is member.surface
        united.append(
            member if is_same else replace(member, surface=surface, name=member.full_name)
        )
    return tuple(united)


def _with_opacity(color: tuple[float, ...] | None) -> Color | None:
    """The colour as four numbers."""
    if color is None:
        return None
    return color[0], color[1], color[2], color[3] if len(color) > 3 else 1.0
