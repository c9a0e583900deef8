"""Goals of the models of a group, for which all copies are near enough."""

from math import inf, pi, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.accuracy import Accuracy, Camera
from service.engine.adaptive.tolerances import (
    NEAR,
    build_goal,
    build_model_goals,
    move_goal,
    separate_copies,
    tighten_for_border,
)
from service.engine.bounds.goal import Goal, View
from service.engine.scenes.placing import bound_placing_error, place_points, scalings
from service.errors import InvalidRequest
from service.surface.bezier import BezierSurface
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel
from service.surface.member import Member
from tests.strategies import Array, placements
from tools.examples import lower_patches

NET = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])


def build_group(*matrices: Array | None) -> GroupModel:
    model = GroupSurface(tuple(Member(BezierSurface(NET), matrix=m) for m in matrices)).lower()
    assert len(model.models) == 1
    return model


def build_scaling(factor: float) -> Array:
    return np.diag([factor, factor, factor, 1.0])


def test_a_tolerance_is_absolute_or_a_share_of_the_diagonal() -> None:
    model = lower_patches("saddle")
    low, high = model.bounds
    diagonal = float(np.linalg.norm(high - low))
    absolute = build_goal(Accuracy(tolerance=0.25), model)
    assert (absolute.tolerance, absolute.angle, absolute.view) == (0.25, inf, None)
    relative = build_goal(Accuracy(relative_tolerance=0.01, two_sided=True), model)
    assert relative.tolerance == 0.01 * diagonal
    assert relative.two_sided
    angle = build_goal(Accuracy(angle_tolerance=0.5), model)
    assert angle.angle == 0.5
    assert diagonal < angle.tolerance < inf


def test_the_diagonal_of_a_group_is_that_of_all_its_copies() -> None:
    far = np.eye(4)
    far[:3, 3] = 9, 0, 0
    low, high = build_group(None, far).bounds
    np.testing.assert_allclose(high - low, [10, 1, 1])
    result = build_goal(Accuracy(relative_tolerance=0.5), build_group(None, far)).tolerance
    assert result == pytest.approx(0.5 * np.sqrt(102))


def test_the_allowed_deviation_is_the_size_of_a_pixel_at_each_distance() -> None:
    """At the distance d the picture is 2 d tan(φ/2) high."""
    camera = Camera((0.0, 0.0, 7.0), pi / 2, 500)
    model = lower_patches("saddle")
    goal = build_goal(Accuracy(camera=camera, pixel_tolerance=2.0), model)
    assert goal.view is not None
    distances = np.array([3.0, 30.0])
    expected = 2.0 * 2 * distances * tan(pi / 4) / 500
    np.testing.assert_allclose(goal.find_allowed(distances), expected)
    low, high = model.bounds
    assert goal.view.near == NEAR * np.linalg.norm(high - low)


@given(placements(), st.floats(1e-3, 10), st.floats(0, 1e-4))
def test_the_goal_of_a_model_keeps_its_copy_within_the_goal_of_the_group(
    matrix: Array, tolerance: float, error: float
) -> None:
    """`error` bounds the rounding that follows the placement of the copy."""
    model = build_group(matrix).models[0]
    model_goal = move_goal(Goal(tolerance), matrix, model.bounds, error)
    rounding = bound_placing_error(matrix, *model.bounds) + error
    _, largest_scaling = scalings(matrix)
    assert model_goal.tolerance * largest_scaling + rounding <= tolerance
    assert model_goal.tolerance > 0


@given(placements(), st.integers(0, 2**32))
def test_the_deviation_that_a_camera_allows_holds_for_the_copy(matrix: Array, seed: int) -> None:
    random = np.random.default_rng(seed)
    goal = Goal(inf, view=View(random.normal(size=3) * 9, 0.01, 0.1))
    model_goal = move_goal(goal, matrix, build_group(None).models[0].bounds, error=1e-7)
    assert model_goal.view is not None
    points = random.uniform(0, 1, (40, 3))
    away = np.linalg.norm(points - model_goal.view.eye, axis=1)
    # An error grows by the largest scaling at most, and rounding adds to it.
    _, largest_scaling = scalings(matrix)
    worst = model_goal.find_allowed(away) * largest_scaling + 1e-7
    assert goal.view is not None
    placed = np.linalg.norm(place_points(points, matrix) - goal.view.eye, axis=1)
    assert (worst <= goal.find_allowed(placed) * (1 + 1e-9)).all()


def test_tolerances_below_twice_the_rounding_are_refused() -> None:
    far = np.eye(4)
    far[:3, 3] = 1e6, 0, 0
    model = build_group(far)
    with pytest.raises(InvalidRequest) as refused:
        build_model_goals(Goal(1e-3), model, error=1e-3)
    (issue,) = refused.value.issues
    assert (issue.code, issue.needed.split(" for")[0]) == ("tolerance_too_small", "at least 0.002")
    view = View(np.zeros(3), rate=1e-9, near=1.0)
    with pytest.raises(InvalidRequest):
        build_model_goals(Goal(inf, view=view), model, error=1e-3)


def test_separate_copies_have_separate_models() -> None:
    whole = build_group(None, build_scaling(2.0), build_scaling(3.0))
    apart = separate_copies(whole)
    assert len(apart.models) == 3
    assert [member.model for member in apart.members] == [0, 1, 2]
    # The three entries are the same model; they are separate because their goals differ.
    assert all(model is whole.models[0] for model in apart.models)
    assert [m.matrix for m in apart.members] == [m.matrix for m in whole.members]


@pytest.mark.parametrize(
    ("accuracy", "where"),
    [
        (Accuracy(tolerance=1.0, max_triangles=9), "/tolerance"),
        (Accuracy(relative_tolerance=1.0), "/relative_tolerance"),
        (Accuracy(angle_tolerance=1.0, max_bytes=9), "/angle_tolerance"),
        (Accuracy(max_bytes=9), "/max_bytes"),
        (Accuracy(camera=Camera((0, 0, 0), 1, 9), pixel_tolerance=1.0), "/pixel_tolerance"),
    ],
)
def test_errors_point_to_the_option_of_the_request(accuracy: Accuracy, where: str) -> None:
    assert accuracy.pointer == where


@pytest.mark.parametrize(("rounding", "is_full"), [(0.0, True), (0.03, True), (0.05, False)])
def test_edges_are_divided_by_the_full_goal_unless_rounding_takes_much(
    rounding: float, is_full: bool
) -> None:
    """Much is more than 0.04 of the tolerance."""
    bounds = np.zeros(3), np.ones(3)
    goal = Goal(1.0)
    tight = tighten_for_border(goal, rounding, bounds)
    assert (tight is goal) == is_full
    assert is_full or tight.tolerance == 1.0 - rounding
    # The eye is at the box, so the least that is allowed is rate times near, 1e-3.
    goal_with_view = Goal(1.0, view=View(np.zeros(3), rate=0.1, near=0.01))
    assert (
        tighten_for_border(goal_with_view, 1e-3 * rounding, bounds) is goal_with_view
    ) == is_full
