"""The certificate for degenerate reference triangles, neighbours and surfaces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from service.engine.bounds.certificate import certify
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.engine.nets.patch_nets import PatchNets
from service.surface.bezier import BezierSurface
from tests import strategies
from tests.engine.bounds.divided_faces import (
    GOAL,
    build_face,
    build_parts,
    check_bounds,
    divide_evenly,
    divide_face,
    drop_neighbours,
    evaluate_places,
    measure_deviations,
)

Array = np.ndarray

COARSE = st.integers(-2, 2).map(float)
"""Coordinates with many equal values, so that points often coincide or are in line."""


@st.composite
def coarse_nets(draw: st.DrawFn) -> tuple[Array, Array | None]:
    """A net with `COARSE` coordinates, and its weights or None."""
    p, q = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    points = draw(arrays.arrays(np.float64, (p + 1, q + 1, 3), elements=COARSE))
    weights = arrays.arrays(np.float64, (p + 1, q + 1), elements=st.sampled_from([1e-4, 0.5, 1.0]))
    return points, draw(st.none() | weights)


@given(coarse_nets(), arrays.arrays(np.float64, (9, 3), elements=COARSE), st.booleans())
def test_bounds_hold_for_vertices_at_any_place(
    net: tuple[Array, Array | None], positions: Array, flat: bool
) -> None:
    """Reference triangles and neighbours that coincide or overlap, or are points or lines; if
    `flat`, all vertices are in one plane."""
    patch_nets, faces = PatchNets.of(BezierSurface(*net).lower()), build_face()
    places, corners, across = divide_face(divide_evenly(2), divide_evenly(2))
    if flat:
        positions = positions * [1.0, 1.0, 0.0]
    check_bounds(patch_nets, faces, build_parts(places, corners, across), positions)


@given(strategies.degenerate_nets(), st.data())
def test_bounds_hold_for_degenerate_surfaces(net: Array, data: st.DataObject) -> None:
    weights = data.draw(st.none() | strategies.weights_like(net))
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    places, corners, across = divide_face(divide_evenly(2), divide_evenly(3))
    positions = evaluate_places(patch_nets, faces, places)
    check_bounds(patch_nets, faces, build_parts(places, corners, across), positions)


@pytest.mark.parametrize("lift", [0.0, 0.02, 0.3, -0.3])
def test_a_folded_neighbour_lowers_the_bound(lift: float) -> None:
    """The first of two parts lies partly over its neighbour, which is folded about their edge.

    The slighter the fold, the more the neighbour lowers the bound.
    """
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4), indexing="ij")
    # The control points are near the sides x = 1 and y = 1, so the part u + v ≤ 1 is over more than
    # half of the square.
    net = np.stack([x**0.3, y**0.3, 0 * x], axis=-1)
    net[..., 2] = lift * np.maximum(net[..., 0] + net[..., 1] - 1, 0)
    patch_nets, faces = PatchNets.of(BezierSurface(net).lower()), build_face()
    places, corners, across = divide_face(divide_evenly(1), divide_evenly(1))
    positions = evaluate_places(patch_nets, faces, places)
    parts = build_parts(places, corners, across)
    bounds, _ = check_bounds(patch_nets, faces, parts, positions)
    without = certify(patch_nets, faces, drop_neighbours(parts), positions, GOAL).deviation
    assert without[0] > 0.15
    assert bounds.deviation[0] < without[0]
    if abs(lift) < 0.1:
        # At most `lift` over the reference triangle, and as much for the fold of the neighbour.
        assert bounds.deviation[0] < 2 * lift + 1e-12


@pytest.mark.parametrize(
    ("degree", "rational"), [((20, 20), True), ((64, 1), False), ((33, 40), False)]
)
def test_bounds_hold_for_high_degrees(degree: tuple[int, int], rational: bool) -> None:
    rng = np.random.default_rng(32)
    sides = [np.linspace(0, 1, n + 1) for n in degree]
    x, y = np.meshgrid(*sides, indexing="ij")
    net = np.stack([x, y, np.sin(5 * x) * np.cos(4 * y)], axis=-1)
    net += 0.02 * rng.normal(size=net.shape)
    weights = np.exp(rng.uniform(-1, 1, x.shape)) if rational else None
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    # Intervals of very different lengths: 1/4, 1/64, about 1/87000 of the span, and the rest.
    u = np.array([0, SPAN // 4, SPAN // 4 + SPAN // 64, SPAN // 4 + SPAN // 64 + 12345, SPAN])
    places, corners, across = divide_face(u, u)
    parts = build_parts(places, corners, across)
    positions = evaluate_places(patch_nets, faces, places)
    bounds, _ = check_bounds(patch_nets, faces, parts, positions)
    # Where a triangle is small, the bound is near the truth.
    extent = np.ptp(parts.corners, axis=0)
    small = (extent <= SPAN // 64).all(axis=0)
    distance = measure_deviations(patch_nets, faces, parts, positions)
    assert small.sum() >= 8
    assert np.median(bounds.deviation[small] / distance[small]) < 1.3


def test_bounds_hold_for_weights_of_very_different_sizes() -> None:
    rng = np.random.default_rng(33)
    net = rng.normal(size=(4, 4, 3))
    for seed in range(6):
        weights = 10.0 ** -np.random.default_rng(seed).integers(0, 8, (4, 4)).astype(np.float64)
        for power in (-64, 0, 64):
            surface = BezierSurface(net, np.ldexp(weights, power))
            patch_nets, faces = PatchNets.of(surface.lower()), build_face()
            places, corners, across = divide_face(divide_evenly(4), divide_evenly(4))
            positions = evaluate_places(patch_nets, faces, places)
            check_bounds(patch_nets, faces, build_parts(places, corners, across), positions)


def test_bounds_hold_for_numbers_of_very_different_sizes() -> None:
    """The patch is so tiny that squares of its lengths are 0; a vertex of its mesh and the eye are
    as far away as requests allow."""
    rng = np.random.default_rng(34)
    patch_nets, faces = (
        PatchNets.of(BezierSurface(1e-300 * rng.normal(size=(4, 4, 3))).lower()),
        build_face(),
    )
    places, corners, across = divide_face(divide_evenly(2), divide_evenly(2))
    positions = evaluate_places(patch_nets, faces, places)
    positions[8] = 3e38
    goal = Goal(np.inf, two_sided=True, view=View(np.full(3, -3e38), 1e-3, 0.0))
    with np.errstate(all="raise", under="ignore"):
        bounds = certify(patch_nets, faces, build_parts(places, corners, across), positions, goal)
    huge = (corners == 8).any(axis=1)
    assert (bounds.deviation[~huge] < 1e-299).all()
    assert (bounds.deviation <= 4e38).all()
    assert (bounds.allowed[~huge] > 1e-300).all()
    # The patch is √3 · 3e38 = 5.2e38 from the eye, of which 1e-3 is allowed.
    assert (bounds.allowed <= 6e35).all()
