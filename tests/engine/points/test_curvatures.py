"""Curvatures, also at and near poles, compared with formulas and with 50 digits."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from oracles import exact
from service.engine.points.jets import evaluate_jets
from service.surface.batches import TensorPatches
from service.surface.examples import quadrics
from service.surface.patches import PatchSurface
from tests.strategies import Array, height_nets, nets, weighted_nets, weights_like

ROOT_HALF = np.sqrt(0.5)


def build_batch(net: Array, weights: Array | None = None) -> TensorPatches:
    return TensorPatches(np.array(net)[None], None if weights is None else np.array(weights)[None])


def lower_patches(surface: PatchSurface) -> TensorPatches:
    (patches,) = surface.lower().batches
    assert isinstance(patches, TensorPatches)
    return patches


def evaluate_curvatures(
    patches: TensorPatches, patch: int, places: list[tuple[float, float]]
) -> Array:
    u, v = np.array(places).T
    result = evaluate_jets(patches, np.full(len(u), patch), u, v, order=2).curvatures
    assert result is not None
    return result


def scatter_points(patches: TensorPatches, count: int = 200) -> tuple[Array, Array, Array, Array]:
    """Points, normals, curvatures and `degenerate` at random places, also on borders."""
    rng = np.random.default_rng(3)
    index = np.arange(count) % patches.count
    u, v = rng.random((2, count))
    u[::7], v[::5], u[::11], v[::13] = 0, 1, 1, 0
    result = evaluate_jets(patches, index, u, v, order=2)
    assert result.curvatures is not None
    assert result.normals is not None
    return result.partials[0], result.normals, result.curvatures, np.array(result.degenerate)


@pytest.mark.parametrize("radius", [1.0, 3.0, 1e-12, 1e12])
def test_all_curvatures_of_a_sphere_are_equal_also_at_its_poles(radius: float) -> None:
    """K = 1/r², H = k_1 = k_2 = −1/r: the normals point outwards."""
    _, _, result, degenerate = scatter_points(lower_patches(quadrics.sphere(radius)))
    assert degenerate.any()
    np.testing.assert_allclose(result[0] * radius**2, 1, rtol=0, atol=1e-11)
    for k in result[1:]:
        np.testing.assert_allclose(k * radius, -1, rtol=0, atol=1e-11)


def test_a_cone_has_no_mean_curvature_at_its_apex() -> None:
    """H = −cos α / (2ρ) is unbounded near the apex; K is 0 along every ruling.

    ρ is the distance from the axis, and α the angle between the axis and a ruling.
    """
    patches = lower_patches(quadrics.cone(1.0, 2.0))
    places = [(0.4, v) for v in (0.0, 0.5, 0.9, 1 - 1e-6, 1.0)]
    result = evaluate_curvatures(patches, 0, places)
    np.testing.assert_allclose(result[0], 0, atol=1e-9)
    # The radius is 1 and the height is 2, so cos α = 2 / √5.
    rho = 1 - np.array([v for _, v in places[:-1]])
    np.testing.assert_allclose(result[1][:-1], -2 / np.sqrt(5) / (2 * rho), rtol=1e-8)
    assert np.isnan(result[1:, -1]).all()


def test_an_ellipsoid_has_two_principal_curvatures_at_its_pole() -> None:
    """With half axes a, b, c they are −c/a² and −c/b², along every line to the pole."""
    sphere = lower_patches(quadrics.sphere())
    patches = TensorPatches(sphere.points * [3.0, 2.0, 1.5], sphere.weights)
    # Patch 5 has the pole (0, 0, c) as its side v = 1.
    result = evaluate_curvatures(
        patches, 5, [(u, v) for u in (0.0, 0.3, 1.0) for v in (1.0, 1 - 1e-9)]
    )
    np.testing.assert_allclose(result[2], -1.5 / 9, rtol=1e-8)
    np.testing.assert_allclose(result[3], -1.5 / 4, rtol=1e-8)
    np.testing.assert_allclose(result[0], 1.5**2 / 36, rtol=1e-8)


def test_curvatures_at_a_pole_are_limits_unless_the_zero_of_the_normal_is_of_order_5() -> None:
    """The paraboloid z = x² + y² with the radius v, v² and v³: at the pole v = 0, the normal
    S_u × S_v has a zero of order 1, 3 and 5. Zeros are examined up to order 4; above, curvatures
    are NaN.
    """
    arc = np.array([[1.0, 0], [1, 1], [0, 1]])
    for power, has_curvature in ((1, True), (2, True), (3, False)):
        # Bernstein coefficients of r = v^power and of r², in degree n = 2 power.
        n = 2 * power
        net = np.zeros((3, n + 1, 3))
        radius, squared_radius = np.zeros(n + 1), np.zeros(n + 1)
        for j in range(n + 1):
            radius[j] = np.prod([(j - i) / (n - i) for i in range(power)])
        squared_radius[-1] = 1
        net[..., :2] = arc[:, None] * radius[:, None]
        net[..., 2] = squared_radius
        weights = np.outer([1, ROOT_HALF, 1], np.ones(n + 1))
        result = evaluate_curvatures(build_batch(net, weights), 0, [(0.25, 0.0)])
        if has_curvature:
            assert result[0] == pytest.approx(4, rel=1e-9)
            assert abs(result[1][0]) == pytest.approx(2, rel=1e-9)
            assert abs(result[3][0]) == pytest.approx(2, rel=1e-9)
        else:
            assert np.isnan(result).all()


@given(
    weighted_nets(height_nets(degree=st.integers(1, 4))),
    st.lists(st.tuples(*[st.integers(0, 16)] * 2), min_size=1, max_size=3),
)
def test_curvatures_agree_with_50_digits(
    surface: tuple[Array, Array | None], places: list[tuple[int, int]]
) -> None:
    check_curvatures(*surface, [(i / 16, j / 16) for i, j in places], 1e-9)


@st.composite
def nets_with_pole(draw: st.DrawFn) -> tuple[Array, Array | None]:
    """Nets with a side that is one point, at which the surface has a tangent plane."""
    net = draw(nets(degree=st.integers(2, 4), limit=4)).copy()
    net[:, 0] = net[0, 0]
    net[..., 2] = np.where(np.arange(net.shape[1]) < 2, net[0, 0, 2], net[..., 2])
    # Seen from the pole, the second points turn to the left: all normals at the pole are equal.
    for i in range(len(net)):
        net[i, 1, :2] = net[0, 0, :2] + [16.0 - i, 1.0 + i * i]
    weights = draw(st.none() | weights_like(net))
    return net, weights


@given(nets_with_pole(), st.sampled_from([1e-3, 1e-5, 1e-7, 1e-9]), st.integers(0, 8))
def test_curvatures_near_a_pole_keep_their_digits(
    surface: tuple[Array, Array | None], distance: float, eighths: int
) -> None:
    check_curvatures(*surface, [(eighths / 8, distance)], 1e-8, principal_limit=1e-5)


def check_curvatures(
    net: Array,
    weights: Array | None,
    places: list[tuple[float, float]],
    limit: float,
    *,
    principal_limit: float | None = None,
) -> None:
    """Compares all four curvatures with exact curvatures, within a tolerance `limit`.

    It is relative to the largest of |H|, |k_1|, |k_2| and 1. `principal_limit` is the tolerance of
    k_1 and k_2, which lose digits in a square root.
    """
    result = evaluate_curvatures(build_batch(net, weights), 0, places)
    exact_net = exact.to_exact_net(net, weights)
    for k, (u, v) in enumerate(places):
        _, du, dv, *_ = exact.second_jet(exact_net, Fraction(u), Fraction(v))
        assume(any(exact.cross(du, dv)))
        gaussian, mean, larger, smaller = (
            float(x) for x in exact.curvatures(exact_net, Fraction(u), Fraction(v))
        )
        scale = max(abs(mean), abs(larger), abs(smaller), 1.0)
        assert result[0][k] == pytest.approx(gaussian, abs=limit * scale**2)
        assert result[1][k] == pytest.approx(mean, abs=limit * scale)
        for actual, expected_value in (
            (result[2][k], larger),
            (result[3][k], smaller),
        ):
            assert actual == pytest.approx(expected_value, abs=(principal_limit or limit) * scale)
