"""Operations on groups: on all members, or on one of their patches, which `patch` names.

Names, colours and placements stay, and parameters are those of the member's own surface. `patch`
counts the faces of breps and the Bézier patches of other members, one member after the other, as
`service.engine.numbering` does.
"""

from dataclasses import replace

import numpy as np

from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue
from service.surface.convert.chosen import Convert, list_pieces, require_number
from service.surface.convert.nets import SizeLimits, check_count
from service.surface.convert.operations import (
    Insert,
    PatchOperation,
    Restrict,
    Split,
    ToTriangle,
)
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind


def convert_group(
    group: GroupSurface, operation: PatchOperation, allowed: SizeLimits, convert: Convert
) -> GroupSurface:
    """Convert all members, or the one that has the patch `operation.patch`.

    A B-spline whose patch is named is converted as a whole. A member that is split into B-splines
    becomes a multipatch of these.

    Raises
    ------
    InvalidRequest
        `missing_field` if an operation on one patch finds several surfaces.
    """
    if operation.patch is None and not isinstance(
        operation, Restrict | Split | Insert | ToTriangle
    ):
        return _convert_all(group, operation, allowed, convert)
    own: int | None = None
    if operation.patch is None:
        placed = [k for k, member in enumerate(group.members) if member.surface is not None]
        if len(placed) > 1:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "The group has several surfaces, and this operation changes one patch.",
                    "/patch",
                    "nothing",
                    "the number of a patch",
                )
            )
        (chosen,) = placed
    else:
        chosen, own = find_member(group, operation.patch)
    surface = group.members[chosen].surface
    if own is not None:
        own = _find_own_number(surface, own)
    rest = group.written_size().net_points
    if surface is not None:
        rest -= surface.size().net_points
    check_count(rest, allowed)
    allowed = replace(allowed, control_points=allowed.control_points - rest)
    converted = _to_member(convert(surface, replace(operation, patch=own), allowed), surface)
    members = list(group.members)
    members[chosen] = _replace_surface(members[chosen], converted)
    return replace(group, members=tuple(members))


def find_member(group: GroupSurface, patch: int) -> tuple[int, int]:
    """The member that has this number of all faces and patches, and the number in its surface."""
    counts = [_count_numbers(member.surface) for member in group.members]
    ends = np.cumsum(counts)
    require_number(patch, int(ends[-1]))
    member = int(np.searchsorted(ends, patch, side="right"))
    return member, patch - int(ends[member]) + counts[member]


def _convert_all(
    group: GroupSurface, operation: PatchOperation, allowed: SizeLimits, convert: Convert
) -> GroupSurface:
    """Convert each distinct surface once; `allowed` limits the control points of the document."""
    results: dict[int, SurfaceKind] = {}
    members: list[Member] = []
    for member in group.members:
        surface = member.surface
        if surface is None:
            members.append(member)
            continue
        is_new = id(surface) not in results
        if is_new:
            checkpoint()
            results[id(surface)] = _to_member(convert(surface, operation, allowed), surface)
        result = results[id(surface)]
        if is_new or not group.has_definitions:
            count = result.size().net_points
            check_count(count, allowed)
            allowed = replace(allowed, control_points=allowed.control_points - count)
        members.append(_replace_surface(member, result))
    return replace(group, members=tuple(members))


def _count_numbers(surface: SurfaceKind | None) -> int:
    """How many numbers a surface has: one for each face of a brep, or for each Bézier patch."""
    size = None if surface is None else surface.size()
    return 0 if size is None else size.faces or size.patches


def _find_own_number(surface: SurfaceKind | None, number: int) -> int | None:
    """The number by which an operation on this surface names the patch; None for a single one."""
    if isinstance(surface, PatchSurface):
        return number
    if not isinstance(surface, MultipatchSurface):
        return None
    for own, domain in enumerate(surface.lower().domains):
        if domain.first <= number < domain.first + domain.patch_count:
            return own
    raise AssertionError("each patch is in one of the domains")


def _to_member(result: SurfaceKind, origin: SurfaceKind | None) -> SurfaceKind:
    """A result that may be a member of a group: the pieces of a B-spline become a multipatch."""
    if isinstance(result, GroupSurface) and origin is not None:
        return MultipatchSurface(list_pieces(result, origin.name), origin.up, origin.name)
    return result


def _replace_surface(member: Member, surface: SurfaceKind) -> Member:
    """The member with another surface and the same name."""
    return replace(member, surface=surface, name=member.full_name, definition=None)
