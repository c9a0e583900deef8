"""Exchanging u and v, and reversing u or v: only the order of the control points changes."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from service.bases import triangle, triangle_polynomials
from service.bases.arrays import FloatArray
from service.surface.bezier import BezierSurface
from service.surface.convert.nets import SizeLimits, map_channels
from service.surface.convert.operations import Direction, Reverse, Transpose
from service.surface.grids import map_grids
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface

_AXIS: Mapping[Direction, int] = MappingProxyType({"u": 0, "v": 1})

_EXCHANGED: Mapping[str, tuple[int, int]] = MappingProxyType({"": (1, 2), "u": (0, 1), "v": (0, 2)})
"""On triangles u = s, v = t and r = 1 − u − v. To exchange u and v (key ""), or to reverse u or v,
two of r, s, t (numbers 0, 1, 2) are exchanged."""


def transpose_bezier(
    surface: BezierSurface, _operation: Transpose, _allowed: SizeLimits
) -> BezierSurface:
    """Exchange u and v of a patch: S'(u, v) = S(v, u)."""
    return _rearrange(surface, lambda net: net.swapaxes(0, 1))


def transpose_patches(
    surface: PatchSurface, _operation: Transpose, _allowed: SizeLimits
) -> PatchSurface:
    """Exchange u and v of every patch."""
    order = triangle_polynomials.exchange_order(surface.triangle_degree, *_EXCHANGED[""])
    return replace(
        surface,
        patches=map_grids(surface.patches, lambda grids: grids.swapaxes(1, 2)),
        triangles=surface.triangles[:, order],
    )


def reverse_bezier(
    surface: BezierSurface, operation: Reverse, _allowed: SizeLimits
) -> BezierSurface:
    """Reverse u or v of a patch: S'(u, v) = S(1 − u, v), or S(u, 1 − v)."""
    return _rearrange(surface, lambda net: np.flip(net, axis=_AXIS[operation.direction]))


def reverse_patches(
    surface: PatchSurface, operation: Reverse, _allowed: SizeLimits
) -> PatchSurface:
    """Reverse u or v of every patch."""
    axis = 1 + _AXIS[operation.direction]
    order = triangle_polynomials.exchange_order(
        surface.triangle_degree, *_EXCHANGED[operation.direction]
    )
    return replace(
        surface,
        patches=map_grids(surface.patches, lambda grids: np.flip(grids, axis=axis)),
        triangles=surface.triangles[:, order],
    )


def transpose_triangle(
    surface: TriangleSurface, _operation: Transpose, _allowed: SizeLimits
) -> TriangleSurface:
    """Exchange u and v of a triangle: S'(r, s, t) = S(r, t, s)."""
    return _exchange(surface, *_EXCHANGED[""])


def reverse_triangle(
    surface: TriangleSurface, operation: Reverse, _allowed: SizeLimits
) -> TriangleSurface:
    """Reverse u or v of a triangle: S'(r, s, t) = S(s, r, t), or S(t, s, r)."""
    return _exchange(surface, *_EXCHANGED[operation.direction])


def _rearrange(surface: BezierSurface, change: Callable[[FloatArray], FloatArray]) -> BezierSurface:
    """The surface after `change` reordered its control net, weights and channels."""
    weights = None if surface.weights is None else change(surface.weights)
    return replace(
        surface,
        control_net=change(surface.control_net),
        weights=weights,
        channels=map_channels(surface.channels, change),
    )


def _exchange(surface: TriangleSurface, first: int, second: int) -> TriangleSurface:
    """The triangle with two of its barycentric coordinates exchanged."""

    def change(net: FloatArray) -> FloatArray:
        order = triangle_polynomials.exchange_order(triangle.degree_of(len(net)), first, second)
        return net[order]

    return replace(
        surface,
        control_net=change(surface.control_net),
        weights=None if surface.weights is None else change(surface.weights),
        channels=map_channels(surface.channels, change),
    )
