"""The seams of a model by a connectivity that is found once for each pattern of equal points.

Sides of one degree are one edge if their control points are equal, in one direction or the other.
Where sides of several degrees may be equal after raising, or weights differ, `find_seams` looks at
the coordinates each time.
"""

from collections.abc import Hashable

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.cache import MESH_PLANS
from service.engine.mesh.connectivity import (
    FEW_POINTS,
    Connectivity,
    digest,
    equal_points,
    first_equals,
)
from service.engine.mesh.edge_patterns import (
    EdgePattern,
    border_points,
    border_weights,
    find_pattern,
    first_of,
)
from service.engine.mesh.edges import EdgeCurves
from service.engine.mesh.seams import Seams, find_seams
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, PatchModel


def connect(model: PatchModel) -> Seams:
    """Distinct edges and corners of all patches of a model.

    As `find_seams` finds them; but numbered, and directed, by the patches that come first, so that
    nothing of the connectivity depends on coordinates.
    """
    batches = model.batches
    points = [border_points(batch) for batch in batches]
    border = points[0] if len(points) == 1 else np.concatenate(points)
    forms = tuple((isinstance(b, TrianglePatches), b.degree, b.count) for b in batches)
    pattern = _pattern(model, border, forms)
    seams = None
    if pattern.is_certain:
        weights = None
        if any(batch.weights is not None for batch in batches):
            weights = np.concatenate([border_weights(batch) for batch in batches])
        seams = pattern.seams(border, weights)
    return seams or _renumbered(find_seams(batches))


def _pattern(model: PatchModel, border: FloatArray, forms: tuple[Hashable, ...]) -> EdgePattern:
    """The pattern of the border points of a model: mostly that of the last model of its form."""
    found: object
    if len(border) <= FEW_POINTS:
        few = first_equals(border)
        found = MESH_PLANS.get(
            ("edges", forms, few), lambda: find_pattern(model.batches, np.array(few))
        )
        assert isinstance(found, EdgePattern)
        return found
    last = ("last edges", forms)
    found = MESH_PLANS.find(last)
    if isinstance(found, EdgePattern) and found.equal.hold(border):
        return found
    columns = 0 if model.domain is None else _plain_columns(model.batches[0], model.domain)
    numbers = None if columns else equal_points(border)
    found = MESH_PLANS.get(
        ("edges", forms, columns, b"" if numbers is None else digest(numbers)),
        lambda: find_pattern(model.batches, equal_points(border) if numbers is None else numbers),
    )
    assert isinstance(found, EdgePattern)
    MESH_PLANS.put(last, found)
    return found


def _plain_columns(batch: Patches, domain: Domain) -> int:
    """M_v, the patches along v, where patches meet as the cells of a grid do, and only so; else 0.

    Neighbours have the same control points on the side between them; and all corners of the grid
    differ, so that no two other sides have both ends in common.
    """
    if not isinstance(batch, TensorPatches):
        return 0
    grid = len(domain.u) - 1, len(domain.v) - 1
    nets = batch.points.reshape(*grid, *batch.points.shape[1:])
    meet = np.array_equal(nets[:-1, :, -1], nets[1:, :, 0])
    if not (meet and np.array_equal(nets[:, :-1, :, -1], nets[:, 1:, :, 0])):
        return 0
    corners = np.empty((grid[0] + 1, grid[1] + 1, 3))
    corners[:-1, :-1], corners[-1, :-1] = nets[:, :, 0, 0], nets[-1, :, -1, 0]
    corners[:-1, -1], corners[-1, -1] = nets[:, -1, 0, -1], nets[-1, -1, -1, -1]
    number = equal_points(corners.reshape(-1, 3))
    return grid[1] if (number == np.arange(len(number))).all() else 0


def _renumbered(seams: Seams) -> Seams:
    """The seams with edges and corners in the order, and the direction, of their first sides."""
    connectivity = seams.connectivity
    _, side = np.unique(connectivity.edge, return_index=True)
    against = connectivity.backward.ravel()[side]
    curves, first = [], 0
    rank = np.empty(len(side), np.intp)
    for group in seams.curves:
        order = np.argsort(side[group.ids])
        old, new = group.ids[order], np.arange(first, first + len(order))
        rank[old] = new
        points, turned = group.points[order], against[old]
        points[turned] = points[turned, ::-1]
        weights = None if group.weights is None else group.weights[order]
        if weights is not None:
            weights[turned] = weights[turned, ::-1]
        curves.append(EdgeCurves(new, points, weights))
        first += len(order)
    stand_in, number = first_of(connectivity.corner.reshape(-1, 1).astype(np.float64))
    renumbered = Connectivity(
        counts=connectivity.counts,
        triangular=connectivity.triangular,
        edge=rank[connectivity.edge],
        backward=connectivity.backward ^ against[connectivity.edge],
        collapsed=connectivity.collapsed,
        corner=number.reshape(-1, 4),
        users=np.bincount(rank[connectivity.edge].ravel()),
        corners=connectivity.corners,
    )
    return Seams(
        renumbered,
        seams.corner_points[connectivity.corner.ravel()[stand_in]],
        tuple(curves),
    )
