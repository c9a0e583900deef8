"""Positions at any parameters are compared with exact arithmetic (de Casteljau's algorithm).

The bits of the positions on a patch do not depend on other patches.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact, triangles
from service.engine.nets.patch_nets import PatchNets
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.lowered import Part, PatchModel
from tests import strategies


def build_model(*batches: TensorPatches | TrianglePatches) -> PatchModel:
    count = sum(batch.count for batch in batches)
    return PatchModel("model", batches, (Part("all", 0, count),))


def build_random_batches(seed: int) -> tuple[TensorPatches | TrianglePatches, ...]:
    """Batches of tensor patches and of triangles, both polynomial and rational."""
    rng = np.random.default_rng(seed)
    return (
        TensorPatches(rng.normal(size=(3, 4, 4, 3))),
        TensorPatches(rng.normal(size=(2, 3, 6, 3)) + 50.0, rng.uniform(0.2, 5, (2, 3, 6))),
        TrianglePatches(rng.normal(size=(2, 15, 3))),
        TrianglePatches(rng.normal(size=(2, 10, 3)), rng.uniform(0.2, 5, (2, 10))),
        TensorPatches(rng.normal(size=(2, 4, 4, 3)) - 9.0),
    )


PLACES = st.tuples(st.integers(0, 64), st.integers(0, 64))
"""Parameters u and v, in units of 1/64."""


@given(strategies.weighted_nets(), st.lists(PLACES, min_size=1, max_size=4))
def test_positions_are_those_of_exact_arithmetic(
    net: tuple[strategies.Array, strategies.Array | None], places: list[tuple[int, int]]
) -> None:
    points, weights = net
    patch_nets = PatchNets.of(BezierSurface(points, weights).lower())
    u, v = (np.array(axis) / 64 for axis in zip(*places, strict=True))
    patch = np.zeros(len(places), dtype=np.intp)
    size = np.abs(points).max() + 1.0
    result = patch_nets.evaluate_points(patch, u, v)
    expected = [
        exact.jets(exact.to_exact_net(points, weights), [Fraction(a)], [Fraction(b)])[0][0].point
        for a, b in zip(u.tolist(), v.tolist(), strict=True)
    ]
    np.testing.assert_allclose(result, np.array(expected, dtype=float), rtol=0, atol=1e-13 * size)


@pytest.mark.parametrize("weighted", [False, True])
def test_triangles_are_evaluated_as_squares_with_one_side_a_point(weighted: bool) -> None:
    rng = np.random.default_rng(5)
    for degree in (1, 2, 5):
        points = rng.normal(size=((degree + 1) * (degree + 2) // 2, 3)) + 1000.0
        weights = rng.uniform(0.1, 4, len(points)) if weighted else None
        batch = TrianglePatches(points[None], None if weights is None else weights[None])
        patch_nets = PatchNets.of(build_model(batch))
        u, v = rng.integers(0, 257, (2, 20)) / 256
        result = patch_nets.evaluate_points(np.zeros(20, dtype=np.intp), u, v)
        net = triangles.to_exact_triangle(points, weights)
        for position, a, b in zip(result, u.tolist(), v.tolist(), strict=True):
            s, t = Fraction(a) * (1 - Fraction(b)), Fraction(b)
            expected = triangles.jet(net, (1 - s - t, s, t)).point
            np.testing.assert_allclose(
                position, np.array(expected, dtype=float), rtol=0, atol=1e-11
            )


def test_the_bits_of_a_patch_depend_on_nothing_else() -> None:
    batches = build_random_batches(7)
    patch_nets = PatchNets.of(build_model(*batches))
    rng = np.random.default_rng(8)
    patch = rng.integers(0, sum(batch.count for batch in batches), 5000)
    u, v = rng.random((2, 5000))
    together = patch_nets.evaluate_points(patch, u, v)
    first = 0
    for batch in batches:
        for k in range(batch.count):
            alone = PatchNets.of(build_model(batch.take(np.array([k]))))
            rows = np.flatnonzero(patch == first + k)[::-1]  # another order, too
            only_patch = np.zeros(len(rows), dtype=np.intp)
            apart = alone.evaluate_points(only_patch, u[rows], v[rows])
            np.testing.assert_array_equal(together[rows], apart)
        first += batch.count


def test_weights_of_any_size_lose_nothing() -> None:
    rng = np.random.default_rng(3)
    points, weights = rng.normal(size=(1, 3, 4, 3)), rng.uniform(0.5, 2, (1, 3, 4))
    u, v = rng.random((2, 9))
    only_patch = np.zeros(9, dtype=np.intp)
    usual = PatchNets.of(build_model(TensorPatches(points, weights))).evaluate_points(
        only_patch, u, v
    )
    for power in (-64, 64):
        other = PatchNets.of(build_model(TensorPatches(points, np.ldexp(weights, power))))
        np.testing.assert_array_equal(other.evaluate_points(only_patch, u, v), usual)


def test_only_a_b_spline_is_lowered_with_rounding() -> None:
    net = np.random.default_rng(2).normal(size=(6, 5, 3))
    assert 0 < PatchNets.of(BsplineSurface(net).lower()).lowering < 1e-10
    assert PatchNets.of(build_model(TensorPatches(net[None]))).lowering == 0
