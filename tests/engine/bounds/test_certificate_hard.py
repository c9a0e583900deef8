"""The certificate where hosts, neighbours and surfaces are as awkward as they can be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from service.engine.bounds.certificate import Parts, certify
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.engine.bounds.patch_nets import PatchNets
from service.surface.bezier import BezierSurface
from tests import strategies
from tests.engine.bounds.parting import (
    GOAL,
    checked,
    divided,
    divisions,
    evaluated,
    one_face,
    parts_of,
    seen,
)

Array = np.ndarray

COARSE = st.integers(-2, 2).map(float)
"""Coordinates of which many are equal, so that points coincide, and are in line, all the time."""


@st.composite
def nets(draw: st.DrawFn) -> tuple[Array, Array | None]:
    p, q = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    points = draw(arrays.arrays(np.float64, (p + 1, q + 1, 3), elements=COARSE))
    weights = arrays.arrays(np.float64, (p + 1, q + 1), elements=st.sampled_from([1e-4, 0.5, 1.0]))
    return points, draw(st.none() | weights)


@given(nets(), arrays.arrays(np.float64, (9, 3), elements=COARSE), st.booleans())
def test_vertices_anywhere(net: tuple[Array, Array | None], positions: Array, flat: bool) -> None:
    """Hosts and neighbours that coincide, overlap, are points and lines; in a plane, if `flat`."""
    ground, faces = PatchNets.of(BezierSurface(*net).lower()), one_face()
    places, corners, beyond = divided(divisions(2), divisions(2))
    if flat:
        positions = positions * [1.0, 1.0, 0.0]
    checked(ground, faces, parts_of(places, corners, beyond), positions)


@given(strategies.degenerate_nets(), st.data())
def test_degenerate_surfaces(net: Array, data: st.DataObject) -> None:
    weights = data.draw(st.none() | strategies.weights_like(net))
    ground, faces = PatchNets.of(BezierSurface(net, weights).lower()), one_face()
    places, corners, beyond = divided(divisions(2), divisions(3))
    positions = evaluated(ground, faces, places)
    checked(ground, faces, parts_of(places, corners, beyond), positions)


@pytest.mark.parametrize("lift", [0.0, 0.02, 0.3, -0.3])
def test_what_lies_beyond_an_edge_counts_as_far_as_it_lies_there(lift: float) -> None:
    """A host, and a neighbour that is more or less folded: part of the surface is over that one."""
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4), indexing="ij")
    # Parameters that run ahead: the first half of the square is far more than half of it.
    net = np.stack([x**0.3, y**0.3, 0 * x], axis=-1)
    net[..., 2] = lift * np.maximum(net[..., 0] + net[..., 1] - 1, 0)
    ground, faces = PatchNets.of(BezierSurface(net).lower()), one_face()
    places, corners, beyond = divided(divisions(1), divisions(1))
    positions = evaluated(ground, faces, places)
    parts = parts_of(places, corners, beyond)
    bounds, _ = checked(ground, faces, parts, positions)
    alone = Parts(parts.face, parts.corners, parts.host, np.full((2, 3), -1))
    without = certify(ground, faces, alone, positions, GOAL).deviation
    assert without[0] > 0.15
    assert bounds.deviation[0] <= without[0]
    if abs(lift) < 0.1:
        # Of height over the host, and of what folding back takes.
        assert bounds.deviation[0] < 2 * lift + 1e-12


@pytest.mark.parametrize(
    ("degree", "rational"), [((20, 20), True), ((64, 1), False), ((33, 40), False)]
)
def test_high_degrees(degree: tuple[int, int], rational: bool) -> None:
    rng = np.random.default_rng(32)
    sides = [np.linspace(0, 1, n + 1) for n in degree]
    x, y = np.meshgrid(*sides, indexing="ij")
    net = np.stack([x, y, np.sin(5 * x) * np.cos(4 * y)], axis=-1)
    net += 0.02 * rng.normal(size=net.shape)
    weights = np.exp(rng.uniform(-1, 1, x.shape)) if rational else None
    ground, faces = PatchNets.of(BezierSurface(net, weights).lower()), one_face()
    u = np.array([0, SPAN // 4, SPAN // 4 + SPAN // 64, SPAN // 4 + SPAN // 64 + 12345, SPAN])
    places, corners, beyond = divided(u, u)
    parts = parts_of(places, corners, beyond)
    positions = evaluated(ground, faces, places)
    bounds, _ = checked(ground, faces, parts, positions)
    # Where a triangle is small, the bound is near the truth.
    tall = np.ptp(parts.corners, axis=1)
    small = (tall <= SPAN // 64).all(axis=1)
    distance = seen(ground, faces, parts, positions)
    assert small.sum() >= 8
    assert np.median(bounds.deviation[small] / distance[small]) < 1.3


def test_the_least_weights_are_not_lost() -> None:
    rng = np.random.default_rng(33)
    net = rng.normal(size=(4, 4, 3))
    for seed in range(6):
        weights = 10.0 ** -np.random.default_rng(seed).integers(0, 8, (4, 4)).astype(np.float64)
        for power in (-64, 0, 64):
            surface = BezierSurface(net, np.ldexp(weights, power))
            ground, faces = PatchNets.of(surface.lower()), one_face()
            places, corners, beyond = divided(divisions(4), divisions(4))
            positions = evaluated(ground, faces, places)
            checked(ground, faces, parts_of(places, corners, beyond), positions)


def test_numbers_of_all_sizes_at_once() -> None:
    """A speck beside something huge, and an eye that is further away than squares can tell."""
    rng = np.random.default_rng(34)
    ground, faces = (
        PatchNets.of(BezierSurface(1e-300 * rng.normal(size=(4, 4, 3))).lower()),
        one_face(),
    )
    places, corners, beyond = divided(divisions(2), divisions(2))
    positions = evaluated(ground, faces, places)
    positions[8] = 3e38
    goal = Goal(np.inf, two_sided=True, view=View(np.full(3, -3e38), 1e-3, 0.0))
    with np.errstate(all="raise", under="ignore"):
        bounds = certify(ground, faces, parts_of(places, corners, beyond), positions, goal)
    huge = (corners == 8).any(axis=1)
    assert (bounds.deviation[~huge] < 1e-299).all()
    assert (bounds.deviation <= 4e38).all()
    assert (bounds.allowed[~huge] > 1e-300).all()
    assert (bounds.allowed <= 6e35).all()
