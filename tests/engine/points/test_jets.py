"""Points and partials at arbitrary parameters, compared with fractions."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact
from service.engine.points.jets import evaluate_jets
from service.surface.batches import TensorPatches
from tests.strategies import Array, nets, translate, weighted_nets
from tools.examples import lower_example

LIMITS = (1e-12, 1e-9, 1e-9, 1e-7, 1e-7, 1e-7)
"""Tolerances of S, S_u, S_v, S_uu, S_uv, S_vv, relative to the size of the net."""

parameters = st.lists(
    st.tuples(*[st.sampled_from([0.0, 1.0, 0.5]) | st.integers(0, 97).map(lambda k: k / 97)] * 2),
    min_size=1,
    max_size=4,
)


def build_batch(net: Array, weights: Array | None = None) -> TensorPatches:
    return TensorPatches(np.array(net)[None], None if weights is None else np.array(weights)[None])


def evaluate_partials(
    net: Array, weights: Array | None, places: list[tuple[float, float]], order: int = 2
) -> Array:
    u, v = np.array(places).T
    index = np.zeros(len(u), dtype=np.intp)
    return evaluate_jets(build_batch(net, weights), index, u, v, order).partials


def measure_size(net: Array) -> float:
    """The largest extent of a net, or 1 if it is one point."""
    return float((net.max(axis=(0, 1)) - net.min(axis=(0, 1))).max()) or 1.0


def check_partials(net: Array, weights: Array | None, places: list[tuple[float, float]]) -> None:
    """Compares all partials with exact partials, within `LIMITS`."""
    result = evaluate_partials(net, weights, places)
    exact_net = exact.to_exact_net(net, weights)
    for k, (u, v) in enumerate(places):
        expected_jet = exact.second_jet(exact_net, Fraction(u), Fraction(v))
        for actual, expected, limit in zip(result[:, k], expected_jet, LIMITS, strict=True):
            assert np.abs(actual - np.array(expected, dtype=float)).max() <= limit * measure_size(
                net
            )


@given(weighted_nets(nets(degree=st.integers(1, 8))), parameters)
def test_partials_agree_with_fractions(
    surface: tuple[Array, Array | None], places: list[tuple[float, float]]
) -> None:
    check_partials(*surface, places)


@given(weighted_nets(nets(degree=st.integers(1, 4))), parameters)
def test_partials_keep_their_digits_far_from_the_origin(
    surface: tuple[Array, Array | None], places: list[tuple[float, float]]
) -> None:
    net, weights = surface
    near = evaluate_partials(net, weights, places)
    far = evaluate_partials(translate(net, 2.0**20, -(2.0**21)), weights, places)
    np.testing.assert_allclose(far[1:], near[1:], rtol=0, atol=1e-8)
    # Numbers from 2²¹ on are multiples of 2⁻³¹.
    np.testing.assert_allclose(far[0] - [2.0**20, -(2.0**21), 0], near[0], rtol=0, atol=2.0**-31)


def test_points_at_corners_and_poles_are_control_points() -> None:
    """Corner points equal the control points, bit for bit, as in a mesh."""
    patches = lower_example("sphere")
    for patch in range(patches.count):
        for corner, (u, v) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
            actual = evaluate_jets(
                patches, np.array([patch]), np.array([u * 1.0]), np.array([v * 1.0]), order=0
            )
            # The rows and columns −0 and −1 of the net are its first and its last.
            net = patches.points[patch]
            np.testing.assert_array_equal(actual.partials[0, 0], net[-u, -v], err_msg=str(corner))
    south = evaluate_jets(
        patches, np.zeros(7, dtype=np.intp), np.linspace(0, 1, 7), np.zeros(7), order=1
    )
    np.testing.assert_array_equal(south.partials[0], np.tile([0.0, 0.0, -1.0], (7, 1)))
    assert south.degenerate is not None
    assert south.degenerate.all()
    assert south.normals is not None
    np.testing.assert_allclose(south.normals, np.tile([0.0, 0.0, -1.0], (7, 1)), atol=1e-15)


def test_the_order_decides_which_partials_are_computed() -> None:
    patches = lower_example("saddle")
    middle = np.array([0.5])
    for order, count in enumerate((1, 3, 6)):
        result = evaluate_jets(patches, np.array([0]), middle, middle, order)
        assert len(result.partials) == count
        assert (result.normals is None, result.degenerate is None) == (order < 1, order < 1)
        assert (result.curvatures is None) == (order < 2)
