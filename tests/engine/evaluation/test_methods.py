"""The methods other than `matrix`: errors of positions and normals; faces equal those of
`matrix`."""

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact, quadrics, triangles
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.evaluation.evaluate import evaluate
from service.engine.evaluation.forward_difference import find_starting_differences
from service.engine.mesh.mesh import Mesh
from service.engine.options import Method
from service.engine.scratch import Real
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from tests.engine.meshing import build_mesh
from tests.strategies import (
    Array,
    build_cube,
    build_mixed_model,
    build_model,
    degenerate_nets,
    height_nets,
    nets,
    resolutions,
    translate,
    triangle_nets,
    weighted_nets,
    weights_like,
)
from tools.examples import lower_example

OTHER_METHODS: tuple[Method, ...] = ("de_casteljau", "forward_difference")
MAX_ERRORS: dict[tuple[Method, Real], float] = {
    ("de_casteljau", np.float64): 1e-13,
    ("de_casteljau", np.float32): 1e-6,
    ("forward_difference", np.float64): 1e-12,
    ("forward_difference", np.float32): 1e-5,
}
"""The largest errors of positions, relative to the size of the net, at degrees up to 5 and few
divisions."""

each_method = pytest.mark.parametrize("method", OTHER_METHODS)
each_dtype = pytest.mark.parametrize("dtype", [np.float64, np.float32])


def build_batch(net: Array, weights: Array | None = None) -> TensorPatches:
    return TensorPatches(np.array(net)[None], None if weights is None else np.array(weights)[None])


def build_triangle_batch(net: Array, weights: Array | None) -> TrianglePatches:
    return TrianglePatches(net[None].copy(), None if weights is None else weights[None].copy())


@st.composite
def weighted_triangles(draw: st.DrawFn, base: st.SearchStrategy[Array]) -> Any:
    net = draw(base)
    return net, draw(st.none() | weights_like(net))


@given(weighted_nets(), resolutions)
def test_positions_agree_with_exact_arithmetic(
    surface: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    check_points(build_batch(*surface), resolution, exact.positions(*surface, resolution))


@given(weighted_triangles(triangle_nets()), st.integers(1, 6))
def test_positions_of_triangles_agree_with_exact_arithmetic(
    surface: tuple[Array, Array | None], divisions: int
) -> None:
    expected = triangles.positions(triangles.jets(*surface, divisions))
    # A triangle takes the larger of the two divisions.
    check_points(build_triangle_batch(*surface), (1, divisions), expected)


def check_points(patches: Patches, resolution: tuple[int, int], expected: Array) -> None:
    """Checks the positions of one patch, by each method and in each precision."""
    size = np.abs(patches.points).max() or 1.0
    for (method, dtype), max_error in MAX_ERRORS.items():
        result = evaluate(patches, resolution, dtype=dtype, normals=False, method=method)
        assert result.positions.dtype == dtype
        assert np.abs(result.positions[0] - expected).max() <= max_error * size


@given(weighted_nets(height_nets()), resolutions)
def test_normals_agree_with_exact_arithmetic(
    surface: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    expected = exact.normals(*surface, resolution)
    for method, dtype in MAX_ERRORS:
        result = evaluate(build_batch(*surface), resolution, dtype=dtype, method=method)
        assert result.normals is not None
        max_error = 1e-9 if dtype is np.float64 else 3e-4
        np.testing.assert_allclose(result.normals[0], expected, rtol=0, atol=max_error)


@each_method
@each_dtype
@pytest.mark.parametrize("name", ["sphere", "utah-teapot", "cone"])
def test_normals_at_poles_are_limits_with_every_method(
    method: Method, dtype: Real, name: str
) -> None:
    patches = lower_example(name)
    expected = evaluate(patches, (8, 6), dtype=dtype)
    result = evaluate(patches, (8, 6), dtype=dtype, method=method)
    assert result.poles == expected.poles > 0
    assert result.normals is not None
    assert expected.normals is not None
    np.testing.assert_allclose(result.normals, expected.normals, rtol=0, atol=2e-5)
    if name == "sphere":
        points = result.positions.reshape(-1, 3).astype(np.float64)
        distance, sphere_normals = quadrics.sphere(points)
        assert np.abs(distance).max() < 1e-6
        np.testing.assert_allclose(result.normals.reshape(-1, 3), sphere_normals, atol=2e-5)


@each_method
def test_patches_far_from_the_origin_keep_their_digits(method: Method) -> None:
    """float32 with a local origin, and float64 without one, are as exact as near the origin."""
    net = np.random.default_rng(3).standard_normal((4, 4, 3))
    origin = np.array([2.0**20, -(2.0**18), 0])
    near, far = build_batch(net), build_batch(translate(net, *origin))
    expected = evaluate(near, (9, 9), dtype=np.float32, method=method)
    result = evaluate(far, (9, 9), dtype=np.float32, method=method, origin=origin)
    np.testing.assert_allclose(result.positions, expected.positions, rtol=0, atol=1e-6)
    assert result.normals is not None
    assert expected.normals is not None
    np.testing.assert_allclose(result.normals, expected.normals, rtol=0, atol=1e-5)
    double_positions = evaluate(far, (9, 9), method=method).positions - origin
    np.testing.assert_allclose(double_positions, expected.positions, rtol=0, atol=1e-6)


@given(st.tuples(degenerate_nets(), st.sampled_from([1.0, 1e-30, 4e37]), resolutions, st.data()))
def test_degenerate_nets_have_unit_normals(
    surface: tuple[Array, float, tuple[int, int], st.DataObject],
) -> None:
    net, scale, resolution, data = surface
    weights = data.draw(st.none() | weights_like(net))
    for method, dtype in MAX_ERRORS:
        result = evaluate(build_batch(net * scale, weights), resolution, dtype=dtype, method=method)
        assert np.isfinite(result.positions).all()
        assert result.normals is not None
        lengths = np.linalg.norm(result.normals.astype(float), axis=-1)
        np.testing.assert_allclose(lengths, 1, atol=1e-6)


@each_method
@pytest.mark.parametrize("is_float32", [False, True])
@pytest.mark.parametrize("name", ["utah-teapot", "sphere", "torus", "cube", "mixed"])
def test_the_method_does_not_change_faces_and_welds(
    method: Method, is_float32: bool, name: str
) -> None:
    """Faces and shared vertices are the same as with `matrix`, so closed meshes stay closed."""
    source: Any = name
    if name == "cube":
        source = build_cube((0, 3, 5, 6, 0, 3))  # u and v rotated, with the normals still outwards
    if name == "mixed":
        rng = np.random.default_rng(2)
        square, triangle = rng.standard_normal((4, 4, 3)), rng.standard_normal((10, 3))
        # The side t = 0 of the triangle is the side u = 1 of the square.
        triangle[[0, 1, 2, 3]] = square[-1]
        source = build_mixed_model([square, triangle])
    for resolution in ((6, 6), (3, 7)):
        expected = build_mesh(source, is_float32=is_float32, resolution=resolution)
        result = build_mesh(source, is_float32=is_float32, resolution=resolution, method=method)
        np.testing.assert_array_equal(result.triangles, expected.triangles)
        np.testing.assert_allclose(result.positions, expected.positions, rtol=0, atol=1e-5)
        assert result.report.watertight == expected.report.watertight
        assert result.report.boundary_edges == expected.report.boundary_edges
        if expected.welds is not None:
            np.testing.assert_array_equal(result.welds, expected.welds)
            check_welds(result)


def check_welds(mesh: Mesh) -> None:
    """Checks that vertices that `welds` joins have positions with equal bits."""
    np.testing.assert_array_equal(mesh.positions[mesh.welds], mesh.positions)


@each_method
@each_dtype
def test_chunks_have_no_effect(
    method: Method, dtype: Real, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compares one chunk with chunks of a few samples; the grid has 120, the triangle 78."""
    rng = np.random.default_rng(6)
    batches: list[Patches] = [
        TensorPatches(rng.standard_normal((7, 4, 3, 3)), rng.uniform(0.5, 2, (7, 4, 3))),
        TrianglePatches(rng.standard_normal((7, 10, 3))),
    ]
    in_one_chunk = [evaluate(patches, (9, 11), dtype=dtype, method=method) for patches in batches]
    monkeypatch.setattr(de_casteljau, "CHUNK_NUMBERS", 1)
    monkeypatch.setattr(de_casteljau, "MIN_SAMPLES", 13)
    monkeypatch.setattr(forward_difference, "CHUNK_SAMPLES", 40)
    atol = 1e-13 if dtype is np.float64 else 1e-6
    for patches, expected in zip(batches, in_one_chunk, strict=True):
        result = evaluate(patches, (9, 11), dtype=dtype, method=method)
        np.testing.assert_allclose(result.positions, expected.positions, rtol=0, atol=atol)
        assert result.normals is not None
        assert expected.normals is not None
        np.testing.assert_allclose(result.normals, expected.normals, rtol=0, atol=100 * atol)


@given(nets(degree=st.integers(1, 8)), st.integers(1, 40))
def test_starting_differences_are_exact(net: Array, divisions: int) -> None:
    """Compares with exact differences Δ^k of the samples at 0, h, …, n h, also beyond the end."""
    curve = net[:, :1]
    result = find_starting_differences(curve.swapaxes(1, 2), np.array([divisions]))
    points = [tuple(Fraction(x) for x in row[0]) for row in curve.tolist()]
    values = [exact.curve_point(points, Fraction(k, divisions)) for k in range(len(points))]
    for k in range(len(points)):
        # Rounding errors grow with the order of the difference. If the curve has more points than
        # divisions, they also grow with the parameters beyond the end of the domain.
        scale = 2.0 ** (2 * k) * 16 * max(1, len(points) / divisions) ** (2 * len(points))
        expected = np.array([float(x) for x in values[0]])  # Δ^k at 0
        np.testing.assert_allclose(result[k, :, 0], expected, rtol=0, atol=1e-14 * scale)
        values = [tuple(b - a for a, b in zip(x, y, strict=True)) for x, y in pairwise(values)]


def test_errors_of_forward_differences_grow_with_the_divisions() -> None:
    """In float32 the error is about 1e-8 R of the size of a cubic patch, so 1e-4 at R = 4096."""
    rng = np.random.default_rng(12)
    patches = TensorPatches(rng.uniform(-1, 1, (4, 4, 4, 3)))
    errors = {}
    for divisions in (64, 512, 4096):
        expected = evaluate(patches, (2, divisions), normals=False).positions
        result = evaluate(
            patches, (2, divisions), dtype=np.float32, normals=False, method="forward_difference"
        )
        errors[divisions] = float(np.abs(result.positions - expected).max()) / patches.extent
        double = evaluate(patches, (2, divisions), normals=False, method="forward_difference")
        assert np.abs(double.positions - expected).max() <= 2.0**-52 * divisions * patches.extent
    assert errors[64] < errors[512] < errors[4096] < 1e-4
    assert errors[4096] > 10 * errors[64]
    for divisions, error in errors.items():
        assert 1e-9 * divisions < error < 3e-8 * divisions


@pytest.mark.parametrize(("p", "q"), [(1, 1), (3, 3), (2, 5), (6, 1)])
def test_effort_counts_the_multiplications(p: int, q: int) -> None:
    """Two multiplications for each interpolated coordinate, in the order of de Casteljau's steps.

    While both degrees are above 0, a step along u and one along v follow each other; then the
    remaining row of points is interpolated.
    """
    count, rows, columns = 0, p + 1, q + 1
    while rows > 1 and columns > 1:
        count += sum(2 for _ in range(rows - 1) for _ in range(columns))
        count += sum(2 for _ in range(rows - 1) for _ in range(columns - 1))
        rows, columns = rows - 1, columns - 1
    for points in range(max(rows, columns) - 1, 0, -1):
        count += 2 * points
    patches = TensorPatches(np.zeros((2, p + 1, q + 1, 3)))
    assert de_casteljau.count_multiplications(patches) == 3 * count
    # Two patches have 5 × 7 samples each.
    model = build_model(list(patches.points))
    assert de_casteljau.estimate_effort(model, (4, 6)) == 2 * 5 * 7 * 3 * count
    # A rational cubic triangle: 6, 3 and 1 points are interpolated, each from three points with
    # four homogeneous coordinates.
    cubic = TrianglePatches(np.zeros((1, 10, 3)), np.ones((1, 10)))
    assert de_casteljau.count_multiplications(cubic) == 4 * 3 * (6 + 3 + 1)
