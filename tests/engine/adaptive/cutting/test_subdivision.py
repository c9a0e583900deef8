"""Cells: cut only where the surface bends, and in the direction in which it bends."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engine.adaptive.cutting.cells import (
    Cells,
    Leaves,
    Task,
    build_quadratic_matrix,
    build_whole_cells,
    elevate,
    evaluate_nine_points,
    halve,
    restrict,
)
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.faces import SPAN, find_faces
from service.engine.bounds.goal import Goal
from service.engine.bounds.patch_nets import Nets, PatchNets
from service.engine.mesh.seams import find_seams
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.oracles.exact import surface_point, to_exact_net
from tests.strategies import Array, build_model, nets, weighted_nets


def build_task(model: PatchModel, goal: Goal) -> Task:
    faces = find_faces(model, find_seams(model.batches))
    return Task(PatchNets.of(model), faces, goal, MeshLimits())


def build_leaves(model: PatchModel, goal: Goal) -> Leaves:
    task = build_task(model, goal)
    return divide_cells(task, build_whole_cells(task.faces))


def count_cuts(leaves: Leaves) -> tuple[int, int]:
    """Numbers of different places along u and along v at which leaves begin."""
    return len(np.unique(leaves.box[0])), len(np.unique(leaves.box[2]))


@given(nets(), st.sampled_from([0, 1]), st.integers(1, 7), st.integers(0, 6))
def test_nets_of_pieces_are_the_same_surface(net: Array, axis: int, end: int, begin: int) -> None:
    """Compares halved, restricted and elevated nets with exact points."""
    last, zero = np.moveaxis(net[None], 0, -1), np.zeros(1, dtype=np.intp)
    low, high = min(begin, end - 1) / 8, (end + 1) / 8
    both = np.empty((*last.shape[:3], 2, last.shape[3]))
    halve(last, axis, both)
    pieces = [(0.0, 0.5, both[..., 0, :]), (0.5, 1.0, both[..., 1, :])]
    box = np.array([[0], [SPAN], [0], [SPAN]])
    box[2 * axis : 2 * axis + 2] = [[int(low * SPAN)], [int(high * SPAN)]]
    piece = restrict(Nets(zero, last), zero, Cells(zero, box))
    pieces.append((low, high, piece))
    exact = to_exact_net(net)
    for start, stop, piece in pieces:
        for i, row in enumerate(evaluate_nine_points(elevate(piece))):
            for j, place in enumerate(row):
                at = [i / 2, j / 2]
                at[axis] = start + (stop - start) * at[axis]
                true = [float(x) for x in surface_point(exact, *map(Fraction, at))]
                assert place[:, 0] == pytest.approx(true, abs=1e-12 * (1 + np.abs(net).max()))


def test_the_net_of_a_quadratic_follows_from_three_points() -> None:
    """The net may be elevated to any degree."""
    for degree in (2, 3, 7):
        net = np.array([1.0, -3.0, 2.0])
        values = np.array([1.0, (1.0 - 6.0 + 2.0) / 4, 2.0])
        while len(net) <= degree:
            n = len(net)
            share = np.arange(1, n) / n
            net = np.concatenate([[net[0]], share * net[:-1] + (1 - share) * net[1:], [net[-1]]])
        assert build_quadratic_matrix(degree) @ values == pytest.approx(net, abs=1e-14)


@given(weighted_nets(), st.sampled_from([2.0, 0.3]))
@settings(max_examples=10)
def test_leaves_cover_the_face(net: tuple[Array, Array | None], tolerance: float) -> None:
    """Leaves cover the face once, exactly, and in order."""
    points, weights = net
    leaves = build_leaves(
        build_model([points], None if weights is None else [weights]), Goal(tolerance)
    )
    u0, u1, v0, v1 = leaves.box.astype(object)
    assert sum((u1 - u0) * (v1 - v0)) == SPAN**2
    order = list(zip(u0, v0, strict=True))
    assert order == sorted(set(order))


def build_parabola(along: Array) -> Array:
    """A net (3, n, 3) that is bent along u, 1/100 high, with these parameters along v."""
    u = np.array([0.0, 0.5, 1.0])[:, None] + 0 * along
    return np.stack([u, along + 0 * u, 0.04 * u * (1 - u) * 2], axis=-1)


@pytest.mark.parametrize("along", [[0.0, 1.0], [0.0, 0.1, 0.2, 1.0], [0.0, 0.9, 0.95, 1.0, 1.0]])
def test_cells_are_cut_only_where_they_bend(along: list[float]) -> None:
    """Cells are cut k times, until the height h / 4^k is small enough, for any parametrisation
    along the lines."""
    net = build_parabola(np.array(along))
    for halvings in range(5):
        for share, more in ((1.1, 0), (0.9, 1)):
            goal = Goal(share * 0.01 * 0.25**halvings)
            pieces = 2 ** (halvings + more)
            assert count_cuts(build_leaves(build_model([net]), goal)) == (pieces, 1)
            assert count_cuts(build_leaves(build_model([net.swapaxes(0, 1)]), goal)) == (1, pieces)


def test_flat_spans_stay_together() -> None:
    """The flat spans around a bump of 4 of 60 × 40 spans, and beyond a bend, are few cells."""
    u, v = np.meshgrid(np.arange(63.0), np.arange(43.0), indexing="ij")
    flat = BsplineSurface(np.stack([u, v, 0 * u], -1), (3, 3), ("clamped", "clamped")).lower()
    assert len(build_leaves(flat, Goal(1e-6))) == 1
    net = np.stack([u, v, np.where((u == 40) & (v == 11), 3.0, 0.0)], axis=-1)
    bump = BsplineSurface(net, (3, 3), ("clamped", "clamped")).lower()
    leaves = build_leaves(bump, Goal(0.01))
    size = np.prod(leaves.box[1::2] - leaves.box[::2], axis=0, dtype=float)
    assert len(leaves) < 400
    assert size.max() > 100.0 * SPAN**2
