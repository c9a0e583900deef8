"""Exchanging u and v, and reversing u or v: only the order of the control points changes."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeAlias, TypeVar

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import map_net
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.convert.nets import SizeLimits, map_channels
from service.surface.convert.operations import Reverse, Transpose
from service.surface.grids import IndexGrid, map_grids
from service.surface.patches import PatchSurface

Turn: TypeAlias = Transpose | Reverse
Grid = TypeVar("Grid", FloatArray, IndexGrid)
Single = TypeVar("Single", BezierSurface, TriangleSurface)

_EXCHANGED: Mapping[str, tuple[int, int]] = MappingProxyType({"": (1, 2), "u": (0, 1), "v": (0, 2)})
"""On triangles u = s, v = t and r = 1 − u − v. To exchange u and v (key ""), or to reverse u or v,
two of r, s, t (numbers 0, 1, 2) are exchanged."""


def turn_bezier(surface: BezierSurface, operation: Turn, _allowed: SizeLimits) -> BezierSurface:
    """Exchange u and v of a patch, S'(u, v) = S(v, u), or reverse one: S(1 − u, v), S(u, 1 − v)."""
    return _rearrange(surface, lambda net: _turn_grids(net, operation, 0))


def turn_triangle(
    surface: TriangleSurface, operation: Turn, _allowed: SizeLimits
) -> TriangleSurface:
    """Exchange u and v of a triangle, S'(r, s, t) = S(r, t, s), or reverse u, S(s, r, t), or v."""
    return _rearrange(surface, lambda net: net[_order(triangle.degree_of(len(net)), operation)])


def turn_patches(surface: PatchSurface, operation: Turn, _allowed: SizeLimits) -> PatchSurface:
    """Exchange u and v of every patch, or reverse one of them."""
    return replace(
        surface,
        patches=map_grids(surface.patches, lambda grids: _turn_grids(grids, operation, 1)),
        triangles=surface.triangles[:, _order(surface.triangle_degree, operation)],
    )


def exchange_some(surface: PatchSurface, is_chosen: Bools) -> PatchSurface:
    """Exchange u and v of some patches; grids count first, then triangles, as in `is_chosen`."""
    count, transpose = len(surface.patches), Transpose()
    grids, triangles = surface.patches, surface.triangles.copy()
    rows = np.flatnonzero(is_chosen[:count])
    if len(rows):
        turned = list(grids)
        for row in rows.tolist():
            turned[row] = turned[row].T
        grids = tuple(turned)
    rows = np.flatnonzero(is_chosen[count:])
    if len(rows):
        triangles[rows] = triangles[rows][:, _order(surface.triangle_degree, transpose)]
    return replace(surface, patches=grids, triangles=triangles)


def _rearrange(surface: Single, change: Callable[[FloatArray], FloatArray]) -> Single:
    """The surface after `change` reordered its control net, weights and channels."""
    points, weights = map_net((surface.control_net, surface.weights), change)
    channels = map_channels(surface.channels, change)
    return replace(surface, control_net=points, weights=weights, channels=channels)


def _turn_grids(grids: Grid, operation: Turn, axis_u: int) -> Grid:
    """Grids with u and v exchanged, or one of them reversed; v is the axis after `axis_u`."""
    if isinstance(operation, Transpose):
        return grids.swapaxes(axis_u, axis_u + 1)
    return np.flip(grids, axis=axis_u + "uv".index(operation.direction))


def _order(degree: int, operation: Turn) -> Ints:
    """The order of the control points of a triangle after the operation."""
    key = operation.direction if isinstance(operation, Reverse) else ""
    return triangle.exchange_order(degree, *_EXCHANGED[key])
