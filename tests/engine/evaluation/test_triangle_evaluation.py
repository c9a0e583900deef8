"""Evaluation of triangular patches, compared with exact arithmetic."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact, triangles
from service.bases import triangle, triangle_basis
from service.engine.evaluation import triangle_evaluation
from service.engine.evaluation.evaluate import evaluate
from service.engine.scratch import Real
from service.surface.batches import TrianglePatches
from tests.strategies import Array, triangle_nets, weights_like

few_divisions = st.integers(1, 4)


def build_batch(net: Array, weights: Array | None = None) -> TrianglePatches:
    """A batch of one triangle."""
    return TrianglePatches(net[None].copy(), None if weights is None else weights[None].copy())


@st.composite
def weighted_nets(draw: st.DrawFn, base: st.SearchStrategy[Array]) -> tuple[Array, Array | None]:
    """A net, with weights or None."""
    net = draw(base)
    return net, draw(st.none() | weights_like(net))


def build_hills(degree: int, count: int = 1, is_rational: bool = False) -> TrianglePatches:
    """`count` random graphs with small heights over the same triangle."""
    rng = np.random.default_rng(degree)
    places = triangle.barycentric(degree)[:, 1:]
    heights = rng.uniform(-0.2, 0.2, (count, len(places), 1))
    points = np.concatenate([np.broadcast_to(places, (count, *places.shape)), heights], axis=-1)
    weights = rng.uniform(0.5, 2, points.shape[:2]) if is_rational else None
    return TrianglePatches(points, weights)


@given(weighted_nets(triangle_nets()), few_divisions)
def test_positions_agree_with_exact_arithmetic(
    surface: tuple[Array, Array | None], divisions: int
) -> None:
    net, weights = surface
    expected = triangles.positions(triangles.jets(net, weights, divisions))
    # A triangle takes the larger of the two divisions.
    result = evaluate(build_batch(net, weights), (divisions, 1), normals=False)
    assert result.normals is None
    assert result.positions.shape == (1, len(expected), 3)
    np.testing.assert_allclose(
        result.positions[0], expected, rtol=0, atol=1e-12 * np.abs(net).max()
    )


@given(weighted_nets(triangle_nets()), few_divisions)
def test_normals_agree_with_exact_arithmetic(
    surface: tuple[Array, Array | None], divisions: int
) -> None:
    """Where du × dv vanishes, normals are unit vectors, and `poles` counts the samples."""
    net, weights = surface
    expected = triangles.normals(triangles.jets(net, weights, divisions))
    result = evaluate(build_batch(net, weights), (divisions, divisions))
    assert result.normals is not None
    is_pole = np.isnan(expected[:, 0])
    assert result.poles == is_pole.sum()
    assert np.abs(result.normals[0] - expected)[~is_pole].max(initial=0) < 1e-9
    np.testing.assert_allclose(np.linalg.norm(result.normals[0], axis=1), 1.0, rtol=1e-14)


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("degree", [1, 2, 3, 7, 12])
def test_float32_keeps_its_digits_far_from_zero(degree: int, is_rational: bool) -> None:
    """Positions are relative to a local origin."""
    near = build_hills(degree, 5, is_rational)
    origin = np.array([3e5, -1e5, 2e6])
    # The reference includes the rounding errors of adding the origin.
    far = TrianglePatches(near.points + origin, near.weights)
    reference = TrianglePatches(far.points - origin, near.weights)
    expected = evaluate(reference, (9, 9))
    result = evaluate(far, (9, 9), dtype=np.float32, origin=origin)
    assert result.normals is not None
    assert expected.normals is not None
    assert result.positions.dtype == result.normals.dtype == np.float32
    assert np.abs(result.positions - expected.positions).max() < 5e-7
    assert np.abs(result.normals - expected.normals).max() < 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("degree", [1, 3, 6])
def test_chunks_have_no_effect(
    degree: int, is_rational: bool, dtype: Real, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Evaluates many patches together, then few samples at a time, then without cached bases."""
    patches = build_hills(degree, 40, is_rational)
    in_one_chunk = evaluate(patches, (11, 11), dtype=dtype)
    monkeypatch.setattr(triangle_evaluation, "CHUNK_SAMPLES", 50)
    in_small_chunks = evaluate(patches, (11, 11), dtype=dtype)
    monkeypatch.setattr(triangle_basis, "MAX_CACHED_VALUES", 200)
    without_cached_basis = evaluate(patches, (11, 11), dtype=dtype)
    for result in (in_small_chunks, without_cached_basis):
        for result_rows, expected_rows in (
            (result.positions, in_one_chunk.positions),
            (result.normals, in_one_chunk.normals),
        ):
            assert result_rows is not None
            assert expected_rows is not None
            assert np.abs(result_rows - expected_rows).max() < 50 * np.finfo(dtype).eps


def build_degenerate_nets() -> dict[str, Any]:
    """Nets with collapsed sides, with repeated points, on a line, or equal to one point."""
    net = build_hills(3).points[0]
    sides = triangle.side_rows(3)  # the rows of the control points on each side
    cases = {}
    for number in range(3):
        side_net = net.copy()
        side_net[sides[number]] = net[sides[number][0]]
        cases[f"side {number}"] = side_net
        repeated_net = net.copy()
        repeated_net[sides[number][1]] = net[sides[number][0]]
        cases[f"repeated point {number}"] = repeated_net
    two_sides_net = net.copy()
    two_sides_net[np.unique(sides[:2])] = net[0]
    cases["two sides"] = two_sides_net
    cases["line"] = net * (1.0, 0.0, 0.0)
    cases["point"] = np.ones_like(net)
    cases["all sides"] = np.where(np.isin(np.arange(10), np.unique(sides))[:, None], 0.0, net)
    return cases


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize(
    "net", build_degenerate_nets().values(), ids=build_degenerate_nets().keys()
)
def test_degenerate_triangles_have_unit_normals(net: Array, is_rational: bool, dtype: Real) -> None:
    """Where du × dv does not vanish, normals also agree with exact arithmetic."""
    weights = build_hills(3, is_rational=True).weights if is_rational else None
    expected = triangles.normals(triangles.jets(net, None if weights is None else weights[0], 4))
    result = evaluate(TrianglePatches(net[None].copy(), weights), (4, 4), dtype=dtype)
    assert result.normals is not None
    lengths = np.linalg.norm(result.normals[0].astype(float), axis=1)
    assert np.abs(lengths - 1).max() < 4 * np.finfo(dtype).eps
    is_pole = np.isnan(expected[:, 0])
    assert result.poles == is_pole.sum()
    assert np.abs(result.normals[0] - expected)[~is_pole].max(initial=0) < 1e-5


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("symmetry", range(6))
def test_normals_along_a_collapsed_side_are_those_of_the_cone(
    symmetry: int, is_rational: bool
) -> None:
    """Near the collapsed side, the triangle is to first order the cone over C, its next row.

    So the normal is along C × C'. The collapsed side of the net is s = 0; the six symmetries make
    it each side, in both directions.
    """
    rng = np.random.default_rng(5)
    net = np.array([[j, k, 0] for _, j, k in triangles.keys(4)]) + rng.uniform(-0.2, 0.2, (15, 3))
    is_on_side = [key[1] == 0 for key in triangles.keys(4)]
    net[is_on_side] = net[0]
    weights = rng.uniform(0.5, 2, 15) if is_rational else np.ones(15)
    is_next_row = [key[1] == 1 for key in triangles.keys(4)]
    cone = exact.to_exact_net([(net[is_next_row] - net[0]) * weights[is_next_row, None]])[0]
    slope = [tuple(y - x for x, y in zip(a, b, strict=True)) for a, b in pairwise(cone)]
    cone_normals = [
        exact.normalize(exact.cross(exact.curve_point(cone, t), exact.curve_point(slope, t)))
        for t in exact.list_parameters(6)
    ]
    transformed = build_batch(
        triangles.apply_symmetry(net, symmetry), triangles.apply_symmetry(weights, symmetry)
    )
    result = evaluate(transformed if is_rational else TrianglePatches(transformed.points), (6, 6))
    assert result.normals is not None
    assert result.poles == 7  # all samples of the side
    is_collapsed = triangles.apply_symmetry(
        np.array([key[1] == 0 for key in triangles.keys(6)]), symmetry
    )
    # Each sample of the collapsed side has moved from the parameter t = order / 6.
    order = triangles.apply_symmetry(np.array([key[2] for key in triangles.keys(6)]), symmetry)[
        is_collapsed
    ]
    sign = -1 if symmetry >= 3 else 1  # these symmetries are reflections
    expected = sign * np.array(cone_normals)[order]
    assert np.abs(result.normals[0][is_collapsed] - expected).max() < 1e-11
