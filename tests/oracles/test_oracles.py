"""Tests of the oracles: comparison with numbers computed by hand, and with each other."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given

from oracles import exact, limits, quadrics
from oracles.topology import count_topology, volume, weld_by_position, winding_agreement
from tests.strategies import Array, build_cube, nets

TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


@given(nets())
def test_two_ways_of_de_casteljau_agree_exactly(points: np.ndarray) -> None:
    """Evaluation row by row, and evaluation by 2 × 2 blocks, give equal fractions."""
    net = exact.to_exact_net(points)
    for u, v in (
        (Fraction(1, 3), Fraction(2, 7)),
        (Fraction(0), Fraction(1)),
        (Fraction(9, 8), Fraction(1, 2)),
    ):
        assert exact.surface_point(net, u, v) == exact.bilinear_point(net, u, v)


def test_quotient_rule_on_a_quarter_circle() -> None:
    """With weights 1, 1, 2 the quarter circle is (1 − t², 2t)/(1 + t²)."""
    weights = [[1, 1], [1, 1], [2, 2]]
    net = exact.to_exact_net([[[x, y, 0], [x, y, 1]] for x, y in ((1, 0), (1, 1), (0, 1))], weights)
    t, zero = Fraction(2, 5), Fraction(0)
    jet = exact.jets(net, [t], [Fraction(1, 2)])[0][0]
    w = 1 + t * t
    assert jet.point == ((1 - t * t) / w, 2 * t / w, Fraction(1, 2))
    assert jet.du == (-4 * t / w**2, 2 * (1 - t * t) / w**2, zero)
    assert jet.dv == (zero, zero, Fraction(1))


def test_halves_of_a_split_net_are_parts_of_the_surface() -> None:
    """The left half at u equals the whole at u/2, exactly because coordinates have few bits."""
    net = np.arange(36.0).reshape(4, 3, 3) ** 2
    left_net, right_net = exact.split(net)
    whole, left, right = (exact.to_exact_net(n) for n in (net, left_net, right_net))
    u, v = Fraction(1, 4), Fraction(2, 3)
    assert exact.surface_point(left, u, v) == exact.surface_point(whole, u / 2, v)
    assert exact.surface_point(right, u, v) == exact.surface_point(whole, (1 + u) / 2, v)
    np.testing.assert_array_equal(left_net[-1], right_net[0])


def test_limit_normal_at_the_apex_of_a_plane_patch() -> None:
    """A bilinear patch with one collapsed side is a plane triangle; its normal is constant."""
    triangle = [[[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [0, 0, 1]]]
    component = 1 / math.sqrt(3)
    for u in (Fraction(0), Fraction(1, 2), Fraction(1)):
        result = limits.find_limit_normal(triangle, None, (u, Fraction(1)), (0, -1))
        assert result == pytest.approx((component,) * 3, abs=1e-15)


def test_limit_normal_where_du_cross_dv_begins_with_a_square() -> None:
    """S = (u, v³, 0): du × dv is (0, 0, 3v²), which is of order s² at v = 0."""
    net = [[[i, 0, 0], [i, 0, 0], [i, 0, 0], [i, 1, 0]] for i in (0, 1)]
    assert limits.find_limit_normal(net, None, (Fraction(1, 2), Fraction(0)), (0, 1)) == (0, 0, 1)


def test_topology_of_a_tetrahedron() -> None:
    """The tetrahedron is closed and connected, with Euler characteristic 2 and volume 1/6."""
    result = count_topology(TETRAHEDRON)
    assert (result.vertices, result.edges, result.faces, result.euler) == (4, 6, 4, 2)
    assert result.watertight
    assert result.components == 1
    assert volume(CORNERS, np.array(TETRAHEDRON)) == pytest.approx(1 / 6)


def test_topology_counts_each_fault() -> None:
    """Faults: a missing face, a reversed face, a third face at an edge, a repeated vertex.

    Faces with only a vertex in common are two components.
    """
    assert count_topology(TETRAHEDRON[:3]).boundary == 3
    assert count_topology([*TETRAHEDRON[:3], TETRAHEDRON[3][::-1]]).misoriented == 3
    assert count_topology([*TETRAHEDRON, (0, 1, 9)]).non_manifold == 1
    assert count_topology([(0, 0, 1)]).degenerate == 1
    assert count_topology([(0, 1, 2), (2, 4, 5)]).components == 2


def test_topology_of_a_cube_of_squares() -> None:
    """The faces may be quads, and vertices with equal positions count as one vertex."""
    corners = np.concatenate([face.reshape(4, 3) for face in build_cube()])
    squares = np.array([[4 * k, 4 * k + 2, 4 * k + 3, 4 * k + 1] for k in range(6)])
    result = count_topology(weld_by_position(corners, squares))
    assert result.watertight
    assert (result.vertices, result.edges, result.faces) == (8, 12, 6)


def test_winding_agreement_is_negative_for_reversed_triangles() -> None:
    """The triangle lies in the plane z = 0; its normals point up."""
    normals = np.array([[0.0, 0, 1]] * 3)
    assert winding_agreement(CORNERS[:3], normals, np.array([[0, 1, 2]]))[0] == pytest.approx(3)
    assert winding_agreement(CORNERS[:3], normals, np.array([[0, 2, 1]]))[0] == pytest.approx(-3)


@pytest.mark.parametrize(
    ("quadric", "point", "normal"),
    [
        (quadrics.sphere, (0.6, 0, 0.8), (0.6, 0, 0.8)),
        (quadrics.cylinder, (0.6, 0.8, 0.3), (0.6, 0.8, 0)),
        (quadrics.cone, (0.5, 0, 0), (2 / math.sqrt(5), 0, 1 / math.sqrt(5))),
        (quadrics.torus, (1.24, 0, 0.32), (0.6, 0, 0.8)),
    ],
)
def test_quadrics_at_a_point_of_the_surface(
    quadric: Callable[[Array], tuple[Array, Array]],
    point: tuple[float, float, float],
    normal: tuple[float, float, float],
) -> None:
    """The residual is zero, and the normal equals the normal computed by hand."""
    residuals, normals = quadric(np.array([point]))
    assert residuals[0] == pytest.approx(0, abs=1e-15)
    assert normals[0] == pytest.approx(normal, abs=1e-15)
