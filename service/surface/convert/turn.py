"""Parameters exchanged or run backwards: rows in another order, no number changed."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bezier import BezierSurface
from service.surface.convert.nets import Allowed, changed
from service.surface.convert.operations import Direction, Reverse, Transpose
from service.surface.patches import PatchSurface

_AXIS: Mapping[Direction, int] = MappingProxyType({"u": 0, "v": 1})


def transpose_bezier(
    surface: BezierSurface, _operation: Transpose, _allowed: Allowed
) -> BezierSurface:
    """S'(u, v) = S(v, u)."""
    return _rearranged(surface, lambda net: net.swapaxes(0, 1))


def transpose_patches(
    surface: PatchSurface, _operation: Transpose, _allowed: Allowed
) -> PatchSurface:
    """Every patch for itself."""
    return replace(surface, patches=surface.patches.swapaxes(1, 2))


def reverse_bezier(surface: BezierSurface, operation: Reverse, _allowed: Allowed) -> BezierSurface:
    """S'(u, v) = S(1 − u, v), or S(u, 1 − v)."""
    return _rearranged(surface, lambda net: np.flip(net, axis=_AXIS[operation.direction]))


def reverse_patches(surface: PatchSurface, operation: Reverse, _allowed: Allowed) -> PatchSurface:
    """Every patch for itself."""
    axis = 1 + _AXIS[operation.direction]
    return replace(surface, patches=np.flip(surface.patches, axis=axis))


def _rearranged(
    surface: BezierSurface, change: Callable[[FloatArray], FloatArray]
) -> BezierSurface:
    """The surface with its nets in another order."""
    weights = None if surface.weights is None else change(surface.weights)
    return replace(
        surface,
        control_net=change(surface.control_net),
        weights=weights,
        channels=changed(surface.channels, change),
    )
