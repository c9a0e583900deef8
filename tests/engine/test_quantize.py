"""Quantized meshes: shared grids, and reported bounds."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.build import build, build_scene
from service.engine.grid import CORNER, MAX_NUMBER
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import find_grid_error, find_grid_steps, quantize, quantize_mesh
from service.engine.scenes.scene import Scene
from service.surface.bezier import BezierSurface
from service.surface.examples import EXAMPLES, find
from service.surface.group import GroupSurface, Member
from service.surface.lowered import GroupModel
from tests.meshes import add_overlays, build_silo, to_single
from tests.strategies import Array

COARSE = MeshOptions(resolution=(4, 4))
EVERYTHING = MeshOptions(
    resolution=(3, 3), overlays=("control_net", "boundary"), isocurves=(2, 2), wires="tubes"
)
SQUARE = np.array([[[i, j, 0.1 * i * j] for j in range(2)] for i in range(2)], dtype=float)


def build_square(x: float = 0.0, size: float = 1.0) -> BezierSurface:
    return BezierSurface(SQUARE * size + [x, 0, 0])


def build_group(*surfaces: BezierSurface, matrix: Array | None = None) -> GroupModel:
    members = [Member(s, name=str(k), matrix=matrix) for k, s in enumerate(surfaces)]
    model = GroupSurface(tuple(members)).lower()
    assert isinstance(model, GroupModel)
    return model


def check_on_grid(mesh: Mesh) -> None:
    every = [mesh.positions, *(overlay.positions for overlay in mesh.overlays)]
    steps = np.concatenate(every).astype(np.float64) / mesh.step
    assert (steps == np.rint(steps)).all()
    assert np.ptp(steps, axis=0).max() <= MAX_NUMBER
    assert (mesh.origin / mesh.step == np.rint(mesh.origin / mesh.step)).all()


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_with_all_that_can_be_drawn_fits_its_grid(example: str) -> None:
    model = find(example).surface().lower()
    options = replace(EVERYTHING, isocurves=(0, 0)) if is_swept(example) else EVERYTHING
    if isinstance(model, GroupModel):
        built: Mesh | Scene = build_scene(model, options, single=True)
        steps = find_grid_steps(model, options)
    else:
        built, steps = build(model, options, single=True), find_grid_steps(model, options)
    on = quantize(built, model, options)
    for mesh, step in zip([on] if isinstance(on, Mesh) else on.meshes, steps, strict=True):
        assert mesh.step == step
        check_on_grid(mesh)


def is_swept(example: str) -> bool:
    return example in {"trefoil-tube", "ribbon", "hair", "tea-service"}


def test_vertices_move_by_half_a_diagonal_at_most_and_bounds_grow_by_as_much() -> None:
    model = find("utah-teapot").surface().lower()
    plain = build(model, COARSE, single=True)
    on = quantize(plain, model, COARSE)
    assert isinstance(on, Mesh)
    moved = np.linalg.norm(on.positions.astype(float) - plain.positions.astype(float), axis=1).max()
    assert 0 < moved <= CORNER * on.step <= find_grid_error(model, COARSE)
    before, after = plain.report.deviation_bound, on.report.deviation_bound
    assert before is not None
    assert after is not None
    assert before + moved <= after <= 1.001 * (before + moved)
    for old, new in zip(plain.parts, on.parts, strict=True):
        assert old.deviation_bound is not None
        assert new.deviation_bound is not None
        assert old.deviation_bound + moved <= new.deviation_bound
    assert on.report.bounds_max == tuple(on.positions.max(axis=0).astype(float).tolist())
    assert on.report.watertight == plain.report.watertight
    assert (on.triangles == plain.triangles).all()


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (4.6e6, -3e5, 1e-3), (1e9, 0.0, 0.0)])
def test_an_origin_is_rounded_to_the_grid_without_moving_positions(
    origin: tuple[float, float, float],
) -> None:
    mesh = to_single(add_overlays(build_silo(7, 2)), origin)
    on = quantize_mesh(mesh, 2.0**-15)
    check_on_grid(on)
    for old, new in zip(
        [mesh.positions, *(o.positions for o in mesh.overlays)],
        [on.positions, *(o.positions for o in on.overlays)],
        strict=True,
    ):
        apart = (new.astype(float) + on.origin) - (old.astype(float) + mesh.origin)
        assert np.abs(apart).max() <= on.step / 2 + 2.0**-52 * max(map(abs, origin))


def test_models_that_meet_have_one_grid_step() -> None:
    small, large, far = build_square(), build_square(1.0, 40.0), build_square(100.0)
    alone = [find_grid_steps(surface.lower(), COARSE)[0] for surface in (small, large, far)]
    assert alone[0] == alone[2] < alone[1]
    assert find_grid_steps(build_group(small, large, far), COARSE) == (alone[1], alone[1], alone[2])
    # A member in front of a part of the large one does not share an edge with it.
    before = build_square(20.0)
    assert find_grid_steps(build_group(before, large), COARSE) == (alone[0], alone[1])
    # A chain of neighbours: each meets the next.
    chain = find_grid_steps(build_group(small, large, build_square(41.0)), COARSE)
    assert chain == (alone[1],) * 3


def test_a_model_of_two_places_ties_those_of_both() -> None:
    """A stands with B here and with C there: all three have the step of the coarsest."""
    a, b, c, there = (
        build_square(),
        build_square(1.0),
        build_square(1.0, 300.0),
        np.diag([1.0, 1, 1, 1]),
    )
    there[0, 3] = 1000.0
    members = (
        Member(a, name="a"),
        Member(b, name="b"),
        Member(a, name="a again", matrix=there),
        Member(c, name="c", matrix=there),
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
    on = quantize(build_scene(model, COARSE, single=True), model, COARSE)
    assert isinstance(on, Scene)
    one, other = on.meshes
    assert one.step == other.step
    rows = [{tuple(row) for row in (mesh.positions + mesh.origin).tolist()} for mesh in on.meshes]
    assert len(rows[0] & rows[1]) == 5
