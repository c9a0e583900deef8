"""Quantized meshes: the grids that neighbours share, and the reported bounds."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.build import build, build_scene
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import find_grid_error, find_grid_steps, quantize, quantize_mesh
from service.engine.scenes.scene import Scene
from service.engine.stored_positions import MAX_NUMBER, MAX_ROUNDING
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel
from service.surface.member import Member
from tests.strategies import Array
from tools.examples import UNTRIMMED
from tools.meshes import add_overlays, build_silo, to_single

COARSE = MeshOptions(resolution=(4, 4))
WITH_LINES = MeshOptions(
    resolution=(3, 3), overlays=("control_net", "boundary"), isocurves=(2, 2), wires="tubes"
)
SQUARE = np.array([[[i, j, 0.1 * i * j] for j in range(2)] for i in range(2)], dtype=float)


def build_square(x: float = 0.0, size: float = 1.0) -> BezierSurface:
    """A nearly flat square of this size, from x along the x axis."""
    return BezierSurface(SQUARE * size + [x, 0, 0])


def build_group(*surfaces: BezierSurface, matrix: Array | None = None) -> GroupModel:
    """The lowered group of these surfaces, all with one placement."""
    members = [Member(s, name=str(k), matrix=matrix) for k, s in enumerate(surfaces)]
    model = GroupSurface(tuple(members)).lower()
    assert isinstance(model, GroupModel)
    return model


def check_on_grid(mesh: Mesh) -> None:
    """Checks that all positions and the origin are multiples of the step, numbered by 16 bits."""
    arrays = [mesh.positions, *(overlay.positions for overlay in mesh.overlays)]
    steps = np.concatenate(arrays).astype(np.float64) / mesh.step
    assert (steps == np.rint(steps)).all()
    assert np.ptp(steps, axis=0).max() <= MAX_NUMBER
    assert (mesh.origin / mesh.step == np.rint(mesh.origin / mesh.step)).all()


@pytest.mark.parametrize("example", UNTRIMMED)
def test_every_example_with_overlays_and_wires_fits_its_grid(example: str) -> None:
    model = find(example).surface().lower()
    options = replace(WITH_LINES, isocurves=(0, 0)) if is_swept(example) else WITH_LINES
    if isinstance(model, GroupModel):
        mesh_or_scene: Mesh | Scene = build_scene(model, options, is_float32=True)
    else:
        mesh_or_scene = build(model, options, is_float32=True)
    quantized = quantize(mesh_or_scene, model, options)
    meshes = [quantized] if isinstance(quantized, Mesh) else quantized.meshes
    for mesh, step in zip(meshes, find_grid_steps(model, options), strict=True):
        assert mesh.step == step
        check_on_grid(mesh)


def is_swept(example: str) -> bool:
    """Whether the example has sweeps, which have no isoparametric curves."""
    return example in {"trefoil-tube", "ribbon", "hair", "tea-service"}


def test_vertices_move_by_at_most_half_a_cell_diagonal_and_bounds_grow_by_the_movement() -> None:
    model = find("utah-teapot").surface().lower()
    plain = build(model, COARSE, is_float32=True)
    quantized = quantize(plain, model, COARSE)
    assert isinstance(quantized, Mesh)
    largest_movement = np.linalg.norm(
        quantized.positions.astype(float) - plain.positions.astype(float), axis=1
    ).max()
    assert 0 < largest_movement <= MAX_ROUNDING * quantized.step <= find_grid_error(model, COARSE)
    plain_bound, bound = plain.report.deviation_bound, quantized.report.deviation_bound
    assert plain_bound is not None
    assert bound is not None
    assert plain_bound + largest_movement <= bound <= 1.001 * (plain_bound + largest_movement)
    for old, new in zip(plain.parts, quantized.parts, strict=True):
        assert old.deviation_bound is not None
        assert new.deviation_bound is not None
        assert old.deviation_bound + largest_movement <= new.deviation_bound
    assert quantized.report.bounds_max == tuple(
        quantized.positions.max(axis=0).astype(float).tolist()
    )
    assert quantized.report.watertight == plain.report.watertight
    assert (quantized.triangles == plain.triangles).all()


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (4.6e6, -3e5, 1e-3), (1e9, 0.0, 0.0)])
def test_an_origin_is_rounded_to_the_grid_without_moving_positions(
    origin: tuple[float, float, float],
) -> None:
    mesh = to_single(add_overlays(build_silo(7, 2)), origin)
    quantized = quantize_mesh(mesh, 2.0**-15)
    check_on_grid(quantized)
    for old, new in zip(
        [mesh.positions, *(o.positions for o in mesh.overlays)],
        [quantized.positions, *(o.positions for o in quantized.overlays)],
        strict=True,
    ):
        movement = (new.astype(float) + quantized.origin) - (old.astype(float) + mesh.origin)
        assert np.abs(movement).max() <= quantized.step / 2 + 2.0**-52 * max(map(abs, origin))


def test_models_that_meet_have_equal_grid_steps() -> None:
    """Models meet if patches of theirs have a corner in common."""
    small, large, far = build_square(), build_square(1.0, 40.0), build_square(100.0)
    separate_steps = [
        find_grid_steps(surface.lower(), COARSE)[0] for surface in (small, large, far)
    ]
    assert separate_steps[0] == separate_steps[2] < separate_steps[1]
    assert find_grid_steps(build_group(small, large, far), COARSE) == (
        separate_steps[1],
        separate_steps[1],
        separate_steps[2],
    )
    # A square inside the large square has no corner in common with it.
    inner_square = build_square(20.0)
    assert find_grid_steps(build_group(inner_square, large), COARSE) == (
        separate_steps[0],
        separate_steps[1],
    )
    # In a chain of neighbours, each square meets the next square.
    chain = find_grid_steps(build_group(small, large, build_square(41.0)), COARSE)
    assert chain == (separate_steps[1],) * 3


def test_copies_of_one_model_connect_the_neighbours_of_both_places() -> None:
    """A copy of A meets B, another copy meets C: all three get the largest of their steps."""
    a, b, c = build_square(), build_square(1.0), build_square(1.0, 300.0)
    far_placement = np.eye(4)
    far_placement[0, 3] = 1000.0
    members = (
        Member(a, name="a"),
        Member(b, name="b"),
        Member(a, name="a again", matrix=far_placement),
        Member(c, name="c", matrix=far_placement),
    )
    model = GroupSurface(members).lower()
    assert isinstance(model, GroupModel)
    steps = find_grid_steps(model, COARSE)
    assert len(steps) == 3
    assert len(set(steps)) == 1
    assert steps[0] == find_grid_steps(c.lower(), COARSE)[0]


def test_neighbours_of_a_group_still_meet_bit_for_bit() -> None:
    rng = np.random.default_rng(3)
    left = rng.uniform(-1, 1, (4, 4, 3))
    right = rng.uniform(-1, 1, (4, 4, 3)) * 7
    right[0] = left[-1]
    model = build_group(BezierSurface(left), BezierSurface(right))
    quantized = quantize(build_scene(model, COARSE, is_float32=True), model, COARSE)
    assert isinstance(quantized, Scene)
    left_mesh, right_mesh = quantized.meshes
    assert left_mesh.step == right_mesh.step
    rows = [
        {tuple(row) for row in (mesh.positions + mesh.origin).tolist()} for mesh in quantized.meshes
    ]
    assert len(rows[0] & rows[1]) == 5  # the vertices of the common edge, which has 4 divisions
