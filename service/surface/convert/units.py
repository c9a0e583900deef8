"""Turns some of the patches of a surface: those of `patches`, surfaces of a `multipatch`, members.

A turned patch has u and v exchanged (a triangle s and t), so that its normals point to the other
side; its parameters stay within the same domain.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from service.bases.arrays import Bools, Ints
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.chosen import Convert
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Transpose
from service.surface.convert.turn import exchange_some
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind


def turn_patches_of(
    surface: SurfaceKind, member: Ints, number: Ints, convert: Convert
) -> SurfaceKind:
    """Turn the patches with these numbers (m,), of these members (m,) of a group.

    Other surfaces are member 0. A single patch or B-spline has number 0. `convert` applies an
    operation to a surface.
    """
    if not len(number):
        return surface
    if not isinstance(surface, GroupSurface):
        return _turn(surface, number, convert)
    turned: dict[int, Ints] = {}
    for place in np.unique(member).tolist():
        turned[place] = number[member == place]
    return _turn_members(surface, turned, convert)


def _turn_members(
    group: GroupSurface, turned: Mapping[int, Ints], convert: Convert
) -> GroupSurface:
    """The group with patches of some members turned; equal members are turned once."""
    results: dict[tuple[int, bytes], SurfaceKind] = {}
    members = list(group.members)
    for place, numbers in turned.items():
        member = members[place]
        assert member.surface is not None  # members without surfaces have no patches
        key = id(member.surface), numbers.tobytes()
        if key not in results:
            results[key] = _turn(member.surface, numbers, convert)
        name = member.full_name
        members[place] = replace(member, surface=results[key], name=name, definition=None)
    return replace(group, members=tuple(members))


def _turn(surface: SurfaceKind, numbers: Ints, convert: Convert) -> SurfaceKind:
    """The surface with these patches turned."""
    if isinstance(surface, BezierSurface | BsplineSurface | TriangleSurface):
        return _transpose(surface, convert)
    if isinstance(surface, PatchSurface):
        count = len(surface.patches) + len(surface.triangles)
        return exchange_some(surface, _mark(numbers, count))
    assert isinstance(surface, MultipatchSurface)  # sweeps and breps have no such patches
    singles = list(surface.surfaces)
    for number in numbers.tolist():
        singles[number] = _transpose(singles[number], convert)
    return replace(surface, surfaces=tuple(singles))


def _transpose(surface: Single, convert: Convert) -> Single:
    return cast(Single, convert(surface, Transpose(), SizeLimits()))


def _mark(numbers: Ints, count: int) -> Bools:
    is_marked = np.zeros(count, bool)
    is_marked[numbers] = True
    return is_marked
