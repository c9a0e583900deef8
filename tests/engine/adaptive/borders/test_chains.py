"""Chains: sides with the same edges have one chain, whose direction does not depend on them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.adaptive.borders.chains import Chains, find_chains
from service.engine.bounds.faces import find_faces
from service.engine.connectivity.seams import Seams, find_seams
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.strategies import Array, apply_symmetry, symmetries


def find_model_chains(model: PatchModel) -> tuple[Chains, Seams]:
    seams = find_seams(model.batches)
    return find_chains(find_faces(model, seams), seams), seams


def list_points(chains: Chains, seams: Seams, chain: int) -> Array:
    """Control points along a chain."""
    result = []
    for row in range(chains.start[chain], chains.start[chain + 1]):
        # One of the groups, which have curves of one degree each, has the curve of the edge.
        for group in seams.curves:
            (match,) = np.nonzero(group.ids == chains.edge[row])
            result += [net[:: -1 if chains.backward[row] else 1] for net in group.points[match]]
    return np.concatenate(result)


@given(st.integers(0, 99), st.integers(5, 9), symmetries)
def test_a_turned_spline_has_the_same_chains(seed: int, columns: int, symmetry: int) -> None:
    """Chains have equal control points in the same order, for any direction of parameters."""
    net = np.random.default_rng(seed).integers(-2, 3, (6, columns, 3)).astype(float)
    one, two = (
        find_model_chains(BsplineSurface(points, (2, 2)).lower())
        for points in (net, apply_symmetry(net, symmetry))
    )
    result = [
        sorted(list_points(chains, seams, k).tobytes() for k in range(len(chains.length)))
        for chains, seams in (one, two)
    ]
    assert result[0] == result[1]


def test_the_sides_of_a_torus_are_two_chains() -> None:
    """Each chain runs along two sides, which have several edges."""
    net = np.random.default_rng(3).uniform(-1, 1, (5, 6, 3))
    chains, seams = find_model_chains(BsplineSurface(net, (3, 3), ("periodic", "periodic")).lower())
    assert sorted(chains.length.tolist()) == [5, 6]
    assert chains.uses.tolist() == [2, 2]
    assert chains.side.tolist() == [0, 1, 2, 3]
    # Each chain is closed: it ends at the corner at which it begins.
    for chain in range(2):
        first = chains.start[chain] + chain  # each chain has one corner more than edges
        assert chains.corner[first] == chains.corner[first + chains.length[chain]]
        end = seams.corner_points[chains.corner[first]]
        np.testing.assert_array_equal(list_points(chains, seams, chain)[[0, -1]], [end, end])


def test_a_moebius_strip_runs_along_its_seam_both_ways() -> None:
    """The seam is one chain, with one side along it and one against it."""
    angle = np.linspace(0, 2 * np.pi, 9)
    middle = 3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    across = np.stack(
        [np.cos(angle) * np.cos(angle / 2), np.sin(angle) * np.cos(angle / 2), np.sin(angle / 2)],
        axis=-1,
    )
    net = middle[:, None] + np.array([-1, -0.2, 0.1, 0.7])[:, None] * across[:, None]
    net[-1] = net[0, ::-1]
    chains, _ = find_model_chains(BsplineSurface(net, (2, 2)).lower())
    (seam,) = np.flatnonzero(chains.uses == 2)
    runs = chains.chain == seam
    assert chains.length[seam] == 2
    assert chains.side[runs].tolist() == [0, 1]
    assert sorted(chains.reversed[runs].tolist()) == [False, True]
