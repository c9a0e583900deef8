"""Cells: cut only where the surface bends, and in the direction in which it bends."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles.exact import surface_point, to_exact_net
from service.engine.adaptive.cutting.cells import (
    FaceCells,
    Leaves,
    Task,
    build_quadratic_matrix,
    build_whole_cells,
    elevate_to_quadratics,
    evaluate_nine_points,
    restrict_to_cells,
)
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.faces import SPAN, find_faces
from service.engine.bounds.goal import Goal
from service.engine.connectivity.seams import find_seams
from service.engine.nets.nets import Nets
from service.engine.nets.patch_nets import PatchNets
from service.engine.nets.subdivision import halve
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.strategies import Array, build_model, nets, weighted_nets


def build_task(model: PatchModel, goal: Goal) -> Task:
    faces = find_faces(model, find_seams(model.batches))
    return Task(PatchNets.of(model), faces, goal, MeshLimits())


def build_leaves(model: PatchModel, goal: Goal) -> Leaves:
    task = build_task(model, goal)
    return divide_cells(task, build_whole_cells(task.faces))


def count_cuts(leaves: Leaves) -> tuple[int, int]:
    """Numbers of different places along u and along v at which leaves begin."""
    return len(np.unique(leaves.rectangle[0])), len(np.unique(leaves.rectangle[2]))


@given(nets(), st.sampled_from([0, 1]), st.sets(st.integers(0, 8), min_size=2, max_size=2))
def test_nets_of_cells_are_the_same_surface(net: Array, axis: int, eighths: set[int]) -> None:
    """Compares halved, restricted and elevated nets with exact points.

    A cell is the interval between two eighths of one parameter, and all of the other parameter.
    """
    nets_of_cells, zero = net[..., np.newaxis], np.zeros(1, dtype=np.intp)
    low, high = sorted(k / 8 for k in eighths)
    halved = np.empty((*net.shape, 2, 1))  # the nets of both halves
    halve(nets_of_cells, axis, halved)
    box = np.array([[0], [SPAN], [0], [SPAN]])
    box[2 * axis : 2 * axis + 2] = [[int(low * SPAN)], [int(high * SPAN)]]
    cell = restrict_to_cells(Nets(zero, nets_of_cells), zero, FaceCells(box, zero))
    exact = to_exact_net(net)
    halves = [(0.0, 0.5, halved[..., 0, :]), (0.5, 1.0, halved[..., 1, :])]
    for begin, end, built in [*halves, (low, high, cell)]:
        for i, row in enumerate(evaluate_nine_points(elevate_to_quadratics(built))):
            for j, point in enumerate(row):
                at = [i / 2, j / 2]
                at[axis] = begin + (end - begin) * at[axis]
                true = [float(x) for x in surface_point(exact, *map(Fraction, at))]
                assert point[:, 0] == pytest.approx(true, abs=1e-12 * (1 + np.abs(net).max()))


def test_the_net_of_a_quadratic_follows_from_three_points() -> None:
    """The values at 0, ½ and 1 give the net of the quadratic, also elevated to a higher degree."""
    for degree in (2, 3, 7):
        net = np.array([1.0, -3.0, 2.0])
        values = np.array([1.0, (1.0 - 6.0 + 2.0) / 4, 2.0])
        while len(net) <= degree:
            # One elevation, from degree n − 1 to n.
            n = len(net)
            t = np.arange(1, n) / n
            net = np.concatenate([[net[0]], t * net[:-1] + (1 - t) * net[1:], [net[-1]]])
        assert build_quadratic_matrix(degree) @ values == pytest.approx(net, abs=1e-14)


@given(weighted_nets(), st.sampled_from([2.0, 0.3]))
@settings(max_examples=10)
def test_leaves_cover_the_face(net: tuple[Array, Array | None], tolerance: float) -> None:
    """Leaves cover the face once, exactly, and in order."""
    points, weights = net
    leaves = build_leaves(
        build_model([points], None if weights is None else [weights]), Goal(tolerance)
    )
    u0, u1, v0, v1 = leaves.rectangle.astype(object)
    assert sum((u1 - u0) * (v1 - v0)) == SPAN**2
    order = list(zip(u0, v0, strict=True))
    assert order == sorted(set(order))


def build_parabola(along: Array) -> Array:
    """A net (3, n, 3) that is bent along u, 1/100 high; `along` are its coordinates along v."""
    u, y = np.meshgrid([0.0, 0.5, 1.0], along, indexing="ij")
    return np.stack([u, y, 0.02 * (u == 0.5)], axis=-1)


@pytest.mark.parametrize("along", [[0.0, 1.0], [0.0, 0.1, 0.2, 1.0], [0.0, 0.9, 0.95, 1.0, 1.0]])
def test_cells_are_cut_only_where_they_bend(along: list[float]) -> None:
    """Cells are cut k times, until their height 0.01 / 4^k is below the tolerance, for any
    parametrisation of the straight direction."""
    net = build_parabola(np.array(along))
    for halvings in range(5):
        # A tolerance slightly above the height after these halvings, and one slightly below it.
        for factor, extra_halvings in ((1.1, 0), (0.9, 1)):
            goal = Goal(factor * 0.01 * 0.25**halvings)
            pieces = 2 ** (halvings + extra_halvings)
            assert count_cuts(build_leaves(build_model([net]), goal)) == (pieces, 1)
            assert count_cuts(build_leaves(build_model([net.swapaxes(0, 1)]), goal)) == (1, pieces)


def test_flat_spans_stay_together() -> None:
    """A plane of 60 × 40 spans is one cell; around a bump of 4 × 4 spans there are few cells."""
    u, v = np.meshgrid(np.arange(63.0), np.arange(43.0), indexing="ij")
    flat = BsplineSurface(np.stack([u, v, 0 * u], -1), (3, 3), ("clamped", "clamped")).lower()
    assert len(build_leaves(flat, Goal(1e-6))) == 1
    net = np.stack([u, v, np.where((u == 40) & (v == 11), 3.0, 0.0)], axis=-1)
    bump = BsplineSurface(net, (3, 3), ("clamped", "clamped")).lower()
    leaves = build_leaves(bump, Goal(0.01))
    size = np.prod(leaves.extents, axis=0, dtype=float)
    assert len(leaves) < 400
    assert size.max() > 100.0 * SPAN**2
