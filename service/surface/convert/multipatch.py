"""Conversions of a multipatch: converts each surface by itself, or all to Bézier patches."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np

from service.bases.triangle import degree_of
from service.surface.bezier import TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.cut import highest_degree
from service.surface.convert.elevate import elevate_nets, elevate_triangle_nets
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    add_batch_axis,
    check_count,
    map_channels,
    share_vertices,
)
from service.surface.convert.operations import Operation, ToBezier
from service.surface.convert.spline import bezier_of_spline
from service.surface.grids import group_by_degree
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import NO_TRIANGLES, PatchSurface
from service.surface.sizes import SurfaceKind

Result = TypeVar("Result", bound=SurfaceKind)


def convert_each(
    surface: MultipatchSurface,
    convert: Mapping[type, Callable[[Any, Any, SizeLimits], object]],
    operation: Operation,
    allowed: SizeLimits,
) -> MultipatchSurface:
    """Convert every surface separately, with the function of its kind in `convert`.

    `allowed` limits the control points of all surfaces together.
    """
    surfaces = _convert_all(
        surface,
        lambda single, limits: cast(Single, convert[type(single)](single, operation, limits)),
        allowed,
    )
    return replace(surface, surfaces=tuple(surfaces))


def bezier_of_multipatch(
    surface: MultipatchSurface, operation: ToBezier, allowed: SizeLimits
) -> PatchSurface:
    """All surfaces as one surface of Bézier patches; each becomes a part with its name.

    All triangles are elevated to the highest degree among them. If several surfaces have one name,
    the names of the second part and of later ones end with a number.
    """
    triangles = [Batch.of_net(s) for s in surface.surfaces if isinstance(s, TriangleSurface)]
    degree = max((degree_of(len(net)) for t in triangles for net in t.nets), default=1)

    def convert(single: Single, limits: SizeLimits) -> PatchSurface:
        if isinstance(single, BsplineSurface):
            return bezier_of_spline(single, operation, limits)
        return _to_patches(single, degree)

    return _join_surfaces(surface, _convert_all(surface, convert, allowed))


def _convert_all(
    surface: MultipatchSurface, convert: Callable[[Single, SizeLimits], Result], allowed: SizeLimits
) -> list[Result]:
    """Convert each surface; `allowed` limits the control points of all together."""
    converted: list[Result] = []
    for single in surface.surfaces:
        result = convert(single, allowed)
        point_count = result.size().net_points
        check_count(point_count, allowed)
        allowed = replace(allowed, control_points=allowed.control_points - point_count)
        converted.append(result)
    return converted


def _to_patches(single: Single, degree: int) -> PatchSurface:
    """One surface as Bézier patches over shared vertices.

    A triangle and its channels are elevated to `degree`; the nets of a four-sided patch are
    elevated to the highest degree among them.
    """
    batch = Batch.of_net(single).apply(add_batch_axis)
    if isinstance(single, TriangleSurface):
        batch = batch.apply(partial(elevate_triangle_nets, degree=degree))
        return share_vertices(None, batch)
    degrees = highest_degree(net.shape[1:] for net in batch.nets)
    return share_vertices(batch.apply(partial(elevate_nets, degree=degrees, first_axis=1)))


def _join_surfaces(surface: MultipatchSurface, sources: Sequence[PatchSurface]) -> PatchSurface:
    """Join surfaces of patches, all with the same channels, to one; each becomes a part."""
    first_vertices = np.cumsum([0, *(len(source.vertices) for source in sources)])
    grids = [
        grid + start
        for source, start in zip(sources, first_vertices, strict=False)
        for _, patches in group_by_degree(source.patches)
        for grid in patches
    ]
    triangles = [
        source.triangles + start
        for source, start in zip(sources, first_vertices, strict=False)
        if len(source.triangles)
    ]
    parts: dict[str, tuple[int, ...]] = {}
    # The next patch number of the grids, and of the triangles, which come after all grids.
    next_numbers = [0, len(grids)]
    for single, source in zip(surface.surfaces, sources, strict=True):
        kind, count = (1, 1) if len(source.triangles) else (0, len(source.patches))
        name, number = single.name, 2
        while name in parts:
            name, number = f"{single.name} {number}", number + 1
        parts[name] = tuple(range(next_numbers[kind], next_numbers[kind] + count))
        next_numbers[kind] += count
    weights = None
    if any(source.weights is not None for source in sources):
        all_weights = [
            np.ones(len(source.vertices)) if source.weights is None else source.weights
            for source in sources
        ]
        weights = np.concatenate(all_weights)
    nets = zip(*([net for *_, net in source.channels.each()] for source in sources), strict=True)
    values = map(np.concatenate, nets)
    return PatchSurface(
        np.concatenate([source.vertices for source in sources]),
        tuple(grids),
        weights,
        tuple(parts.items()),
        surface.up,
        surface.name,
        map_channels(sources[0].channels, lambda _: next(values)),
        np.concatenate(triangles or [NO_TRIANGLES]),
    )
