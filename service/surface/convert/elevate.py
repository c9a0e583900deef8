"""Degree elevation of Bézier patches and triangles."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from service.bases import polynomials, triangle
from service.bases.arrays import FloatArray
from service.bases.polynomials import Net
from service.bases.row_batches import unique_rows
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.convert.nets import (
    Batch,
    SizeLimits,
    apply_along,
    check_count,
    check_degree,
    share_vertices,
)
from service.surface.convert.operations import Elevate, degree_pointer
from service.surface.convert.seams import match_shared_edges
from service.surface.patches import PatchSurface
from service.surface.sides import take_side


def elevate_bezier(
    surface: BezierSurface, operation: Elevate, allowed: SizeLimits
) -> BezierSurface:
    """Elevate one patch; channels keep their own degrees."""
    check_degrees(surface.degree, operation.degree)
    p, q = operation.degree
    for axis, n in enumerate((p, q)):
        check_degree(n, allowed, degree_pointer((p, q), axis))
    check_count((p + 1) * (q + 1), allowed)
    points, weights = elevate_nets((surface.control_net, surface.weights), (p, q))
    return replace(surface, control_net=points, weights=weights)


def elevate_patches(surface: PatchSurface, operation: Elevate, allowed: SizeLimits) -> PatchSurface:
    """Elevate all patches; on an edge that two patches share, both get equal control points."""
    degree, has_triangles = operation.degree, len(surface.triangles) > 0
    if len(surface.patches):
        check_degrees(surface.degree, degree)
    if has_triangles:
        check_triangle_degree(surface.triangle_degree, degree)
    count = len(surface.patches) * (degree[0] + 1) * (degree[1] + 1)
    count += len(surface.triangles) * triangle.count_points(degree[0])
    check_degree(max(degree), allowed, "/degree")
    check_count(count, allowed, sum(net.shape[-1] for *_, net in surface.channels.each()))
    shapes = {indices.shape[1:] for _, indices in surface.by_degree}
    if shapes <= {(degree[0] + 1, degree[1] + 1)} and (
        not has_triangles or surface.triangle_degree == degree[0]
    ):
        return surface  # every patch has the degree already
    numbers = [numbers for numbers, _ in surface.by_degree]
    batches = [Batch.of_patches(surface, indices) for _, indices in surface.by_degree]
    if degree[0] != degree[1]:
        _check_seams([batch.net[0] for batch in batches])
    change = partial(elevate_nets, degree=degree, first_axis=1)
    elevated = [batch.apply(change) for batch in batches]
    if has_triangles:
        batches.append(Batch.of_patches(surface, surface.triangles))
        elevated.append(batches[-1].apply(partial(elevate_triangle_nets, degree=degree[0])))
    match_shared_edges([(old.net, new.net[0]) for old, new in zip(batches, elevated, strict=True)])
    triangles = elevated.pop() if has_triangles else None
    grids = Batch.join(elevated, numbers) if elevated else None
    return share_vertices(grids, triangles, surface.parts, surface.up, surface.name)


def elevate_triangle(
    surface: TriangleSurface, operation: Elevate, allowed: SizeLimits
) -> TriangleSurface:
    """Elevate one triangle; channels keep their own degrees."""
    check_triangle_degree(surface.degree, operation.degree)
    n = operation.degree[0]
    check_degree(n, allowed, "/degree")
    check_count(triangle.count_points(n), allowed)
    points, weights = triangle.elevate((surface.control_net, surface.weights), n)
    return replace(surface, control_net=points, weights=weights)


def elevate_nets(net: Net, degree: tuple[int, int], first_axis: int = 0) -> Net:
    """Elevate a net, or a batch of nets, to the degree (p, q); u is the axis `first_axis`."""
    for axis, n in enumerate(degree, first_axis):
        net = apply_along(net, axis, partial(polynomials.elevate, degree=n))
    return net


def elevate_triangle_nets(net: Net, degree: int) -> Net:
    """Elevate a batch of nets of triangles."""
    return apply_along(net, 1, partial(triangle.elevate, degree=degree))


def check_triangle_degree(old_degree: int, degree: tuple[int, int]) -> None:
    """Refuse a lower degree, and two different degrees, for triangles."""
    if degree[0] != degree[1]:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "A triangle has one degree.",
                "/degree",
                "two different degrees",
                "one number, or twice the same",
            )
        )
    check_degrees((old_degree, old_degree), degree)


def check_degrees(old_degrees: tuple[int, int], degree: tuple[int, int]) -> None:
    """Refuse a lower degree, which would change the surface."""
    for axis, (old, new) in enumerate(zip(old_degrees, degree, strict=True)):
        if new < old:
            raise InvalidRequest(
                Issue(
                    "degree_too_low",
                    "A degree can be raised without changing the surface, not lowered.",
                    degree_pointer(degree, axis),
                    f"degree {new}",
                    f"at least {old}, the present degree",
                )
            )


def _check_seams(nets: Sequence[FloatArray]) -> None:
    """Refuse different degrees p and q if a side along u is the same edge as a side along v.

    The two patches at this edge would have different control points there, and could have a gap.
    """
    # Only sides with equally many control points can be the same edge.
    for count in {points.shape[1] for points in nets} & {points.shape[2] for points in nets}:
        # Sides 0 and 1 run along v, axis 2 of a net; sides 2 and 3 run along u, axis 1.
        sides_along_v, sides_along_u = (
            np.concatenate([take_side(n, s) for n in nets if n.shape[axis] == count for s in sides])
            for axis, sides in ((2, (0, 1)), (1, (2, 3)))
        )
        sides = np.concatenate([sides_along_v, sides_along_v[:, ::-1], sides_along_u])
        _, number = unique_rows(sides.reshape(len(sides), -1))
        # Without the sides that are a single point: no gap can appear there.
        number[(sides == sides[:, :1]).all(axis=(1, 2))] = -1
        numbers_along_v, numbers_along_u = np.split(number, [2 * len(sides_along_v)])
        if np.isin(numbers_along_u[numbers_along_u >= 0], numbers_along_v).any():
            raise InvalidRequest(
                Issue(
                    "seam_would_open",
                    "A side along u is the same edge as a side along v: two degrees would open it.",
                    "/degree",
                    "two different degrees",
                    "the same degree along u and v",
                )
            )
