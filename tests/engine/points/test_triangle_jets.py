"""Points, partials and curvatures of triangles, compared with fractions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from oracles import exact, triangles
from service.engine.evaluation import triangle_nets
from service.engine.evaluation.evaluate import evaluate
from service.engine.points.jets import evaluate_jets
from service.surface.batches import TrianglePatches
from tests.strategies import Array

LIMITS = (1e-12, 1e-9, 1e-9, 1e-7, 1e-7, 1e-7)
"""Tolerances of S, S_s, S_t, S_ss, S_st, S_tt, relative to the size of the net."""


@st.composite
def surfaces(draw: st.DrawFn, low: int = 1, high: int = 6) -> tuple[Array, Array | None]:
    """Nets of triangles of degrees from low to high, and weights or None."""
    degree = draw(st.integers(low, high))
    count = (degree + 1) * (degree + 2) // 2
    coordinates = st.integers(-128, 128).map(lambda k: k / 16)
    net = draw(arrays.arrays(np.float64, (count, 3), elements=coordinates))
    ratios = st.integers(13, 320).map(lambda k: k / 64)
    return net, draw(st.none() | arrays.arrays(np.float64, (count,), elements=ratios))


grid_places = st.lists(
    st.tuples(st.integers(0, 16), st.integers(0, 16)).filter(lambda p: sum(p) <= 16),
    min_size=1,
    max_size=3,
)


def build_batch(net: Array, weights: Array | None) -> TrianglePatches:
    return TrianglePatches(net[None].copy(), None if weights is None else weights[None].copy())


def evaluate_at(
    net: Array, weights: Array | None, places: list[tuple[float, float]]
) -> list[Array]:
    """The six partials (6, m, 3) and the four curvatures (4, m) of one patch at (s, t)."""
    s, t = np.array(places, dtype=float).T
    result = evaluate_jets(
        build_batch(net, weights), np.zeros(len(s), dtype=np.intp), s, t, order=2
    )
    assert result.curvatures is not None
    return [result.partials, result.curvatures]


@given(surfaces(), grid_places)
def test_partials_and_curvatures_agree_with_fractions(
    surface: tuple[Array, Array | None], places: list[tuple[int, int]]
) -> None:
    partials, curvatures = evaluate_at(*surface, [(j / 16, k / 16) for j, k in places])
    net = triangles.to_exact_triangle(*surface)
    size = float(np.ptp(surface[0], axis=0).max()) or 1.0
    for row, (j, k) in enumerate(places):
        place = (Fraction(16 - j - k, 16), Fraction(j, 16), Fraction(k, 16))
        jet = triangles.second_jet(net, place)
        for actual, expected, limit in zip(partials[:, row], jet, LIMITS, strict=True):
            assert np.abs(actual - np.array(expected, dtype=float)).max() <= limit * size
        normal = exact.cross(jet[1], jet[2])
        # Curvatures are compared where the partials are not nearly parallel.
        squared_lengths = [float(exact.dot(d, d)) for d in (jet[1], jet[2])]
        if float(exact.dot(normal, normal)) > 1e-4 * squared_lengths[0] * squared_lengths[1] > 0:
            exact_curvatures = np.array(exact.compute_curvatures(jet), dtype=float)
            scale = max(1.0, np.abs(exact_curvatures).max())
            np.testing.assert_allclose(
                curvatures[:, row], exact_curvatures, rtol=0, atol=1e-7 * scale
            )


@pytest.mark.slow
@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("axis", range(3))
def test_curvatures_at_and_near_a_side_that_is_one_point_are_right(
    axis: int, is_rational: bool
) -> None:
    """The next row of control points is in a plane with that point, so the limit is finite."""
    keys = triangles.keys(2)
    net = np.zeros((6, 3))
    for row, key in enumerate(keys):
        # Points of the side, of the row beside the side, and of the opposite corner.
        k = key[(axis + 1) % 3]
        net[row] = ([0, 0, 0], [1 - k, k, 0], [1, 1, 2])[key[axis]]
    ratios = np.array([1.0 + 0.5 * key[axis] + 0.25 * key[0] for key in keys])
    weights = ratios if is_rational else None
    exact_net = triangles.to_exact_triangle(net, weights)
    values = []
    for distance in (0.0, 1e-14, 1e-10, 1e-7, 1e-4, 2.0**-5, 0.25):
        place = np.roll([distance, 0.375 * (1 - distance), 0.625 * (1 - distance)], axis)
        partials, curvatures = evaluate_at(net, weights, [(place[1], place[2])])
        assert np.isfinite(partials).all()
        values.append(curvatures[:, 0])
        if distance > 0:
            s, t = Fraction(float(place[1])), Fraction(float(place[2]))
            jet = triangles.second_jet(exact_net, (1 - s - t, s, t))
            expected = np.array(exact.compute_curvatures(jet), dtype=float)
            # On axis 0 the distance is r = 1 − s − t: rounding s and t changes the digits of a
            # small r.
            limit = 1e-8 if axis else 1e-8 + 1e-15 / distance
            np.testing.assert_allclose(values[-1], expected, rtol=limit, atol=1e-9)
    np.testing.assert_allclose(values[0], values[1], rtol=1e-8, atol=1e-9)
    assert abs(values[0][1]) > 0.1  # the mean curvature; if it were 0, the test would prove little


def test_points_and_normals_at_corners_are_the_same_as_in_a_mesh() -> None:
    """At the first corner two sides are parallel: the normal is a limit."""
    net = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 1], [0.5, 0, 0], [1, 1, 1], [1, 2, 0.3]])
    s, t = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
    patches = build_batch(net, None)
    result = evaluate_jets(patches, np.zeros(3, dtype=np.intp), s, t, order=1)
    np.testing.assert_array_equal(result.partials[0], net[[0, 2, 5]])
    assert result.degenerate is not None
    np.testing.assert_array_equal(result.degenerate, [True, False, False])
    assert result.normals is not None
    samples = evaluate(patches, (2, 2))  # as in a mesh; six, of which 0, 2 and 5 are corners
    np.testing.assert_array_equal(samples.positions[0, [0, 2, 5]], net[[0, 2, 5]])
    assert samples.normals is not None
    np.testing.assert_allclose(result.normals, samples.normals[0, [0, 2, 5]], atol=1e-12)


def test_chunks_have_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    patches = TrianglePatches(rng.standard_normal((5, 10, 3)), rng.uniform(0.5, 2, (5, 10)))
    index = rng.integers(0, 5, 40)
    s, t = rng.random((2, 40)) / 2
    in_one_chunk = evaluate_jets(patches, index, s, t, order=2)
    monkeypatch.setattr(triangle_nets, "CHUNK_POINTS", 70)
    in_small_chunks = evaluate_jets(patches, index, s, t, order=2)
    np.testing.assert_allclose(in_small_chunks.partials, in_one_chunk.partials, rtol=0, atol=1e-12)
    assert in_one_chunk.curvatures is not None
    assert in_small_chunks.curvatures is not None
    np.testing.assert_allclose(in_small_chunks.curvatures[1], in_one_chunk.curvatures[1], rtol=1e-9)
