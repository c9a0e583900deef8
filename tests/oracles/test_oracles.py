"""Tests of the oracles: against numbers that can be checked by hand, and against each other."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given

from tests.oracles import exact, limits, quadrics
from tests.oracles.topology import count_topology, volume, weld_by_position, winding_agreement
from tests.strategies import Array, build_cube, nets

TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


@given(nets())
def test_two_ways_of_de_casteljau_agree_exactly(points: np.ndarray) -> None:
    """Rows first, or 2 × 2 blocks first: the same fractions."""
    net = exact.to_exact_net(points)
    for u, v in (
        (Fraction(1, 3), Fraction(2, 7)),
        (Fraction(0), Fraction(1)),
        (Fraction(9, 8), Fraction(1, 2)),
    ):
        assert exact.surface_point(net, u, v) == exact.bilinear_point(net, u, v)


def test_quotient_rule_on_a_quarter_circle() -> None:
    """Weights 1, 1, 2 parametrise the circle as (1 − t², 2t)/(1 + t²)."""
    weights = [[1, 1], [1, 1], [2, 2]]
    net = exact.to_exact_net([[[x, y, 0], [x, y, 1]] for x, y in ((1, 0), (1, 1), (0, 1))], weights)
    t, zero = Fraction(2, 5), Fraction(0)
    jet = exact.jets(net, [t], [Fraction(1, 2)])[0][0]
    w = 1 + t * t
    assert jet.point == ((1 - t * t) / w, 2 * t / w, Fraction(1, 2))
    assert jet.du == (-4 * t / w**2, 2 * (1 - t * t) / w**2, zero)
    assert jet.dv == (zero, zero, Fraction(1))


def test_split_halves_are_the_surface() -> None:
    """The left half at u is the whole at u/2, exactly for coordinates of few bits."""
    net = np.arange(36.0).reshape(4, 3, 3) ** 2
    left, right = exact.split(net)
    whole, first, second = (exact.to_exact_net(n) for n in (net, left, right))
    u, v = Fraction(1, 4), Fraction(2, 3)
    assert exact.surface_point(first, u, v) == exact.surface_point(whole, u / 2, v)
    assert exact.surface_point(second, u, v) == exact.surface_point(whole, (1 + u) / 2, v)
    np.testing.assert_array_equal(left[-1], right[0])


def test_limit_normal_at_an_apex_depends_on_the_ruling() -> None:
    """A bilinear patch with its edge v = 1 in one point: every ruling keeps its plane's normal."""
    cone = [[[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [0, 0, 1]]]
    side = 1 / math.sqrt(3)
    for u in (Fraction(0), Fraction(1, 2), Fraction(1)):
        result = limits.find_limit_normal(cone, None, (u, Fraction(1)), (0, -1))
        assert result == pytest.approx((side, side, side), abs=1e-15)


def test_limit_normal_divides_twice() -> None:
    """S = (u, v³, u v⁴ …): with two repeated rows the first term of du × dv is of order s²."""
    net = [[[i, 0, 0], [i, 0, 0], [i, 0, 0], [i, 1, 0]] for i in (0, 1)]
    assert limits.find_limit_normal(net, None, (Fraction(1, 2), Fraction(0)), (0, 1)) == (0, 0, 1)


def test_topology_of_a_tetrahedron() -> None:
    """Closed, one piece, Euler characteristic 2, volume 1/6."""
    result = count_topology(TETRAHEDRON)
    assert (result.vertices, result.edges, result.faces, result.euler) == (4, 6, 4, 2)
    assert result.watertight
    assert result.components == 1
    assert volume(CORNERS, np.array(TETRAHEDRON)) == pytest.approx(1 / 6)


def test_topology_finds_each_fault() -> None:
    """A missing face, a face turned over, a third face at an edge, a face of no area."""
    assert count_topology(TETRAHEDRON[:3]).boundary == 3
    assert count_topology([*TETRAHEDRON[:3], TETRAHEDRON[3][::-1]]).misoriented == 3
    assert count_topology([*TETRAHEDRON, (0, 1, 9)]).non_manifold == 1
    assert count_topology([(0, 0, 1)]).degenerate == 1
    assert count_topology([(0, 1, 2), (2, 4, 5)]).components == 2


def test_topology_of_a_cube_of_squares() -> None:
    """Polygons of any length; the vertices welded by their position."""
    corners = np.concatenate([face.reshape(4, 3) for face in build_cube()])
    squares = np.array([[4 * k, 4 * k + 2, 4 * k + 3, 4 * k + 1] for k in range(6)])
    result = count_topology(weld_by_position(corners, squares))
    assert result.watertight
    assert (result.vertices, result.edges, result.faces) == (8, 12, 6)


def test_winding_agreement_has_a_sign() -> None:
    """A triangle in the plane seen from above and from below."""
    up = np.array([[0.0, 0, 1]] * 3)
    assert winding_agreement(CORNERS[:3], up, np.array([[0, 1, 2]]))[0] == pytest.approx(3)
    assert winding_agreement(CORNERS[:3], up, np.array([[0, 2, 1]]))[0] == pytest.approx(-3)


@pytest.mark.parametrize(
    ("quadric", "point", "normal"),
    [
        (quadrics.sphere, (0.6, 0, 0.8), (0.6, 0, 0.8)),
        (quadrics.cylinder, (0.6, 0.8, 0.3), (0.6, 0.8, 0)),
        (quadrics.cone, (0.5, 0, 0), (2 / math.sqrt(5), 0, 1 / math.sqrt(5))),
        (quadrics.torus, (1.24, 0, 0.32), (0.6, 0, 0.8)),
    ],
)
def test_quadrics_at_a_known_point(
    quadric: Callable[[Array], tuple[Array, Array]],
    point: tuple[float, float, float],
    normal: tuple[float, float, float],
) -> None:
    """A point on the surface, its residual zero and its normal known by hand."""
    off, result = quadric(np.array([point]))
    assert off[0] == pytest.approx(0, abs=1e-15)
    assert result[0] == pytest.approx(normal, abs=1e-15)
