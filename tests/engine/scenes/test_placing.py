"""Effects of placements on distances, compared with exact arithmetic, and on bounds of meshes."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.mesh.mesh import Mesh
from service.engine.scenes.flattening import flatten
from service.engine.scenes.placing import bound_placing_error, place_points
from service.engine.scenes.scene import arrange, round_to_single, scene_parts
from service.engine.stored_positions import bound_single_error
from service.surface.lowered import GroupModel, PlacedModel
from tests.strategies import Array, placements
from tools.meshes import build_silo

# A quarter turn about z, scaled by 2.
TURN = np.array([[0.0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 1], [0, 0, 0, 1]])
SHEAR = np.array([[1.0, 0, 0, 0], [3, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def place_exactly(matrix: Array, point: Array) -> list[Fraction]:
    """L x + t without rounding."""
    row = [Fraction(x) for x in (*point.tolist(), 1.0)]
    return [
        sum((Fraction(a) * x for a, x in zip(line, row, strict=True)), Fraction(0))
        for line in matrix[:3].tolist()
    ]


def measure_distance(first: list[Fraction], second: list[Fraction]) -> float:
    """The distance of two points; only the square root is rounded."""
    return math.sqrt(sum((a - b) ** 2 for a, b in zip(first, second, strict=True)))


@given(placements(), st.integers(0, 2**32))
def test_a_computed_copy_is_within_the_bound_of_the_exact_copy(matrix: Array, seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-3, 5, (8, 3))
    copies = place_points(points, matrix)
    error = bound_placing_error(matrix, points.min(axis=0), points.max(axis=0))
    for point, copy in zip(points, copies, strict=True):
        assert (
            measure_distance(place_exactly(matrix, point), [Fraction(x) for x in copy.tolist()])
            <= error
        )


@given(st.integers(0, 2**32), st.floats(-4, 6), st.booleans())
def test_rounding_to_float32_is_bounded(seed: int, exponent: float, is_local: bool) -> None:
    """The points are about 10 to the power `exponent` away from zero."""
    points = np.random.default_rng(seed).normal(size=(9, 3)) + 10**exponent
    low, high = points.min(axis=0), points.max(axis=0)
    origin = low.astype(np.float32).astype(np.float64) if is_local else np.zeros(3)
    error = bound_single_error(low, high, origin)
    stored = (points - origin).astype(np.float32)
    for point, row in zip(points.tolist(), stored.astype(np.float64).tolist(), strict=True):
        restored = [Fraction(x) + Fraction(o) for x, o in zip(row, origin.tolist(), strict=True)]
        assert measure_distance([Fraction(x) for x in point], restored) <= error
    assert error < 1e-6 * float(np.abs(points - origin).max()) + 1e-12


def build_mesh_with_bounds(bound: float | None, mesh_bound: float | None = None) -> Mesh:
    """A mesh with these deviation bounds; its three parts have `bound`, `bound`/2 and `bound`/3."""
    mesh = build_silo()
    parts = tuple(
        replace(part, deviation_bound=None if bound is None else bound / (k + 1))
        for k, part in enumerate(mesh.parts)
    )
    report = replace(mesh.report, deviation_bound=bound, mesh_deviation_bound=mesh_bound)
    return replace(mesh, parts=parts, report=report)


def build_group(*matrices: Array | None) -> GroupModel:
    members = tuple(PlacedModel(f"m{k}", 0, matrix=matrix) for k, matrix in enumerate(matrices))
    return GroupModel("group", (), members)


def test_bounds_grow_with_the_largest_scaling() -> None:
    scene = arrange(build_group(None, TURN, SHEAR), (build_mesh_with_bounds(0.25, 0.5),))
    stretch = np.linalg.norm(SHEAR[:3, :3], 2)
    assert stretch > 3
    assert scene.report.deviation_bound is not None
    assert scene.report.mesh_deviation_bound is not None
    np.testing.assert_allclose(scene.report.deviation_bound, 0.25 * stretch, rtol=1e-9)
    np.testing.assert_allclose(scene.report.mesh_deviation_bound, 0.5 * stretch, rtol=1e-9)
    # The bound of the scene includes the rounding of copies.
    assert scene.report.deviation_bound > 0.25 * stretch
    parts = scene_parts(scene)
    result = [part.deviation_bound for part in parts]
    expected = [0.25 * s / (k + 1) for s in (1.0, 2.0, float(stretch)) for k in range(3)]
    np.testing.assert_allclose(np.array(result, dtype=float), expected, rtol=1e-9)
    assert [part.name for part in parts][:4] == ["m0/base", "m0/wall", "m0/roof", "m1/base"]
    # The first copy has no placement, so its bound keeps its bits.
    assert result[0] == 0.25


def test_flattening_keeps_bounds_and_rounding_to_float32_increases_them() -> None:
    scene = arrange(build_group(TURN, None), (build_mesh_with_bounds(0.25),))
    flat = flatten(scene)
    assert flat.report.deviation_bound == scene.report.deviation_bound
    bounds = [part.deviation_bound for part in flat.parts]
    assert bounds == [part.deviation_bound for part in scene_parts(scene)]
    rounded = round_to_single(flat)
    single_bound = rounded.report.deviation_bound
    assert single_bound is not None
    assert flat.report.deviation_bound is not None
    assert 0 < single_bound - flat.report.deviation_bound < 1e-6
    assert all(
        part.deviation_bound is not None and 0 < part.deviation_bound - bound < 1e-6
        for part, bound in zip(rounded.parts, bounds, strict=True)
        if bound is not None
    )


def test_a_scene_has_no_bound_if_a_copy_has_no_bound() -> None:
    models = (build_mesh_with_bounds(0.25), build_mesh_with_bounds(None))
    members = (PlacedModel("a", 0), PlacedModel("b", 1))
    scene = arrange(GroupModel("group", (), members), models)
    assert scene.report.deviation_bound is None
    assert [part.deviation_bound is None for part in scene_parts(scene)] == [False] * 3 + [True] * 3
