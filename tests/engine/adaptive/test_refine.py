"""Triangulations cover the faces, are closed and within the tolerance, and do not depend on other
faces."""

from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engine.adaptive.cutting.cells import SHORTEST, FaceCells
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.refine import triangulate
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.engine.nets.patch_nets import PatchNets
from service.errors import InvalidRequest, TooLarge
from service.surface.bspline import BsplineSurface
from tests.engine.adaptive.bordering import build_border
from tests.engine.adaptive.refining import build_refined, check_refined
from tests.strategies import (
    Array,
    build_model,
    degenerate_nets,
    split_models,
    translate,
    weighted_nets,
)
from tools.examples import lower_patches

tolerances = st.sampled_from([4.0, 1.0, 0.2])


@given(weighted_nets(), tolerances)
@settings(max_examples=10)
def test_patches_are_covered(net: tuple[Array, Array | None], tolerance: float) -> None:
    """Random polynomial and rational patches."""
    points, weights = net
    model = build_model([points], None if weights is None else [weights])
    check_refined(build_refined(model, Goal(tolerance)), tolerance)


@given(degenerate_nets(), tolerances, st.booleans())
def test_refinement_of_degenerate_patches_ends(net: Array, tolerance: float, strict: bool) -> None:
    """Patches with poles and folds, lines and points; also with `angle_tolerance` and
    `two_sided`."""
    goal = Goal(tolerance, 0.5, two_sided=True) if strict else Goal(tolerance)
    check_refined(build_refined(build_model([net]), goal), tolerance)


@given(split_models(), tolerances, st.randoms(use_true_random=False))
@settings(max_examples=6)
def test_triangles_of_a_face_do_not_depend_on_other_faces(
    split: tuple[Array, list[Array]], tolerance: float, random: Random
) -> None:
    """A face has the same triangles, bit for bit, alone and with others, in any order."""
    patches = split[1]
    goal = Goal(tolerance)
    together = build_refined(build_model(patches), goal)
    check_refined(together, tolerance)
    order = list(range(len(patches)))
    random.shuffle(order)
    shuffled = build_refined(build_model([patches[k] for k in order]), goal)
    for row, k in enumerate(order):
        assert together.list_face_bytes(k) == shuffled.list_face_bytes(row)
        assert together.list_face_bytes(k) == build_refined(
            build_model([patches[k]]), goal
        ).list_face_bytes(0)


@pytest.mark.parametrize(
    ("name", "share", "triangles"),
    [("sphere", 1e-2, 320), ("torus", 1e-2, 432), ("utah-teapot", 1e-2, 518), ("cone", 1e-3, 128)],
)
def test_examples_are_closed_and_take_few_triangles(
    name: str, share: float, triangles: int
) -> None:
    """Examples with tolerances relative to their size, and the most triangles that they may
    take."""
    model = lower_patches(name)
    tolerance = share * float(np.linalg.norm(model.bounds[1] - model.bounds[0]))
    result = build_refined(model, Goal(tolerance))
    check_refined(result, tolerance)
    assert len(result.triangulation.triangles) <= triangles


def test_a_ring_of_equal_leaves_is_cut_in_few_rounds() -> None:
    """Leaves that fail are cut between vertices that they have already.

    Otherwise each cut would add a vertex to the next leaf of the ring, which would fail one round
    later. New vertices are stored in each round; those of the border are stored before.
    """
    stored: list[int] = []

    def store(positions: Array) -> Array:
        stored.append(len(positions))
        return positions

    model = lower_patches("nurbs-goblet")
    goal = Goal(1e-3 * float(np.linalg.norm(model.bounds[1] - model.bounds[0])))
    build_refined(model, goal, store=store)
    assert 1 < len(stored) <= 1 + 4


def test_triangles_are_smaller_near_the_eye() -> None:
    """With a camera, the allowed deviation grows with the distance from its eye."""
    rng = np.random.default_rng(5)
    u, v = np.meshgrid(np.linspace(0, 10, 14), np.linspace(0, 2, 6), indexing="ij")
    net = np.stack([u, v, 0.3 * rng.uniform(-1, 1, u.shape)], axis=-1)
    model = BsplineSurface(net, (3, 3), ("clamped", "clamped")).lower()
    view = View(np.array([-1.0, 1.0, 0.5]), rate=2e-3, near=0.1)
    result = build_refined(model, Goal(1.0, view=view))
    built = result.triangulation
    middles = built.positions[built.vertex[built.triangles], 0].mean(axis=1)
    near, far = (middles < 2).sum(), (middles > 8).sum()
    assert near > 2 * far
    farthest = np.linalg.norm(built.positions[built.vertex[built.triangles]], axis=2).max(axis=1)
    # The eye is 1.5 from the origin, so no vertex is further from it than farthest + 1.5.
    assert (built.bounds <= 2e-3 * (farthest + 1.5)).all()


def test_bounds_are_those_of_stored_positions() -> None:
    """Far from the origin float32 moves vertices by more than the deviation of the surface."""
    net = translate(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]), 4096.3)
    model = build_model([net])
    exact = build_refined(model, Goal(0.01))
    rounded = build_refined(
        model, Goal(0.01), store=lambda x: x.astype(np.float32).astype(np.float64)
    )
    assert exact.triangulation.bounds.max() < 1e-10
    assert 1e-5 < rounded.triangulation.bounds.max() < 1e-3


def test_more_triangles_than_allowed_are_refused() -> None:
    """The request is refused as soon as it is certain that the mesh needs more triangles."""
    with pytest.raises(TooLarge) as refused:
        build_refined(lower_patches("sphere"), Goal(1e-6), most=300)
    assert refused.value.issues[0].code == "too_many_triangles"


def test_work_above_the_limit_is_refused() -> None:
    """The limit of work holds for any number of triangles."""
    model = lower_patches("bourke-1111")
    result = build_border(model, Goal(0.01))
    with pytest.raises(TooLarge) as refused:
        triangulate(
            PatchNets.of(model),
            result.faces,
            result.border,
            Goal(0.01),
            store=lambda x: x,
            most=10**9,
            effort=Effort(1e5),
        )
    assert refused.value.issues[0].code == "too_costly"


def test_a_tolerance_that_needs_too_many_halvings_is_refused() -> None:
    """A cell that is 16 units of places long along u is halved along v, but not along u."""
    cells = FaceCells(np.array([[0], [SHORTEST], [0], [SPAN]]), np.array([0]))
    with pytest.raises(InvalidRequest) as refused:
        cells.halve(along_v=np.array([False]))
    assert refused.value.issues[0].code == "tolerance_too_small"
    assert len(cells.halve(along_v=np.array([True]))) == 2
