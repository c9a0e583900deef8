"""Unit normals at and near places where du × dv vanishes."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from oracles import exact
from oracles.limits import find_limit_normal
from service.engine.evaluation.evaluate import evaluate
from service.engine.evaluation.normals import unit_normals
from service.surface.batches import TensorPatches
from tests.strategies import (
    Array,
    apply_symmetry,
    degenerate_nets,
    height_nets,
    nets,
    weighted_nets,
    weights_like,
)
from tools.examples import lower_example, lower_patches

ONE = Fraction(1)
ZERO = Fraction(0)


def build_batch(net: Array, weights: Array | None = None) -> TensorPatches:
    """A batch of one patch."""
    return TensorPatches(np.array(net)[None], None if weights is None else np.array(weights)[None])


def evaluate_normals(
    net: Array, weights: Array | None, places: list[tuple[Fraction, Fraction]]
) -> tuple[Array, int]:
    """Normals of one patch at parameters (u, v), and the number of limits among them."""
    u, v = (np.array([float(place[k]) for place in places]) for k in (0, 1))
    return unit_normals(build_batch(net, weights), np.zeros(len(places), dtype=np.intp), u, v)


def list_inward_directions(u: Fraction, v: Fraction) -> Iterator[tuple[int, int]]:
    """Directions into the domain, in the order in which limits are tried.

    They lead away from the edge, along the edge, and diagonally; at a corner, along v, along u, and
    diagonally.
    """
    into_u, into_v = 1 if u <= Fraction(1, 2) else -1, 1 if v <= Fraction(1, 2) else -1
    directions = [(0, into_v), (into_u, 0)]
    if u in (ZERO, ONE) and v not in (ZERO, ONE):
        directions.reverse()
    yield from directions
    yield into_u, into_v


def find_limit(net: Array, weights: Array | None, u: Fraction, v: Fraction) -> Array | None:
    """The exact limit along the first direction that has a limit; None if no direction has."""
    for direction in list_inward_directions(u, v):
        result = find_limit_normal(net, weights, (u, v), direction)
        if result is not None:
            return np.array(result)
    return None


def has_opposite_limits(net: Array, u: Fraction, v: Fraction) -> bool:
    """Whether the limits from both sides of a place on an edge differ, as at a fold."""
    into_u, into_v = (
        [1, -1] if t not in (ZERO, ONE) else [1] if t == ZERO else [-1] for t in (u, v)
    )
    limits = [find_limit_normal(net, None, (u, v), (a, b)) for a in into_u for b in into_v]
    return len(limits) == 2 and None not in limits and limits[0] != limits[1]


def are_unit(normals: Array) -> bool:
    """Whether all normals have length 1 up to rounding; False if a normal is NaN."""
    return bool(np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 4e-16)


@given(weighted_nets(nets(limit=2)))
def test_normals_are_right_where_du_and_dv_span_a_plane(
    net_and_weights: tuple[Array, Array | None],
) -> None:
    """Random nets may have folds. Normals are computed one by one, and all samples at once."""
    net, weights = net_and_weights
    expected = exact.normals(net, weights, (4, 3))
    has_normal = ~np.isnan(expected).any(axis=-1)
    assume(has_normal.any())
    places = [(u, v) for u in exact.list_parameters(4) for v in exact.list_parameters(3)]
    single_normals, _ = evaluate_normals(net, weights, places)
    normals_of_grid = evaluate(build_batch(net, weights), (4, 3)).normals
    assert normals_of_grid is not None
    for result in (single_normals.reshape(expected.shape), normals_of_grid[0]):
        assert are_unit(result)
        assert np.abs(result - expected)[has_normal].max() < 1e-9


# The integers from 0 to 7 are the symmetries of `apply_symmetry`.
@given(weighted_nets(height_nets(degree=st.integers(1, 4))), st.integers(0, 7))
def test_normals_at_a_collapsed_edge_are_the_limits_from_inside(
    net_and_weights: tuple[Array, Array | None], symmetry: int
) -> None:
    """The normals along the edge and at its ends are compared with exact limits."""
    net, weights = net_and_weights[0].copy(), net_and_weights[1]
    net[0] = net[0, 0]
    net = apply_symmetry(net, symmetry)
    weights = None if weights is None else apply_symmetry(weights, symmetry)
    thirds = exact.list_parameters(3)
    # The collapsed edge is u = 0 before the symmetry, and any of the four edges after it.
    edge = next(
        places
        for places, points in (
            ([(ZERO, t) for t in thirds], net[0]),
            ([(ONE, t) for t in thirds], net[-1]),
            ([(t, ZERO) for t in thirds], net[:, 0]),
            ([(t, ONE) for t in thirds], net[:, -1]),
        )
        if (points == points[0]).all()
    )
    result, limits = evaluate_normals(net, weights, edge)
    assert are_unit(result)
    assert limits == len(edge)
    for normal, (u, v) in zip(result, edge, strict=True):
        expected = find_limit(net, weights, u, v)
        if expected is not None:
            assert normal == pytest.approx(expected, abs=1e-9)


@given(degenerate_nets(), st.booleans(), st.data())
def test_degenerate_nets_have_unit_normals(
    net: Array, is_rational: bool, data: st.DataObject
) -> None:
    """The nets have collapsed or repeated points, or are flat, straight or single points."""
    patches = build_batch(net, data.draw(weights_like(net)) if is_rational else None)
    for dtype, slack in ((np.float64, 4e-16), (np.float32, 3e-7)):
        result = evaluate(patches, (4, 3), dtype=dtype)
        assert result.normals is not None
        assert np.abs(np.linalg.norm(result.normals.astype(float), axis=-1) - 1).max() < slack


@pytest.mark.slow
@given(degenerate_nets())
def test_normals_on_the_border_are_the_limits_from_inside(net: Array) -> None:
    """Compares normals where du × dv vanishes with the exact limits, wherever these exist."""
    # At this resolution all parameters are exact in float64. The parameter 1/3 would be rounded: on
    # a fold at u = 1/3 the surface has no normal, but it has one at the rounded parameter.
    resolution = (4, 2)
    expected = exact.normals(net, None, resolution)
    result = evaluate(build_batch(net), resolution).normals
    assert result is not None
    us, vs = exact.list_parameters(4), exact.list_parameters(2)
    for i, j in np.argwhere(np.isnan(expected).any(axis=-1)).tolist():
        if us[i] in (ZERO, ONE) or vs[j] in (ZERO, ONE):
            limit = find_limit(net, None, us[i], vs[j])
            if limit is not None and not has_opposite_limits(net, us[i], vs[j]):
                assert result[0, i, j] == pytest.approx(limit, abs=1e-9)


FOLD = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]], [[0, 0, 0], [0, 1, 0]]]


def _build_bubble() -> Array:
    net = np.zeros((4, 4, 3))
    net[1:3, 1:3] = [[[1, 1, 1], [1, -1, 1]], [[-1, 1, 1], [-1, -1, -2]]]
    return net


def _build_corner() -> Array:
    net = np.stack(
        [*np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij"), np.zeros((4, 4))], -1
    )
    net[:2, :2] = 0
    return net


DEGENERATE: dict[str, Callable[[], Array]] = {
    "one point": lambda: np.full((4, 3, 3), 0.1),
    "one point at the origin": lambda: np.zeros((2, 2, 3)),
    "on a line": lambda: np.linspace(0, 1, 12).reshape(4, 3, 1) * (1.0, -2.0, 0.3),
    "on a crooked line": lambda: np.random.default_rng(1).random((4, 4, 1)) * (0.1, 0.7, -0.3),
    "on an axis": lambda: np.random.default_rng(2).random((4, 4, 1)) * (0.0, 0.0, 1.0),
    "an arc, not a surface": lambda: np.repeat(
        [[[0, 0, 0]], [[1, 2, 0]], [[2.0, 0, 1]]], 3, axis=1
    ),
    "folded onto itself": lambda: np.array(FOLD, dtype=float),
    "two points": lambda: np.repeat([[[0.0, 0, 0]], [[1, 2, 3]]], 4, axis=1),
    "all four edges in one point": _build_bubble,
    "a corner and its neighbours in one point": _build_corner,
}


@pytest.mark.parametrize("shape", DEGENERATE)
def test_degenerate_shapes_have_unit_normals(shape: str) -> None:
    """No normal is zero or NaN, and NumPy gives no warning (tests treat warnings as errors)."""
    dtypes: list[type[np.float32] | type[np.float64]] = [np.float64, np.float32]
    cases = product((False, True), (0.0, 1e6), (1.0, 1e-30, 1e30), dtypes)
    for is_rational, offset, scale, dtype in cases:
        net = (DEGENERATE[shape]() + offset) * scale
        weights = np.random.default_rng(3).uniform(0.2, 5, net.shape[:2]) if is_rational else None
        result = evaluate(build_batch(net, weights), (5, 4), dtype=dtype)
        assert result.normals is not None
        lengths = np.linalg.norm(result.normals.astype(float), axis=-1)
        assert np.abs(lengths - 1).max() < 3e-7, (is_rational, offset, scale, dtype)


def test_normals_of_a_line_are_perpendicular_to_it() -> None:
    """All control points are on one line."""
    direction = np.array([1.0, -2.0, 0.3])
    net = np.linspace(0, 1, 12).reshape(4, 3, 1) * direction
    result = evaluate(build_batch(net), (5, 4)).normals
    assert result is not None
    assert np.abs(result @ direction).max() < 1e-12


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("resolution", [(1, 1), (16, 16), (5, 300)])
def test_normals_at_the_poles_of_the_teapot_are_vertical(
    resolution: tuple[int, int], dtype: type[np.float32] | type[np.float64]
) -> None:
    """They are exact along the collapsed edges of lid and bottom."""
    model = lower_patches("utah-teapot")
    (batch,) = model.batches
    result = evaluate(batch, resolution, dtype=dtype)
    assert result.normals is not None
    parts = {part.name: part for part in model.parts}
    for name, height, z in (("lid", 3.15, 1.0), ("bottom", 0.0, -1.0)):
        patches = slice(parts[name].first, parts[name].last)
        positions, normals = result.positions[patches], result.normals[patches]
        is_pole = (np.abs(positions - (0, 0, height)) < 1e-6).all(axis=-1)
        assert is_pole.sum() == 4 * (resolution[0] + 1)
        np.testing.assert_array_equal(normals[is_pole], np.full((is_pole.sum(), 3), (0, 0, z)))
    assert result.poles == 8 * (resolution[0] + 1)


def test_normals_near_a_pole_are_right() -> None:
    """The parameters are as near as 2^-19 to the pole of a sphere, where du is short."""
    batch = lower_example("sphere")
    assert batch.weights is not None
    t = 2.0 ** -np.arange(1.0, 20)
    for k in range(batch.count):
        # The pole of patches 0 to 3 is the side v = 0, the pole of patches 4 to 7 is v = 1.
        u, v = np.linspace(0, 1, len(t)), 1 - t if k >= 4 else t
        index = np.full(len(t), k, dtype=np.intp)
        result, _ = unit_normals(batch, index, u, v)
        for normal, a, b in zip(result, u.tolist(), v.tolist(), strict=True):
            net = exact.to_exact_net(batch.points[k], batch.weights[k])
            jet = exact.jets(net, [Fraction(a)], [Fraction(b)])[0][0]
            assert normal == pytest.approx(exact.normalize(exact.cross(jet.du, jet.dv)), abs=1e-9)
