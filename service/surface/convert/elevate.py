"""The degree raised."""

from dataclasses import replace
from functools import partial

import numpy as np

from service.bases import polynomials
from service.bases.arrays import FloatArray
from service.bases.polynomials import Net
from service.bases.rows import distinct_rows
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.convert.nets import Allowed, along, changed, check_size
from service.surface.convert.operations import Elevate
from service.surface.convert.seams import agree
from service.surface.convert.sharing import shared
from service.surface.patches import PatchSurface
from service.surface.sides import side_of


def elevate_bezier(surface: BezierSurface, operation: Elevate, allowed: Allowed) -> BezierSurface:
    """One patch; channels have degrees of their own and keep them."""
    check_degrees(surface.degree, operation.degree)
    check_size(operation.degree, 1, allowed)
    points, weights = raised((surface.control_net, surface.weights), operation.degree)
    return replace(surface, control_net=points, weights=weights)


def elevate_patches(surface: PatchSurface, operation: Elevate, allowed: Allowed) -> PatchSurface:
    """All patches; an edge that two of them share is raised alike from either side."""
    degree = operation.degree
    check_degrees(surface.degree, degree)
    check_size(degree, len(surface.patches), allowed, surface.channels)
    if degree == surface.degree:
        return surface
    indices = surface.patches
    points = surface.vertices[indices]
    if surface.degree[0] == surface.degree[1] and degree[0] != degree[1]:
        _check_seams(points)
    weights = None if surface.weights is None else surface.weights[indices]
    net = raised((points, weights), degree, 1)
    if weights is not None:
        agree(points, weights, net[0])
    channels = changed(
        surface.channels, lambda values: raised((values[indices], None), degree, 1)[0]
    )
    return shared(net, channels, surface.parts, surface.up, surface.name)


def raised(net: Net, degree: tuple[int, int], first_axis: int = 0) -> Net:
    """A net or a batch of nets in a higher degree (p, q)."""
    for axis, n in enumerate(degree, first_axis):
        net = along(net, axis, partial(polynomials.elevate, degree=n))
    return net


def check_degrees(present: tuple[int, int], wanted: tuple[int, int]) -> None:
    """Refuses to lower a degree: that would be another surface."""
    for axis, (old, new) in enumerate(zip(present, wanted, strict=True)):
        if new < old:
            raise InvalidRequest(
                Issue(
                    "degree_too_low",
                    "A degree can be raised without changing the surface, not lowered.",
                    f"/degree/{axis}",
                    f"degree {new}",
                    f"at least {old}, the present degree",
                )
            )


def _check_seams(points: FloatArray) -> None:
    """Refuses to open a seam: where a side along u is one along v, both need one degree."""
    along_v, along_u = (
        np.concatenate([side_of(points, s) for s in two]) for two in ((0, 1), (2, 3))
    )
    sides = np.concatenate([along_v, along_v[:, ::-1], along_u])
    _, number = distinct_rows(sides.reshape(len(sides), -1))
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
