"""Points and partials of B-splines in the parameters of their own domain, compared with SciPy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import NdBSpline

from service.bases import knots as knot
from service.engine.points.evaluate import Columns, evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.surface.bspline import BsplineSurface
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights
from tests.strategies import Array

ORDERS = {
    "positions": (0, 0),
    "du": (1, 0),
    "dv": (0, 1),
    "duu": (2, 0),
    "duv": (1, 1),
    "dvv": (0, 2),
}
LIMITS = (1e-12, 1e-9, 1e-7)
"""The relative tolerances of partials of the orders 0, 1 and 2."""

shares = st.lists(st.floats(0, 1), min_size=1, max_size=5)
"""Parameters as shares of a domain: 0 is its beginning, 1 its end."""


def evaluate_columns(surface: BsplineSurface, uv: Array) -> Columns:
    """All columns, up to the second partials, at parameters (m, 2)."""
    model = surface.lower()
    return evaluate_points(model, locate(model, PointsQuery(uv, patch=None, order=2)), 2)


def compute_derivatives(surface: BsplineSurface, uv: Array) -> dict[str, Array]:
    """Partials of the homogeneous B-spline by SciPy, then of the surface by the quotient rule.

    S = X/w, w S_a = X_a − w_a S, w S_ab = X_ab − w_ab S − w_a S_b − w_b S_a
    """
    net = surface.control_net
    weights = np.ones(net.shape[:2]) if surface.weights is None else surface.weights
    homogeneous_net = np.concatenate([net * weights[..., None], weights[..., None]], axis=-1)
    spline = NdBSpline(surface.knot_vectors, homogeneous_net, surface.degree)
    x, w = {}, {}
    for order in ORDERS.values():
        # SciPy refuses derivatives above the degree, which are zero.
        if any(n > p for n, p in zip(order, surface.degree, strict=True)):
            value = np.zeros((len(uv), 4))
        else:
            value = spline(uv, nu=order)
        x[order], w[order] = value[:, :3], value[:, 3:]
    s = {(0, 0): x[0, 0] / w[0, 0]}
    for a in ((1, 0), (0, 1)):
        s[a] = (x[a] - w[a] * s[0, 0]) / w[0, 0]
    for a, b, ab in (((1, 0), (1, 0), (2, 0)), ((1, 0), (0, 1), (1, 1)), ((0, 1), (0, 1), (0, 2))):
        s[ab] = (x[ab] - w[ab] * s[0, 0] - w[a] * s[b] - w[b] * s[a]) / w[0, 0]
    return {name: s[order] for name, order in ORDERS.items()}


def compare_with_scipy(surface: BsplineSurface, uv: Array) -> None:
    """Compares all columns, within `LIMITS` of their order, times the largest value or 1."""
    result, expected = evaluate_columns(surface, uv), compute_derivatives(surface, uv)
    for name, order in ORDERS.items():
        size = max(float(np.abs(expected[name]).max()), 1.0)
        np.testing.assert_allclose(
            result[name], expected[name], rtol=0, atol=LIMITS[sum(order)] * size
        )


@given(
    knot_vectors(), knot_vectors(), st.integers(0, 10**6), st.booleans(), st.tuples(shares, shares)
)
def test_partials_agree_with_scipy(
    u: KnotVector,
    v: KnotVector,
    seed: int,
    is_rational: bool,
    inner_shares: tuple[list[float], ...],
) -> None:
    """At breaks, both libraries give the partials of the span that begins there."""
    weights = random_weights(u.point_count, seed, v.point_count) if is_rational else None
    net = random_points(u.point_count, seed, v.point_count)
    surface = BsplineSurface(net, (u.degree, v.degree), (u.knots, v.knots), weights)
    parameter_lines = []
    for vector, parameter_shares in zip((u, v), inner_shares, strict=True):
        low, high = knot.domain(*vector)
        inner_parameters = np.clip(low + (high - low) * np.array(parameter_shares), low, high)
        parameter_lines.append(np.concatenate([knot.breaks(*vector), inner_parameters]))
    uv = np.stack(np.meshgrid(*parameter_lines, indexing="ij"), axis=-1).reshape(-1, 2)
    compare_with_scipy(surface, uv)


def test_partials_at_a_crease_are_those_of_the_right_span() -> None:
    """At the end of the domain the partials are those of the last span."""
    vector = np.array([0, 0, 0, 1, 1, 2, 2, 2.0])
    net = random_points(5, 3, 2)  # 5 × 2 points, of the seed 3
    result = evaluate_columns(
        BsplineSurface(net, (2, 1), (vector, "clamped")), np.array([[1.0, 0], [2.0, 0]])
    )
    np.testing.assert_allclose(result["du"][0], 2 * (net[3, 0] - net[2, 0]), atol=1e-12)
    np.testing.assert_allclose(result["du"][1], 2 * (net[4, 0] - net[3, 0]), atol=1e-12)
