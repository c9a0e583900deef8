"""Points and normals on a grid, compared with exact arithmetic, other libraries and each other."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias, get_args

import numpy as np
import pytest
from hypothesis import given

from oracles import exact
from service.engine.evaluation.evaluate import Formulation, choose_formulation, evaluate
from service.engine.evaluation.evaluation_state import PatchSamples
from service.surface.batches import TensorPatches
from service.surface.checks import MAX_WEIGHT_RATIO
from tests.strategies import Array, resolutions, weighted_nets
from tools.examples import lower_example

Degree: TypeAlias = tuple[int, int]
Real: TypeAlias = type[np.float32] | type[np.float64]

FORMULATIONS: tuple[Formulation, ...] = get_args(Formulation)
DEGREES = [(1, 30), (2, 5), (3, 3), (6, 25), (12, 19), (16, 15), (24, 7), (30, 1)]
IS_RATIONAL = [False, True]


def build_smooth_patch(degree: Degree, is_rational: bool, seed: int = 0) -> TensorPatches:
    """A random patch without folds: points of a regular grid, moved by at most 1/5 of a cell."""
    rng = np.random.default_rng([seed, *degree, is_rational])
    p, q = degree
    x, y = np.meshgrid(np.linspace(-1, 1, p + 1), np.linspace(-1, 1, q + 1), indexing="ij")
    net = np.stack([x, y, np.zeros_like(x)], axis=-1)
    net += rng.uniform(-0.2, 0.2, net.shape) * (1 / p, 1 / q, 1)
    weights = rng.uniform(0.2, 5, (1, p + 1, q + 1)) if is_rational else None
    return TensorPatches(net[None], weights)


def build_batch(net: Array, weights: Array | None = None) -> TensorPatches:
    """A batch of one patch."""
    return TensorPatches(np.array(net)[None], None if weights is None else np.array(weights)[None])


def evaluate_points(net: Array, weights: Array | None, resolution: tuple[int, int]) -> Array:
    """The positions of one patch, float64."""
    return np.asarray(evaluate(build_batch(net, weights), resolution, normals=False).positions[0])


def list_formulations(patches: TensorPatches, normals: bool = True) -> list[Formulation]:
    """The formulations for a patch; the normal polynomial is only for polynomial patches."""
    if normals and patches.weights is None:
        return list(FORMULATIONS)
    return [f for f in FORMULATIONS if f != "normal_polynomial"]


@pytest.mark.slow
@pytest.mark.parametrize("is_rational", IS_RATIONAL)
@pytest.mark.parametrize("degree", DEGREES, ids=str)
def test_all_formulations_agree_with_exact_arithmetic(degree: Degree, is_rational: bool) -> None:
    """Positions agree to 1e-12, normals to 1e-9."""
    patches = build_smooth_patch(degree, is_rational)
    net, weights = patches.points[0], None if patches.weights is None else patches.weights[0]
    resolution = (3, 2)
    positions = exact.positions(net, weights, resolution)
    normals = exact.normals(net, weights, resolution)
    for formulation in list_formulations(patches):
        result = evaluate(patches, resolution, formulation=formulation)
        assert result.normals is not None
        assert np.abs(result.positions[0] - positions).max() < 1e-12
        assert np.abs(result.normals[0] - normals).max() < 1e-9


@given(weighted_nets(), resolutions)
def test_positions_of_any_net_agree_with_exact_arithmetic(
    net_and_weights: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    """The nets may have folds, where normals would be imprecise, but not positions."""
    net, weights = net_and_weights
    size = max(1.0, float(np.abs(net).max()))
    error = np.abs(
        evaluate_points(net, weights, resolution) - exact.positions(net, weights, resolution)
    )
    assert error.max() < 1e-14 * size


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize("is_rational", IS_RATIONAL)
def test_the_chosen_formulation_suits_the_patch(normals: bool, is_rational: bool) -> None:
    """The normal polynomial is chosen only for polynomial patches with normals."""
    for degree in ((1, 1), (3, 3), (4, 4), (15, 15), (30, 1)):
        for resolution in ((1, 1), (16, 16), (512, 512), (1, 4000)):
            patches = build_smooth_patch(degree, is_rational)
            assert choose_formulation(patches, resolution, normals) in list_formulations(
                patches, normals
            )


def test_every_formulation_is_chosen_in_some_case() -> None:
    """The choice depends on degree, resolution, weights and the number of patches."""
    teapot = lower_example("utah-teapot")
    assert choose_formulation(teapot, (16, 16), True) == "kronecker"
    assert choose_formulation(build_smooth_patch((15, 15), False), (128, 128), True) == "separable"
    assert (
        choose_formulation(build_smooth_patch((3, 3), False), (512, 512), True)
        == "normal_polynomial"
    )
    # Grids too large for the cache of the processor: rational bilinear patches take one product
    # with all four control points, unless its matrix is too large for the cache of bases.
    net = np.random.default_rng(0).random((8, 2, 2, 3))
    bilinear = TensorPatches(net, 1 + net[..., 0])
    assert choose_formulation(bilinear, (200, 200), True) == "kronecker"
    assert choose_formulation(bilinear, (400, 400), True) == "separable"
    # The fixed costs of a chunk of patches are larger in comparison for a single patch.
    assert choose_formulation(teapot, (24, 24), True) == "kronecker"
    assert choose_formulation(teapot.take(np.array([0])), (24, 24), True) == "separable"


def test_steep_patches_get_their_normals_in_double_precision() -> None:
    """If partials are nearly parallel, float32 loses four digits; one patch also has a pole."""
    nets = np.random.default_rng(4).random((300, 4, 4, 3)) / 3
    nets[..., :2] += np.moveaxis(np.indices((4, 4)), 0, -1)  # a regular grid in x and y
    nets[::3, ..., 2] *= 3000
    nets[5, 0] = nets[5, 0, 0]
    single, double = (
        evaluate(TensorPatches(nets), (8, 8), dtype=dtype) for dtype in (np.float32, np.float64)
    )
    assert np.abs(_get_normals(single) - _get_normals(double)).max() < 1e-5
    assert single.poles == double.poles == 9  # all samples of the collapsed side


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_chunks_of_a_large_grid_have_no_effect(formulation: Formulation) -> None:
    """Compares a grid of several chunks with a smaller grid at the same parameters."""
    patches = build_smooth_patch((3, 2), is_rational=False)
    large = evaluate(patches, (600, 60), formulation=formulation)
    small = evaluate(patches, (60, 6), formulation=formulation)
    for a, b in ((large.positions, small.positions), (large.normals, small.normals)):
        assert a is not None
        assert b is not None
        assert np.abs(a[:, ::10, ::10] - b).max() < 1e-14  # each tenth sample in both directions


def test_chunks_of_many_patches_have_no_effect() -> None:
    """Compares some of 1000 patches with their evaluation alone."""
    rng = np.random.default_rng(3)
    points = build_smooth_patch((2, 2), is_rational=False).points + rng.uniform(
        -1, 1, (1000, 1, 1, 3)
    )
    all_patches = evaluate(TensorPatches(points), (6, 6))
    assert all_patches.normals is not None
    for k in (0, 1, 333, 999):
        single_patch = evaluate(TensorPatches(points[k : k + 1]), (6, 6))
        assert single_patch.normals is not None
        assert np.abs(all_patches.positions[k] - single_patch.positions[0]).max() < 1e-14
        assert np.abs(all_patches.normals[k] - single_patch.normals[0]).max() < 1e-13


@given(weighted_nets(), resolutions)
def test_corners_are_interpolated(
    net_and_weights: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    """Corners of polynomial patches are exact; corners of rational patches up to rounding."""
    net, weights = net_and_weights
    # Steps as long as the arrays select the first and last rows and columns.
    corners = evaluate_points(net, weights, resolution)[:: resolution[0], :: resolution[1]]
    expected = net[:: len(net) - 1, :: len(net[0]) - 1]
    if weights is None:
        np.testing.assert_array_equal(corners, expected)
    else:
        np.testing.assert_allclose(corners, expected, atol=1e-14)


def _get_normals(samples: PatchSamples) -> Array:
    """The normals, which must have been computed."""
    assert samples.normals is not None
    return np.asarray(samples.normals)


def test_positions_have_the_same_bits_without_normals() -> None:
    patches = build_smooth_patch((3, 3), is_rational=True)
    result = evaluate(patches, (5, 4), normals=False)
    assert result.normals is None
    np.testing.assert_array_equal(result.positions, evaluate(patches, (5, 4)).positions)


def test_origin_is_subtracted_before_rounding() -> None:
    """A float32 patch of extent 1, a million from zero, keeps its seven digits."""
    origin = np.array([1e6, -3e6, 5e6])
    for is_rational in IS_RATIONAL:
        patch = build_smooth_patch((3, 3), is_rational)
        far_patch = TensorPatches(patch.points + origin, patch.weights)
        # The reference includes the rounding errors of adding the origin.
        expected = TensorPatches(far_patch.points - origin, patch.weights)
        result = evaluate(far_patch, (8, 8), dtype=np.float32, origin=origin)
        assert result.positions.dtype == np.float32
        assert np.abs(result.positions - evaluate(expected, (8, 8)).positions).max() < 1e-6


def _defer_example(name: str) -> Callable[[], TensorPatches]:
    """A function that builds the patches of an example."""
    return lambda: lower_example(name)


def _defer_smooth_patch(degree: Degree, is_rational: bool) -> Callable[[], TensorPatches]:
    """A function that builds the patch of `build_smooth_patch`."""
    return lambda: build_smooth_patch(degree, is_rational)


PATCHES: dict[str, Callable[[], TensorPatches]] = {
    name: _defer_example(name)
    for name in ("utah-teapot", "bourke-1111", "tveit", "sphere", "torus", "cone", "cylinder")
} | {
    f"{'rational' if is_rational else 'polynomial'} {degree}": _defer_smooth_patch(
        degree, is_rational
    )
    for degree in ((3, 3), (2, 7), (15, 15), (30, 4))
    for is_rational in IS_RATIONAL
}


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("build", PATCHES.values(), ids=PATCHES)
def test_normals_in_float32_are_right_to_1e_6(
    build: Callable[[], TensorPatches], offset: float
) -> None:
    """Compares normals in float32 and in float64, at the origin and a million units away."""
    patches = build()
    points = patches.points + offset
    for formulation in list_formulations(patches):
        far_patches = TensorPatches(points, patches.weights)
        double = evaluate(far_patches, (13, 9), formulation=formulation)
        single = evaluate(far_patches, (13, 9), dtype=np.float32, formulation=formulation)
        assert _get_normals(single).dtype == np.float32
        assert np.abs(_get_normals(single) - _get_normals(double)).max() < 1e-6


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("is_rational", IS_RATIONAL)
@pytest.mark.parametrize("power", [-1000, -200, -100, -50, 50, 100, 120])
def test_normals_do_not_depend_on_the_unit_of_length(
    power: int, is_rational: bool, dtype: Real
) -> None:
    """Scaling by a power of two is exact, so the bits of normals do not change."""
    patches = build_smooth_patch((3, 2), is_rational)
    scaled = TensorPatches(patches.points * 2.0**power, patches.weights)
    for formulation in list_formulations(patches):
        plain = evaluate(patches, (5, 6), dtype=dtype, formulation=formulation)
        result = evaluate(scaled, (5, 6), dtype=dtype, formulation=formulation)
        np.testing.assert_array_equal(_get_normals(result), _get_normals(plain))
        if dtype == np.float64:
            np.testing.assert_array_equal(result.positions, plain.positions * 2.0**power)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("is_rational", IS_RATIONAL)
@pytest.mark.parametrize("ratio", [1e-4, 1e-8, 1e-11, 1e-13])
def test_a_small_patch_beside_a_large_one_keeps_its_normals(
    ratio: float, is_rational: bool, dtype: Real
) -> None:
    """Both patches have the same shape, so their normals must agree."""
    large = build_smooth_patch((2, 2), is_rational)
    small = large.points * ratio
    weights = None if large.weights is None else np.repeat(large.weights, 2, axis=0)
    both_patches = TensorPatches(np.concatenate([large.points, small]), weights)
    for formulation in list_formulations(both_patches):
        normals = _get_normals(evaluate(both_patches, (6, 5), dtype=dtype, formulation=formulation))
        max_difference = 1e-6 if dtype == np.float32 else 1e-9
        assert np.abs(normals[1] - normals[0]).max() < max_difference


def test_inputs_stay_unchanged_and_results_share_no_memory() -> None:
    """Two calls return different arrays."""
    patches = build_smooth_patch((3, 3), is_rational=True)
    before = patches.points.copy()
    result, second_result = (evaluate(patches, (20, 20)) for _ in range(2))
    np.testing.assert_array_equal(patches.points, before)
    for array in (result.positions, _get_normals(result)):
        for other_array in (second_result.positions, _get_normals(second_result)):
            assert not np.shares_memory(array, other_array)


def test_results_have_equal_bits_in_all_threads() -> None:
    """Threads do not overwrite the work arrays of other threads."""
    batches = [
        build_smooth_patch((p, 3), is_rational, seed=p)
        for p in (2, 3, 9)
        for is_rational in IS_RATIONAL
    ]

    def compute_bytes(patches: TensorPatches) -> bytes:
        result = evaluate(patches, (30, 17), dtype=np.float32)
        return result.positions.tobytes() + _get_normals(result).tobytes()

    expected = [compute_bytes(patches) for patches in batches]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(compute_bytes, batches * 8)) == expected * 8


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("is_rational", IS_RATIONAL)
@pytest.mark.parametrize("extent", [5e-324, 1e-310, 3e38])
def test_the_smallest_and_largest_extents_give_unit_normals(
    extent: float, is_rational: bool, dtype: Real
) -> None:
    """With the smallest extents, coordinates have too few digits for a shape."""
    patches = build_smooth_patch((2, 2), is_rational)
    points = np.clip(patches.points, -1, 1) * extent
    for formulation in list_formulations(patches):
        result = evaluate(
            TensorPatches(points, patches.weights), (3, 4), dtype=dtype, formulation=formulation
        )
        assert np.isfinite(result.positions).all()
        np.testing.assert_allclose(np.linalg.norm(_get_normals(result), axis=-1), 1, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6, MAX_WEIGHT_RATIO])
def test_errors_of_normals_grow_with_the_ratio_of_weights(ratio: float, dtype: Real) -> None:
    """Positions stay in the box about the control points, also at the largest accepted ratio.

    The difference of two weighted control points of small weight has a rounding error of 1e-16 of
    the points of large weight. No other error may affect the normals.
    """
    max_error = max(1e-5 if dtype == np.float32 else 1e-9, 1e-15 * ratio)
    slack = 8 * float(np.finfo(dtype).eps)
    for seed in range(8):
        net = build_smooth_patch((3, 3), is_rational=False, seed=seed).points[0]
        logarithms = np.random.default_rng(seed).uniform(-0.5, 0.5, net.shape[:2])
        weights = ratio**logarithms
        result = evaluate(build_batch(net, weights), (3, 4), dtype=dtype)
        assert (result.positions >= net.min(axis=(0, 1)) - slack).all()
        assert (result.positions <= net.max(axis=(0, 1)) + slack).all()
        np.testing.assert_allclose(np.linalg.norm(_get_normals(result), axis=-1), 1, atol=slack)
        assert (
            np.abs(_get_normals(result)[0] - exact.normals(net, weights, (3, 4))).max() < max_error
        )
