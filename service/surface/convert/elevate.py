"""The degree raised."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from service.bases import polynomials, triangle, triangle_polynomials
from service.bases.arrays import FloatArray
from service.bases.polynomials import Net
from service.bases.unique_rows import unique_rows
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.convert.nets import (
    Allowed,
    along,
    check_count,
    check_degree,
    check_size,
    width,
)
from service.surface.convert.operations import Elevate, degree_place
from service.surface.convert.seams import agree
from service.surface.convert.sharing import Batch, shared
from service.surface.patches import PatchSurface
from service.surface.sides import side_of
from service.surface.triangle import TriangleSurface


def elevate_bezier(surface: BezierSurface, operation: Elevate, allowed: Allowed) -> BezierSurface:
    """One patch; channels have degrees of their own and keep them."""
    check_degrees(surface.degree, operation.degree)
    check_size(operation.degree, 1, allowed)
    points, weights = raised((surface.control_net, surface.weights), operation.degree)
    return replace(surface, control_net=points, weights=weights)


def elevate_patches(surface: PatchSurface, operation: Elevate, allowed: Allowed) -> PatchSurface:
    """All patches; an edge that two of them share is raised alike from either side."""
    degree = operation.degree
    grids = [Batch.of(surface, indices) for _, indices in surface.by_degree]
    triangles = Batch.of(surface, surface.triangles) if len(surface.triangles) else None
    if grids:
        check_degrees(surface.degree, degree)
    if triangles is not None:
        check_triangle_degree(surface.triangle_degree, degree)
    count = len(surface.patches) * (degree[0] + 1) * (degree[1] + 1)
    count += len(surface.triangles) * triangle.size(degree[0])
    check_degree(max(degree), allowed, "/degree")
    check_count(count, allowed, width(surface.channels))
    shapes = {indices.shape[1:] for _, indices in surface.by_degree}
    if shapes <= {(degree[0] + 1, degree[1] + 1)} and (
        triangles is None or surface.triangle_degree == degree[0]
    ):
        return surface
    if degree[0] != degree[1]:
        _check_seams([batch.net[0] for batch in grids])
    pairs: list[tuple[Net, FloatArray]] = []
    before = [batch.net for batch in grids]
    grids = [batch.changed(partial(raised, degree=degree, first_axis=1)) for batch in grids]
    pairs += ((net, batch.net[0]) for net, batch in zip(before, grids, strict=True))
    if triangles is not None:
        net = triangles.net
        triangles = triangles.changed(partial(raised_triangles, degree=degree[0]))
        pairs.append((net, triangles.net[0]))
    agree(pairs)
    listed = Batch.joined(grids, [members for members, _ in surface.by_degree]) if grids else None
    return shared(listed, triangles, surface.parts, surface.up, surface.name)


def elevate_triangle(
    surface: TriangleSurface, operation: Elevate, allowed: Allowed
) -> TriangleSurface:
    """One triangle; channels have degrees of their own and keep them."""
    check_triangle_degree(surface.degree, operation.degree)
    n = operation.degree[0]
    check_degree(n, allowed, "/degree")
    check_count(triangle.size(n), allowed)
    points, weights = triangle_polynomials.elevate((surface.control_net, surface.weights), n)
    return replace(surface, control_net=points, weights=weights)


def raised(net: Net, degree: tuple[int, int], first_axis: int = 0) -> Net:
    """A net or a batch of nets in a higher degree (p, q)."""
    for axis, n in enumerate(degree, first_axis):
        net = along(net, axis, partial(polynomials.elevate, degree=n))
    return net


def raised_triangles(net: Net, degree: int) -> Net:
    """A batch of nets of triangles in a higher degree."""
    return along(net, 1, partial(triangle_polynomials.elevate, degree=degree))


def check_triangle_degree(present: int, wanted: tuple[int, int]) -> None:
    """Refuses to lower the degree of triangles, and two degrees for what has one."""
    if wanted[0] != wanted[1]:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "A triangle has one degree.",
                "/degree",
                "two different degrees",
                "one number, or twice the same",
            )
        )
    check_degrees((present, present), wanted)


def check_degrees(present: tuple[int, int], wanted: tuple[int, int]) -> None:
    """Refuses to lower a degree: that would be another surface."""
    for axis, (old, new) in enumerate(zip(present, wanted, strict=True)):
        if new < old:
            raise InvalidRequest(
                Issue(
                    "degree_too_low",
                    "A degree can be raised without changing the surface, not lowered.",
                    degree_place(wanted, axis),
                    f"degree {new}",
                    f"at least {old}, the present degree",
                )
            )


def _check_seams(nets: Sequence[FloatArray]) -> None:
    """Refuses to open a seam: where a side along u is one along v, both need one degree."""
    for rows in {points.shape[1] for points in nets} & {points.shape[2] for points in nets}:
        along_v, along_u = (
            np.concatenate([side_of(n, s) for n in nets if n.shape[axis] == rows for s in two])
            for axis, two in ((2, (0, 1)), (1, (2, 3)))
        )
        _check_sides(along_v, along_u)


def _check_sides(along_v: FloatArray, along_u: FloatArray) -> None:
    """Refuses sides (N, n+1, 3) along v of which one is a side along u."""
    sides = np.concatenate([along_v, along_v[:, ::-1], along_u])
    _, number = unique_rows(sides.reshape(len(sides), -1))
    # A side that is one point has no length to part along.
    number[(sides == sides[:, :1]).all(axis=(1, 2))] = -1
    known, met = number[: 2 * len(along_v)], number[2 * len(along_v) :]
    if np.isin(met[met >= 0], known).any():
        raise InvalidRequest(
            Issue(
                "seam_would_open",
                "A side along u is the same edge as a side along v: of two degrees, they part.",
                "/degree",
                "two different degrees",
                "the same degree along u and v",
            )
        )
