"""Operations on one patch of several: of a surface of patches, or one surface of a multipatch.

The result takes the place of the patch; all others stay as they are. If it has several pieces, they
have the numbers from that of the patch, and the numbers after it increase.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import find_first_rows
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    add_batch_axis,
    check_count,
    map_channels,
    share_vertices,
)
from service.surface.convert.operations import PatchOperation
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import NO_TRIANGLES, PatchSurface

Convert: TypeAlias = Callable[[Any, Any, SizeLimits], Any]
"""Applies an operation to a surface (`service.surface.convert.table.apply`)."""


def require_number(number: int, count: int) -> None:
    """Refuse the number of a patch that the surface does not have."""
    if not 0 <= number < count:
        message = "Patches are numbered from 0, in the order of the request."
        got, needed = str(number), f"0 to {count - 1}"
        raise InvalidRequest(Issue("index_out_of_range", message, "/patch", got, needed))


def convert_patch(
    surface: PatchSurface,
    number: int,
    operation: PatchOperation,
    allowed: SizeLimits,
    convert: Convert,
) -> PatchSurface:
    """Convert one patch of a surface of patches, without `operation.patch`.

    Raises
    ------
    InvalidRequest
        `unsupported_operation` if there would be triangles of several degrees.
    """
    grid_count = len(surface.patches)
    require_number(number, grid_count + len(surface.triangles))
    check_count(len(surface.vertices), allowed)
    allowed = replace(allowed, control_points=allowed.control_points - len(surface.vertices))
    result = convert(_take_patch(surface, number), operation, allowed)
    if isinstance(result, TriangleSurface):
        result = share_vertices(None, Batch.of_net(result).apply(add_batch_axis))
    vertices, weights, channels, new_index = _add_vertices(surface, result)
    new_grids = [new_index[grid] for grid in result.patches]
    new_triangles = new_index[result.triangles]
    # The patches with the numbers that they had; those of the result have that of their origin.
    grids = [(k, grid) for k, grid in enumerate(surface.patches) if k != number]
    grids += [(number, grid) for grid in new_grids]
    triangles = [
        (grid_count + k, row) for k, row in enumerate(surface.triangles) if grid_count + k != number
    ]
    triangles += [(number, row) for row in new_triangles]
    # The sort is stable: pieces stay in their order. A triangle that was a grid comes first.
    grids.sort(key=lambda item: item[0])
    triangles.sort(key=lambda item: item[0])
    if len({len(row) for _, row in triangles}) > 1:
        raise InvalidRequest(
            Issue(
                "unsupported_operation",
                "All triangles of a surface of patches have one degree.",
                "/patch",
                "a triangle of another degree",
                "`elevate` for all patches, or a multipatch, whose triangles may differ",
            )
        )
    origins = [origin for origin, _ in (*grids, *triangles)]
    numbers: dict[int, list[int]] = {}
    for new_number, origin in enumerate(origins):
        numbers.setdefault(origin, []).append(new_number)
    parts = tuple(
        (name, tuple(new for old in members for new in numbers[old]))
        for name, members in surface.parts
    )
    return _drop_unused(
        replace(
            surface,
            vertices=vertices,
            patches=tuple(grid for _, grid in grids),
            weights=weights,
            parts=parts,
            channels=channels,
            triangles=np.array([row for _, row in triangles]) if triangles else NO_TRIANGLES,
        )
    )


def convert_surface_of(
    surface: MultipatchSurface,
    number: int,
    operation: PatchOperation,
    allowed: SizeLimits,
    convert: Convert,
) -> MultipatchSurface:
    """Convert one surface of a multipatch, without `operation.patch`.

    The pieces of a surface become surfaces with its name.
    """
    surfaces = surface.surfaces
    require_number(number, len(surfaces))
    others = sum(each.size().net_points for k, each in enumerate(surfaces) if k != number)
    check_count(others, allowed)
    allowed = replace(allowed, control_points=allowed.control_points - others)
    pieces = list_pieces(convert(surfaces[number], operation, allowed), surfaces[number].name)
    return replace(surface, surfaces=(*surfaces[:number], *pieces, *surfaces[number + 1 :]))


def list_pieces(result: Single | PatchSurface | GroupSurface, name: str) -> tuple[Single, ...]:
    """The surfaces that an operation made of one surface, each with this name."""
    if isinstance(result, BezierSurface | BsplineSurface | TriangleSurface):
        return (result,)
    if isinstance(result, GroupSurface):  # the pieces of a B-spline
        pieces = [member.surface for member in result.members]
        return tuple(piece for piece in pieces if isinstance(piece, BsplineSurface))
    count = len(result.patches) + len(result.triangles)
    return tuple(_to_single(result, number, name) for number in range(count))


def _to_single(surface: PatchSurface, number: int, name: str) -> BezierSurface | TriangleSurface:
    """A patch as a surface of its own."""
    is_grid = number < len(surface.patches)
    indices = (
        surface.patches[number] if is_grid else surface.triangles[number - len(surface.patches)]
    )
    (points, weights), channels = Batch.of_patches(surface, indices)
    kind = BezierSurface if is_grid else TriangleSurface
    return kind(points, weights, surface.up, name, channels)


def _take_patch(surface: PatchSurface, number: int) -> PatchSurface:
    """A surface of one of the patches."""
    grid_count = len(surface.patches)
    if number < grid_count:
        batch = Batch.of_patches(surface, surface.patches[number][np.newaxis])
        return share_vertices(batch, None, (), surface.up, surface.name)
    batch = Batch.of_patches(surface, surface.triangles[number - grid_count][np.newaxis])
    return share_vertices(None, batch, (), surface.up, surface.name)


def _add_vertices(
    surface: PatchSurface, result: PatchSurface
) -> tuple[FloatArray, FloatArray | None, Any, Ints]:
    """Vertices, weights and channels of both surfaces, and the index of each vertex of `result`.

    A vertex of `result` that equals one of `surface`, with its weight and its channels, is that
    one.
    """
    old_columns, new_columns = _columns(surface), _columns(result)
    rows = np.concatenate(
        [np.concatenate(old_columns, axis=1), np.concatenate(new_columns, axis=1)]
    )
    count = len(surface.vertices)
    first, numbers = find_first_rows(rows + 0.0)  # adding 0 turns −0 into 0
    index = first[numbers][count:]
    is_new = index >= count
    kept = np.unique(index[is_new]) - count
    index = np.where(is_new, count + np.searchsorted(kept, index - count), index)
    joined = [
        np.concatenate([old, new[kept]]) for old, new in zip(old_columns, new_columns, strict=True)
    ]
    weights = None if surface.weights is None else joined.pop()[:, 0]
    columns = iter(joined[1:])
    return joined[0], weights, map_channels(surface.channels, lambda _: next(columns)), index


def _columns(surface: PatchSurface) -> list[FloatArray]:
    """Positions, channels and weights of the vertices, as arrays of one row for each vertex."""
    columns = [surface.vertices, *(net for *_, net in surface.channels.each())]
    return columns if surface.weights is None else [*columns, surface.weights[:, np.newaxis]]


def _drop_unused(surface: PatchSurface) -> PatchSurface:
    """The surface without the vertices that no patch uses, in the same order."""
    is_used = np.zeros(len(surface.vertices), bool)
    for _, grids in surface.by_degree:
        is_used[grids.ravel()] = True
    is_used[surface.triangles.ravel()] = True
    if is_used.all():
        return surface
    index = np.cumsum(is_used) - 1
    return replace(
        surface,
        vertices=surface.vertices[is_used],
        patches=tuple(index[grid] for grid in surface.patches),
        weights=None if surface.weights is None else surface.weights[is_used],
        channels=map_channels(surface.channels, lambda net: net[is_used]),
        triangles=index[surface.triangles],
    )
