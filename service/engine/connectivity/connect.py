"""Finds the seams of a model; the connectivity is cached for each pattern of equal points.

Two sides of one degree are one edge if their control points are equal, in equal or opposite order.
If sides of different degrees may be the same curve, or weights differ, the pattern does not
suffice, and `find_seams` compares coordinates.
"""

from collections.abc import Hashable
from math import dist

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.cache import MESH_PLANS
from service.engine.connectivity.degree_matching import has_near_edges
from service.engine.connectivity.edge_patterns import (
    EdgePattern,
    border_points,
    border_weights,
    find_pattern,
    number_grid_points,
)
from service.engine.connectivity.equal_points import (
    FEW_POINTS,
    find_equal_points,
    find_first_equals,
    find_projected_distance,
    find_weight_tolerance,
    find_weld_distance,
    has_near_points,
)
from service.engine.connectivity.incidence import EQUAL_WEIGHT, Connectivity, hash_arrays
from service.engine.connectivity.seams import Seams, find_seams
from service.engine.options import MAX_WELD_TOLERANCE
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, PatchModel


def connect(model: PatchModel) -> Seams:
    """The seams of a model: distinct edges and corners of all its patches.

    Edges and corners are numbered in the order of the first patches that have them, and directed as
    in these patches, so that the connectivity does not depend on coordinates.
    """
    seams = connect_if_apart(model, 0.0)
    assert seams is not None  # with tolerance 0, unequal points are never near
    return seams


def connect_if_apart(model: PatchModel, tolerance: float) -> Seams | None:
    """The seams that `connect` returns, or None if unequal points, weights or edges may be near.

    Edges of different degrees may be nearly the same curve, although only the ends of their nets
    are near. `tolerance` is `MeshOptions.weld_tolerance`.
    """
    batches = model.batches
    points = [border_points(batch) for batch in batches]
    border = points[0] if len(points) == 1 else np.concatenate(points)
    forms = tuple((isinstance(b, TrianglePatches), b.degree, b.count) for b in batches)
    distance = find_projected_distance(model, tolerance)
    pattern, is_apart = _find_pattern(model, border, forms, distance)
    if distance and not is_apart and _may_be_near(model, border, distance):
        return None
    seams = None
    if pattern.is_certain:
        weights = None
        if any(batch.weights is not None for batch in batches):
            weights = np.concatenate([border_weights(batch) for batch in batches])
        seams = pattern.build_seams(border, weights)
        if tolerance and seams is None and weights is not None:
            weight_tolerance = find_weight_tolerance(model, tolerance)
            if _are_near(weights, weight_tolerance) or pattern.has_near_weights(
                weights, weight_tolerance
            ):
                return None
    if seams is not None:
        return seams
    seams = find_seams(batches).renumber()
    if tolerance and not pattern.is_certain:
        weld_distance = find_weld_distance(model, tolerance)
        weight_tolerance = find_weight_tolerance(model, tolerance)
        if has_near_edges(seams.curves, seams.connectivity, weld_distance, weight_tolerance):
            return None
    return seams


def may_be_cut(model: PatchModel, seams: Seams) -> bool:
    """Whether open borders may be the same curve in pieces (`service.engine.joining.join`).

    The borders of several surfaces may have a curve in common; the border of a single patch has no
    curve twice. The border of a single spline may meet itself if it returns to a corner, or
    consists of two loops. An edge may run back on itself.
    """
    if may_fold(seams):
        return True
    if len(model.domains) != 1 or model.patch_count == 1:
        return model.patch_count > 1
    connectivity, (domain,) = seams.connectivity, model.domains
    if connectivity.border_returns:
        return True
    if connectivity.open_count == 2 * (len(domain.u) + len(domain.v) - 2):
        return False  # all sides on the border are open: it is one loop
    return _loops_are_near(model.batches[0], domain, connectivity)


def may_fold(seams: Seams) -> bool:
    """Whether an open edge may run back on itself, as at the end of a tube that is pinched flat.

    It does not if all legs of its control polygon have a part along the chord. An edge of a single
    patch is only examined if it ends where it begins.
    """
    connectivity = seams.connectivity
    if connectivity.has_open_loops or len(connectivity.edge) == 1:
        return connectivity.has_open_loops
    for group in seams.curves:
        rows = connectivity.open_lines[group.ids].nonzero()[0]
        if group.points.shape[1] > 2 and len(rows):
            points = group.points.take(rows, axis=0)
            legs, chord = np.diff(points, axis=1), points[:, -1:] - points[:, :1]
            if (np.vecdot(legs, chord) <= 0).any():
                return True
    return False


def _loops_are_near(batch: Patches, domain: Domain, connectivity: Connectivity) -> bool:
    """Whether a spline closes along u or v, and has two open borders whose boxes (nearly) meet."""
    assert isinstance(batch, TensorPatches)
    grid = len(domain.u) - 1, len(domain.v) - 1
    # Sides 0 and 1 are u = 0 and u = 1; sides 2 and 3 are v = 0 and v = 1.
    for first_side in (0, 2):
        # The edges on the borders u = 0 and u = 1 of the spline, or v = 0 and v = 1: shape (2, m).
        edges = connectivity.edge.reshape(*grid, 4).swapaxes(0, first_side // 2)[
            [0, -1], :, [first_side, first_side + 1]
        ]
        # If only these edges are open, the spline closes in the other direction.
        if connectivity.open_lines[edges].all() and edges.size == connectivity.open_count:
            nets = batch.points.reshape(*grid, *batch.points.shape[1:])
            # For the sides of v, exchange u and v.
            nets = nets.swapaxes(0, 1).swapaxes(2, 3) if first_side else nets
            first, last = nets[0, :, 0].reshape(-1, 3), nets[-1, :, -1].reshape(-1, 3)
            # The gap between the boxes of both borders along each axis; negative if they overlap.
            gaps = np.maximum(
                first.min(axis=0) - last.max(axis=0), last.min(axis=0) - first.max(axis=0)
            )
            return bool(gaps.max() <= MAX_WELD_TOLERANCE * batch.diagonal)
    return False


def _may_be_near(model: PatchModel, border: FloatArray, distance: float) -> bool:
    """Whether any two points of `border`, the points on all borders, may be near but not equal.

    Neighbouring patches of one spline have equal points between them, unless the spline has a gap
    there: so comparing the corners of all patches and the points on the border of the spline
    suffices.
    """
    batch, domain = model.batches[0], model.domain
    if isinstance(batch, TensorPatches) and domain is not None and model.patch_count > 1:
        grid = batch.points.reshape(len(domain.u) - 1, len(domain.v) - 1, *batch.points.shape[1:])
        lines = grid[0, :, 0], grid[-1, :, -1], grid[:, 0, :, 0], grid[:, -1, :, -1], batch.corners
        border = np.concatenate([line.reshape(-1, 3) for line in lines])
    return has_near_points(border, distance)


def _has_corners_apart(model: PatchModel, distance: float) -> bool:
    """Whether the model is one patch (p, q) whose four corners are further apart than a distance.

    Then no two of its sides are one edge, and none is a point. The distance is not 0.
    """
    batch = model.batches[0]
    if not (distance and model.patch_count == 1 and isinstance(batch, TensorPatches)):
        return False
    p, q = batch.degree
    # Every p-th row and every q-th column of control points: the four corners, in six pairs.
    (a, b), (c, d) = batch.points[0, ::p, ::q].tolist()
    return min(map(dist, (a, a, a, b, b, c), (b, c, d, c, d, d))) > distance


def _are_near(weights: FloatArray, tolerance: float) -> bool:
    """Whether two weights may be near, but differ by more than rounding.

    Weights are near if they differ by at most `tolerance` times the larger one.
    """
    ordered = np.sort(weights)
    differences, larger_weights = ordered[1:] - ordered[:-1], ordered[1:]
    return bool(
        (
            (differences > EQUAL_WEIGHT * larger_weights)
            & (differences <= tolerance * larger_weights)
        ).any()
    )


def _find_pattern(
    model: PatchModel, border: FloatArray, forms: tuple[Hashable, ...], distance: float
) -> tuple[EdgePattern, bool]:
    """The pattern of the border points of a model: usually that of the last model of equal `forms`.

    `forms` has the kind, the degree and the number of the patches of each batch. The second result
    is True if certainly no sides are edges that are equal within `distance`, but not quite equal.
    """
    pattern: object
    is_apart = _has_corners_apart(model, distance)
    if is_apart or len(border) <= FEW_POINTS:
        # Equal points that are no corners make no edges of a single patch.
        first_equals = tuple(range(len(border))) if is_apart else find_first_equals(border)
        pattern = MESH_PLANS.get(
            ("edges", forms, first_equals),
            lambda: find_pattern(model.batches, np.array(first_equals)),
        )
        assert isinstance(pattern, EdgePattern)
        return pattern, is_apart
    last_key = ("last edges", forms)
    pattern = MESH_PLANS.find(last_key)
    # The pattern of the last model is right if the same points are equal in this model.
    if isinstance(pattern, EdgePattern) and pattern.equal.fits(border, distance):
        return pattern, True
    # If patches meet like the cells of a grid, the number of its columns determines the pattern.
    batch, columns = model.batches[0], 0
    if model.domain is not None and isinstance(batch, TensorPatches):
        columns = _count_plain_columns(batch, model.domain)
    if columns and isinstance(batch, TensorPatches):
        pattern = MESH_PLANS.get(
            ("grid edges", forms, columns),
            lambda: find_pattern(model.batches, number_grid_points(batch, columns), columns),
        )
    else:
        numbers = find_equal_points(border)
        pattern = MESH_PLANS.get(
            ("edges", forms, hash_arrays(numbers)), lambda: find_pattern(model.batches, numbers)
        )
    assert isinstance(pattern, EdgePattern)
    MESH_PLANS.put(last_key, pattern)
    return pattern, False


def _count_plain_columns(batch: TensorPatches, domain: Domain) -> int:
    """The number of patches along v if patches meet exactly like the cells of a grid; else 0.

    Patches meet exactly like cells if neighbours have equal control points on the side between
    them, and if all corners of the grid differ, so that no other two sides have both ends in
    common.
    """
    grid = len(domain.u) - 1, len(domain.v) - 1
    nets = batch.points.reshape(*grid, *batch.points.shape[1:])
    meet_along_u = np.array_equal(nets[:-1, :, -1], nets[1:, :, 0])
    if not (meet_along_u and np.array_equal(nets[:, :-1, :, -1], nets[:, 1:, :, 0])):
        return 0
    corners = np.empty((grid[0] + 1, grid[1] + 1, 3))
    corners[:-1, :-1], corners[-1, :-1] = nets[:, :, 0, 0], nets[-1, :, -1, 0]
    corners[:-1, -1], corners[-1, -1] = nets[:, -1, 0, -1], nets[-1, -1, -1, -1]
    number = find_equal_points(corners.reshape(-1, 3))
    return grid[1] if (number == np.arange(len(number))).all() else 0
