"""Borders as chains: one loop where there is one, whichever way patches are turned."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from service.engine.measures.chains import chain_edges
from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.measure import measure
from service.engine.measures.values import MeasureQuery, Measures
from service.surface.bezier import BezierSurface
from service.surface.convert.operations import Elevate
from service.surface.convert.table import convert
from service.surface.multipatch import MultipatchSurface
from tests.strategies import Array, apply_symmetry, symmetries


def measure_nets(nets: list[Array]) -> Measures[RequestSide]:
    surface = MultipatchSurface(tuple(map(BezierSurface, nets)))
    return measure(surface.lower(), MeasureQuery())


def build_ring(corners: int, *, half_turns: int) -> list[Array]:
    """Bilinear patches around a ring that makes some half turns: one of them is a Möbius strip."""
    angles = np.linspace(0, 2 * np.pi, corners + 1)
    lines = []
    for angle in angles:
        width = 0.5 * np.array([-1.0, 1.0])[:, None]
        turn = half_turns * angle / 2
        away = np.array([np.cos(turn) * np.cos(angle), np.cos(turn) * np.sin(angle), np.sin(turn)])
        lines.append(2 * np.array([np.cos(angle), np.sin(angle), 0]) + width * away)
    lines[-1] = lines[0][::-1] if half_turns % 2 else lines[0]
    return [np.stack([lines[k], lines[k + 1]]) for k in range(corners)]


def elevate(net: Array, degree: tuple[int, int]) -> Array:
    """The net of the same patch in a higher degree."""
    result = convert(BezierSurface(net), [Elevate(degree)])
    assert isinstance(result, BezierSurface)
    return result.control_net


@given(st.integers(3, 7), st.integers(0, 2), st.sampled_from([1.0, 1e-4, 1e5]), st.data())
def test_a_ring_has_two_borders_and_a_moebius_strip_one(
    corners: int, half_turns: int, scale: float, data: st.DataObject
) -> None:
    """Each patch is turned in its own way, reversed or with u and v exchanged, in any degree."""
    turns = data.draw(st.lists(symmetries, min_size=corners, max_size=corners))
    degree = st.tuples(st.integers(1, 3), st.integers(1, 3))
    degrees = data.draw(st.lists(degree, min_size=corners, max_size=corners))
    turn = Rotation.random(random_state=data.draw(st.integers(0, 9))).as_matrix()
    nets = [net @ turn.T * scale for net in build_ring(corners, half_turns=half_turns)]
    result = measure_nets(
        [
            apply_symmetry(elevate(net, each), symmetry)
            for net, each, symmetry in zip(nets, degrees, turns, strict=True)
        ]
    )
    expected = measure_nets(nets)
    assert [loop.closed for loop in result.boundaries] == [True] * (1 if half_turns == 1 else 2)
    assert sum(loop.edges for loop in result.boundaries) == 2 * corners
    lengths, expected_lengths = (
        sorted(loop.length.value for loop in each.boundaries) for each in (result, expected)
    )
    assert lengths == pytest.approx(expected_lengths, rel=1e-9)


@given(st.lists(st.booleans(), min_size=6, max_size=6), st.permutations(range(6)))
def test_a_chain_is_one_whatever_the_directions_of_its_edges(
    turned: list[bool], order: list[int]
) -> None:
    """A loop of four edges, and a chain of two that leads to no other edge."""
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6]])[order]
    edges[turned] = edges[turned][:, ::-1]
    chains = chain_edges(edges[:, 0], edges[:, 1])
    assert sorted((len(chain), is_closed) for chain, is_closed in chains) == [(2, False), (4, True)]


def test_edges_in_one_direction_follow_each_other_where_borders_touch() -> None:
    """Two loops with a common corner: the chain goes on with the edge of the least number."""
    edges = np.array([[0, 1], [1, 0], [0, 2], [2, 0]])
    assert chain_edges(edges[:, 0], edges[:, 1]) == [([0, 1], True), ([2, 3], True)]
