"""Bounds of second derivatives and of deviation between samples, where they are known exactly."""

import numpy as np
import pytest

from service.engine.bounds.products import bound_grid_deviations, is_small
from service.engine.bounds.second_derivatives import (
    SecondDerivativeBounds,
    bound_second_derivatives,
    bound_triangle_deviations,
    count_blocks,
)
from service.surface.batches import TensorPatches, TrianglePatches
from tests.strategies import Array

GRIDS = [(1, 1), (2, 3), (4, 4), (5, 8)]


def build_height_net(coefficients: Array) -> Array:
    """Net (3, 3, 3) of z = Σ c_ab u^a v^b, a, b ≤ 2, over the unit square."""
    # Column k has the control points of t^k.
    power = np.array([[1, 0, 0], [1, 0.5, 0], [1, 1, 1]])
    x, y = np.meshgrid([0, 0.5, 1], [0, 0.5, 1], indexing="ij")
    return np.stack([x, y, power @ coefficients @ power.T], axis=-1)


def bound_partials(net: Array, grid: tuple[int, int]) -> SecondDerivativeBounds:
    """Bounds of the second partials of one patch, in each block of a grid of blocks."""
    divisions = 2 * grid[0], 2 * grid[1]
    return bound_second_derivatives(TensorPatches(net[None]), divisions, grid)


@pytest.mark.parametrize("grid", GRIDS)
def test_second_derivatives_that_are_constant(grid: tuple[int, int]) -> None:
    net = build_height_net(np.array([[0.0, 1, 3], [2, -5, 0], [0.5, 0, 0]]))
    partials = bound_partials(net, grid)
    for result, expected in ((partials.uu, 1.0), (partials.uv, 5.0), (partials.vv, 6.0)):
        assert result.shape == (*grid, 1)
        np.testing.assert_allclose(result, expected, rtol=1e-12)
    # (h² uu + 2 h k uv + k² vv) / 8 for boxes of the sides h = ½ and k = ¼.
    np.testing.assert_allclose(
        partials.bound_deviations(0.5, 0.25), (1 / 4 + 10 / 8 + 6 / 16) / 8, rtol=1e-12
    )


def test_bounds_are_large_only_in_blocks_with_large_second_derivatives() -> None:
    # z = u² v²: z_uu = 2 v², z_uv = 4 u v, z_vv = 2 u².
    coefficients = np.zeros((3, 3))
    coefficients[2, 2] = 1.0
    partials = bound_partials(build_height_net(coefficients), grid=(4, 4))
    ends = np.arange(1, 5) / 4  # the upper ends of the blocks, in each direction
    np.testing.assert_allclose(partials.uv[..., 0], 4 * np.outer(ends, ends), rtol=1e-12)
    # Over a block a ≤ v ≤ b, 2 v² has the coefficients 2 a², 2 a b and 2 b²: the last is the bound.
    np.testing.assert_allclose(partials.uu[0, :, 0], 2 * ends**2, atol=1e-12)


def test_each_patch_of_a_batch_has_the_bound_that_it_has_alone() -> None:
    rng = np.random.default_rng(9)
    nets, weights = rng.uniform(-1, 1, (5, 3, 4, 3)), rng.uniform(0.5, 2, (5, 3, 4))
    for point_weights in (None, weights):
        together = bound_second_derivatives(
            TensorPatches(nets.copy(), point_weights), (9, 8), (3, 2)
        )
        for k in range(5):
            alone = TensorPatches(
                nets[k : k + 1], None if point_weights is None else point_weights[k : k + 1]
            )
            np.testing.assert_allclose(
                together.bound_deviations(1 / 9, 1 / 8)[k],
                bound_second_derivatives(alone, (9, 8), (3, 2)).bound_deviations(1 / 9, 1 / 8)[0],
                rtol=1e-9,
            )


def test_the_bound_is_exact_for_a_paraboloid_over_an_equilateral_triangle() -> None:
    # z = x² + y² over an equilateral triangle of side 1. A control point of degree 2 belongs to two
    # corners a and b: it is above their middle, at the height a · b.
    corners = np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)]])
    pairs = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
    net = np.array([[*(corners[a] + corners[b]) / 2, corners[a] @ corners[b]] for a, b in pairs])
    result = bound_triangle_deviations(TrianglePatches(net[None]), 4)
    # The four divisions give triangles of side 1/4. In each of them z differs most from its linear
    # interpolant at the centre: by the square of the radius 1/(4 √3) of the circle about it.
    np.testing.assert_allclose(result, 1 / 48, rtol=1e-12)
    rational = TrianglePatches(net[None], np.full((1, 6), 2.0))
    np.testing.assert_allclose(bound_triangle_deviations(rational, 4), 1 / 48, rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 3, 15, 64])
def test_blocks_are_few(degree: int) -> None:
    counts = [count_blocks(divisions, degree) for divisions in (1, 4, 16, 64, 1 << 16)]
    assert counts[0] == 1
    assert counts == sorted(counts)
    assert counts[-1] == {1: 8, 3: 8, 15: 4, 64: 1}[degree]


@pytest.mark.parametrize("degree", [(1, 1), (2, 1), (1, 3), (3, 3), (2, 5)])
@pytest.mark.parametrize("divisions", [(1, 1), (7, 16), (40, 9)])
def test_one_product_and_several_give_the_same_bounds(
    degree: tuple[int, int], divisions: tuple[int, int]
) -> None:
    (p, q), (ru, rv) = degree, divisions
    nets = np.random.default_rng(p * q).normal(1e3, 1, size=(6, p + 1, q + 1, 3))
    patches = TensorPatches(nets)
    partials = bound_second_derivatives(
        patches, divisions, (count_blocks(ru, p), count_blocks(rv, q))
    )
    # `is_small` tells whether one product of matrices is faster than several. Up to 16 divisions it
    # always is; with 40 it may be slower, but must give the same bounds.
    assert is_small(patches, divisions) or max(divisions) > 16
    result = bound_grid_deviations(patches, divisions)
    bounds = partials.bound_deviations(1 / ru, 1 / rv)
    np.testing.assert_allclose(result, bounds, rtol=1e-4, atol=1e-12)
    assert (result >= bounds * (1 - 1e-12)).all()
    # Rational patches need several products.
    assert not is_small(TensorPatches(nets.copy(), np.full(nets.shape[:-1], 2.0)), divisions)


@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-310, 1e-300])
def test_bounds_of_tiny_patches_are_finite(size: float) -> None:
    patches = TensorPatches(size * np.random.default_rng(3).uniform(-1, 1, (2, 4, 4, 3)))
    bounds = bound_grid_deviations(patches, (3, 3))
    # The diagonal of the box of the control points is at most √12 size.
    assert ((bounds >= 0) & (bounds <= 4 * size)).all()
