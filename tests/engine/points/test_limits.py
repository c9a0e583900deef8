"""Where S_u and S_v are parallel: what is answered does not depend on which of them is called u."""

from math import comb

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from oracles import triangles
from service.engine.points.jets import Jets, evaluate_jets
from service.surface.batches import TensorPatches, TrianglePatches
from tests.strategies import Array, weights_like

CORNERS = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]

turns = st.integers(0, 9).map(lambda k: Rotation.random(random_state=k).as_matrix())


def evaluate(net: Array, weights: Array | None, places: list[tuple[float, float]]) -> Jets:
    """Values at places of a patch, (s, t) on a triangle."""
    u, v = np.array(places).T
    batch_weights = None if weights is None else weights[None]
    patches = (
        TrianglePatches(net[None], batch_weights)
        if net.ndim == 2
        else TensorPatches(net[None], batch_weights)
    )
    return evaluate_jets(patches, np.zeros(len(u), dtype=np.intp), u, v, order=2)


def check_exchanged(
    net: Array, weights: Array | None, exchange: Array | None, places: list[tuple[float, float]]
) -> None:
    """Checks that exchanging u and v reverses normals, and changes nothing else.

    `exchange` are the rows of the exchanged net of a triangle; None for other patches.
    """
    other_net, other_weights = (
        None if rows is None else rows.swapaxes(0, 1) if exchange is None else rows[exchange]
        for rows in (net, weights)
    )
    assert other_net is not None
    first = evaluate(net, weights, places)
    second = evaluate(other_net, other_weights, [(v, u) for u, v in places])
    assert first.normals is not None
    assert second.normals is not None
    assert first.curvatures is not None
    assert second.curvatures is not None
    assert first.degenerate is not None
    assert first.degenerate.all()
    # Opposite limits along u and along v have no mean: then the directions are equal.
    turned = np.sign((first.normals * second.normals).sum(axis=1))[:, None]
    np.testing.assert_allclose(second.normals, turned * first.normals, atol=1e-9)
    gauss, mean = second.curvatures[0], turned[:, 0] * second.curvatures[1]
    for expected, value in ((first.curvatures[0], gauss), (first.curvatures[1], mean)):
        np.testing.assert_array_equal(np.isnan(value), np.isnan(expected))
        np.testing.assert_allclose(value, expected, rtol=1e-6, atol=1e-6)


@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.integers(1, 4), st.integers(1, 4)),
    st.sampled_from([-1.0, -0.4, 1.0, 2.5]),
    st.tuples(turns, st.sampled_from([1.0, 1e-4, 1e5])),
    st.data(),
)
def test_parallel_partials_at_a_corner_give_one_answer(
    seed: int,
    degree: tuple[int, int],
    ratio: float,
    placement: tuple[Array, float],
    data: st.DataObject,
) -> None:
    assume(degree != (1, 1))  # such a patch is a triangle with parallel sides at one corner
    net = np.random.default_rng(seed).uniform(-1, 1, (degree[0] + 1, degree[1] + 1, 3))
    weights = data.draw(st.none() | weights_like(net))
    corner = data.draw(st.integers(0, 3))
    rows, columns = (slice(None, None, -1 if corner >> k & 1 else 1) for k in (1, 0))
    oriented = net[rows, columns]
    oriented[0, 1] = oriented[0, 0] + ratio * (oriented[1, 0] - oriented[0, 0])
    turn, scale = placement
    check_exchanged(net @ turn.T * scale, weights, None, [CORNERS[corner]])


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 4),
    st.sampled_from([-1.0, 0.5, 2.0]),
    turns,
    st.data(),
)
def test_parallel_partials_at_a_corner_of_a_triangle_give_one_answer(
    seed: int, degree: int, ratio: float, turn: Array, data: st.DataObject
) -> None:
    keys = triangles.keys(degree)
    net = np.random.default_rng(seed).uniform(-1, 1, (len(keys), 3))
    weights = data.draw(st.none() | weights_like(net))
    # Barycentric coordinates of a corner and of its two neighbours, as control points.
    number, corner = np.array(keys), data.draw(st.integers(0, 2))
    distance = degree - number[:, corner]
    (at_corner,), (first, second) = np.flatnonzero(distance == 0), np.flatnonzero(distance == 1)
    net[second] = net[at_corner] + ratio * (net[first] - net[at_corner])
    row = {key: k for k, key in enumerate(keys)}
    exchange = np.array([row[r, t, s] for r, s, t in keys])
    place = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)][corner]
    check_exchanged(net @ turn.T, weights, exchange, [place])


def interpolate(values: Array) -> Array:
    """The net (n+1, n+1, 3) of the patch of degree n with these points at its regular grid."""
    n = len(values) - 1
    t = np.arange(n + 1)[:, None] / n
    i = np.arange(n + 1)
    binomials = np.array([comb(n, k) for k in i])
    inverse = np.linalg.inv(binomials * t**i * (1 - t) ** (n - i))
    net: Array = np.einsum("ij,jkd,lk->ild", inverse, values, inverse)
    return net


X, Y = np.meshgrid(np.arange(5) / 4 - 0.5, np.arange(5) / 4 - 0.5, indexing="ij")


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("points", "gauss", "mean"),
    [
        ((X**2, Y, X**4), 0.0, 1.0),
        ((X**2 - Y**2, 2 * X * Y, (X**2 + Y**2) ** 2), 4.0, 2.0),
        ((X**2, Y**2, X**4 + Y**4), 4.0, 2.0),
        ((X**2, Y**2, 0 * X), 0.0, 0.0),
        ((X**2 - Y**2, 2 * X * Y, X**3), np.nan, np.nan),
        ((X * Y, X + Y, X * Y**2), np.nan, np.nan),
    ],
    ids=["fold", "twice around", "four sheets", "flat", "branch", "no tangent plane"],
)
def test_a_curvature_where_partials_are_parallel_is_a_limit_or_nothing(
    points: tuple[Array, Array, Array], gauss: float, mean: float, turned: bool
) -> None:
    """In the middle of a patch: the first surfaces are z = x², z = x² + y² (twice) and z = 0.

    Rounding turns N = 0 into a short vector; curvatures must not be quotients of such numbers.
    """
    turn = Rotation.random(random_state=1).as_matrix() if turned else np.eye(3)
    net = 3.7 * interpolate(np.stack(points, axis=-1)) @ turn.T
    result = evaluate(net, None, [(0.5, 0.5)])
    assert result.curvatures is not None
    assert result.curvatures[0, 0] * 3.7**2 == pytest.approx(gauss, abs=1e-9, nan_ok=True)
    assert abs(result.curvatures[1, 0]) * 3.7 == pytest.approx(mean, abs=1e-9, nan_ok=True)
    check_exchanged(net, None, None, [(0.5, 0.5)])
