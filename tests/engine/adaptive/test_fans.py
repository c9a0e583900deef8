"""Fans: leaves with a vertex in the middle, in place of two triangles."""

import numpy as np
import pytest

from service.engine.adaptive.cutting.cells import Leaves, Task, build_whole_cells
from service.engine.adaptive.cutting.heights import measure_fans
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.limits import MeshLimits
from service.engine.adaptive.refine import replace_failing
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.nets.patch_nets import PatchNets
from tests.engine.adaptive.bordering import build_border
from tests.engine.adaptive.refining import build_refined, check_refined
from tests.strategies import Array, build_model


def build_quadratic(a: float, b: float, mixed: float = 0.0) -> Array:
    """The net of z = 4 (a u (1 − u) + b v (1 − v)) + mixed u v over the unit square.

    a and b are the heights of the middles of its sides along u and along v over their chords.
    """
    u, v = np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], indexing="ij")
    height = 2.0 * (a * (u == 0.5) + b * (v == 0.5)) + mixed * u * v
    return np.stack([u, v, height], axis=-1)


def evaluate_quadratic(a: float, b: float, mixed: float, u: Array, v: Array) -> Array:
    """Points (m, 3) of the surface of `build_quadratic`."""
    return np.stack([u, v, 4 * (a * u * (1 - u) + b * v * (1 - v)) + mixed * u * v], axis=-1)


def divide_patch(net: Array, tolerance: float) -> tuple[Task, Leaves]:
    """The leaves of a single patch."""
    model = build_model([net])
    faces = build_border(model, Goal(tolerance)).faces
    task = Task(PatchNets.of(model), faces, Goal(tolerance), MeshLimits())
    return task, divide_cells(task, build_whole_cells(faces))


@pytest.mark.parametrize("shape", [(1, 1, 0), (0.2, 1, 0.3), (1, -0.6, 0), (0.1, 0.1, 2)])
def test_heights_over_fans_are_those_of_dense_samples(shape: tuple[float, float, float]) -> None:
    """The cells are quadratic and nearly flat, so their normals hardly turn."""
    a, b, mixed = np.array(shape) * 1e-4
    halves = np.array([0.0, 0.5, 1.0])
    u, v = (grid.ravel() for grid in np.meshgrid(halves, halves, indexing="ij"))
    nine_points = evaluate_quadratic(a, b, mixed, u, v)
    (result,) = measure_fans(nine_points[..., np.newaxis], two_sided=False)
    corners, middle = nine_points[[0, 6, 8, 2]], nine_points[4]
    s, t = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, 65), np.linspace(0, 1, 65)))
    s, t = s[s + t <= 1], t[s + t <= 1]
    largest = 0.0
    for k in range(4):
        begin, end = corners[k], corners[(k + 1) % 4]
        normal = np.cross(end - begin, middle - begin)
        # Points of the triangle, and the points of the surface above or below them.
        flat = begin + s[:, np.newaxis] * (end - begin) + t[:, np.newaxis] * (middle - begin)
        points = evaluate_quadratic(a, b, mixed, flat[:, 0], flat[:, 1])
        heights = (points - begin) @ normal / np.linalg.norm(normal)
        largest = max(largest, float(np.abs(heights).max()))
    assert result == pytest.approx(largest, rel=1e-3)


def test_a_cell_that_bends_alike_in_both_directions_becomes_a_fan() -> None:
    """Heights over sides are 0.01, over diagonals 0.02; a fan must be near enough only to sides.

    If the cell is divided into four, these heights are a quarter.
    """
    net = build_quadratic(0.01, 0.01)
    for tolerance, leaves, fans in ((0.021, 1, 0), (0.016, 1, 1), (0.006, 4, 0)):
        _, result = divide_patch(net, tolerance)
        assert (len(result), int(result.is_fan.sum())) == (leaves, fans)


def test_a_saddle_of_equal_and_opposite_bends_has_no_fan() -> None:
    """A fan is as far from the saddle as two triangles are."""
    for tolerance in np.geomspace(1e-4, 0.01, 9):
        assert not divide_patch(build_quadratic(0.01, -0.01), tolerance)[1].is_fan.any()


def test_a_cell_is_not_a_fan_if_the_border_has_a_vertex_that_halves_it() -> None:
    """The sides on the border are 0.8 tolerances high. Above 0.7 (`CURVE_SHARE`) sides are divided,
    so a cut of the cell adds no vertex to them."""
    assert not divide_patch(build_quadratic(0.01, 0.01), 0.0125)[1].is_fan.any()


def test_a_fan_has_one_triangle_for_each_piece_of_its_boundary() -> None:
    refined = build_refined(build_model([build_quadratic(0.01, 0.01)]), Goal(0.016))
    check_refined(refined, 0.016)
    built = refined.triangulation
    middle = np.flatnonzero((built.u == SPAN // 2) & (built.v == SPAN // 2))
    assert len(middle) == 1
    assert (built.triangles == middle).any(axis=1).all()
    assert len(built.triangles) == len(built.u) - 1


def test_leaves_that_fail_become_fans_once_and_are_halved_then() -> None:
    """Only leaves of two triangles become fans, and only where a fan may be near enough."""
    task, whole = divide_patch(build_quadratic(0.01, 0.01), 0.021)
    # `is_plain` marks leaves of two triangles. The one leaf here, `whole`, is treated as failing.
    is_plain, along_v = np.ones(1, dtype=bool), np.zeros(1, dtype=bool)
    fan = replace_failing(task, whole, along_v, is_plain)
    assert fan.is_fan.tolist() == [True]
    assert fan.rectangle.tolist() == whole.rectangle.tolist()
    assert len(replace_failing(task, fan, along_v, is_plain)) == 2
    assert len(replace_failing(task, whole, along_v, ~is_plain)) == 2
    # Over the sides along u heights are 0.02, for a fan as for two triangles.
    task, whole = divide_patch(build_quadratic(0.02, 0.0), 0.021)
    whole.form[6] = 0.019  # the allowed deviation
    assert len(replace_failing(task, whole, along_v, is_plain)) == 2
