"""Rounding stays within its bound, checked in exact arithmetic; and the least tolerance."""

from dataclasses import replace
from fractions import Fraction
from math import inf

import numpy as np
import pytest
from numpy.typing import NDArray

from oracles import exact, triangles
from service.engine.bounds.certificate import certify
from service.engine.bounds.distance import maximize_quadratics
from service.engine.bounds.goal import (
    Goal,
    View,
    check_goal,
    count_roundings,
    find_least_tolerance,
)
from service.engine.nets.blossoms import build_triangle_nets
from service.engine.nets.patch_nets import PatchNets
from service.engine.vectors import UNIT
from service.errors import InvalidRequest
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.bezier import BezierSurface
from tests.engine.bounds.divided_faces import (
    build_face,
    build_parts,
    divide_evenly,
    divide_face,
    evaluate_places,
)
from tests.engine.nets.test_patch_nets import build_model

Array = NDArray[np.float64]


def to_fractions(value: exact.Vector) -> exact.Vector:
    return value if len(value) == 3 else tuple(x / value[3] for x in value[:3])


def measure_errors(batch: TensorPatches | TrianglePatches, seed: int) -> float:
    """The largest error of computed nets over triangles, as a share of its bound.

    Points of a net are compared with exact points of the patch. The net has coordinates relative to
    `PatchNets.middles`.
    """
    rng = np.random.default_rng(seed)
    patch_nets = PatchNets.of(build_model(batch))
    (nets,) = patch_nets.groups
    p, q = nets.degree
    u, v = rng.integers(0, 2**30, (2, 3, 1)) / 2**30
    weights = None if batch.weights is None else batch.weights[0]
    middle = [Fraction(float(x)) for x in patch_nets.middles[:, 0]]
    worst = 0.0
    net_over_triangle = triangles.to_exact_triangle(
        build_triangle_nets(nets.items, np.stack([u, v], axis=1))[0].T
    )
    for place in triangles.places(3):
        a, b = (
            sum((s * Fraction(float(t[0])) for s, t in zip(place, axis, strict=True)), Fraction(0))
            for axis in (u, v)
        )
        if isinstance(batch, TensorPatches):
            expected = exact.surface_point(exact.to_exact_net(batch.points[0], weights), a, b)
        else:
            s, t = a * (1 - b), b
            net = triangles.to_exact_triangle(batch.points[0], weights)
            expected = triangles.value(net, (1 - s - t, s, t))
        point = to_fractions(triangles.value(net_over_triangle, place))
        gap = [x + m - y for x, m, y in zip(point, middle, to_fractions(expected), strict=True)]
        worst = max(worst, float(sum(x * x for x in gap)) ** 0.5)
    return worst / (UNIT * count_roundings(p, q) * float(patch_nets.sizes[0]))


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize(
    "shape", [(1, 2, 2, 3), (1, 4, 4, 3), (1, 2, 5, 3), (1, 10, 3), (1, 15, 3)]
)
def test_rounding_of_nets_is_within_its_bound(shape: tuple[int, ...], weighted: bool) -> None:
    rng = np.random.default_rng(len(shape))
    points = 1e3 + rng.normal(size=shape)
    weights = 10.0 ** rng.uniform(-7, 0, shape[:-1]) if weighted else None
    patches_class = TensorPatches if len(shape) == 4 else TrianglePatches
    share = max(measure_errors(patches_class(points, weights), seed) for seed in range(2))
    # Rounding occurs, and is far within its bound.
    assert 1e-5 < share < 0.2


def test_the_closed_form_is_the_greatest_value_of_a_quadratic() -> None:
    """4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0) over a triangle, at a grid of points λ.

    The rows of coefficients m are random; positive; near 1; and special.
    """
    rng = np.random.default_rng(1)
    grid = triangles.places(40)
    shares = np.array([[float(x) for x in place] for place in grid])
    products = 4 * shares * shares[:, [1, 2, 0]]
    m = np.concatenate(
        [
            rng.normal(size=(3, 300)),
            rng.uniform(0, 1, (3, 300)),
            1 + 10.0 ** rng.uniform(-16, 0, (3, 300)) * rng.choice([-1, 0, 1], (3, 300)),
            np.array([[1, 1, 0], [1, 1, 1], [0, 0, 0], [-1, -2, -1], [1, 1, 1e-17], [2, 1, 1]]).T,
        ],
        axis=1,
    )
    result = maximize_quadratics(m)
    sampled = np.maximum(products @ m, 0).max(axis=0)
    assert (result >= sampled * (1 - 1e-15)).all()
    np.testing.assert_allclose(result, sampled, rtol=0, atol=2e-3 * np.abs(m).max())


@pytest.mark.parametrize("degree", [3, 9])
def test_a_tolerance_below_the_least_is_refused(degree: int) -> None:
    # So flat that even the least tolerance needs few triangles.
    side = np.linspace(0, 3, degree + 1)
    x, y = np.meshgrid(side, side, indexing="ij")
    height = 1e-10 * np.random.default_rng(3).normal(size=x.shape)
    patch_nets = PatchNets.of(BezierSurface(np.stack([x, y, height], axis=-1)).lower())
    least = find_least_tolerance(patch_nets)
    assert 1e-14 < least < 1e-10
    # Storing positions with an error of up to 1e-7 adds twice that.
    assert find_least_tolerance(patch_nets, 1e-7) == pytest.approx(least + 2e-7)
    faces = build_face()
    places, corners, across = divide_face(divide_evenly(64), divide_evenly(64))
    goal = Goal(least)
    check_goal(goal, least, 0.0)
    parts = build_parts(places, corners, across)
    assert certify(
        patch_nets, faces, parts, evaluate_places(patch_nets, faces, places), goal
    ).meets_goal.all()
    with pytest.raises(InvalidRequest) as caught:
        check_goal(replace(goal, tolerance=least / 2), least, 0.0)
    assert caught.value.issues[0].code == "tolerance_too_small"
    view = View(np.zeros(3), rate=least / 2, near=1.0)
    with pytest.raises(InvalidRequest) as caught:
        check_goal(Goal(inf, view=view), least, 0.0)
    assert caught.value.issues[0].code == "tolerance_too_small"
    # A model at the distance 1000 is allowed enough, although points beside the eye are not.
    check_goal(Goal(inf, view=view), least, nearest=1e3)
