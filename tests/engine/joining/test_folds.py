"""Borders that run back along themselves are closed, for meshes and for measures alike."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from service.engine.measures.measure import measure
from service.engine.measures.values import MeasureQuery
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from tests.engine.meshing import build_mesh, check_sound
from tests.strategies import Array


def pinch(rng: np.random.Generator, count: int, *, is_rational: bool) -> tuple[Array, Array | None]:
    """The net (4, count, 3) of a tube that is pinched flat at both ends, and its weights.

    The sections are periodic along v. The first and the last one run along a curve and back.
    """
    angles = 2 * np.pi * (np.arange(count) + 0.5) / count
    ring = np.stack([np.cos(angles), 0.6 * np.sin(angles)], axis=1)
    ends = []
    for _ in range(2):
        x = np.sort(rng.uniform(-1, 1, count // 2))[::-1]
        there = np.stack([x, rng.uniform(-0.3, 0.3, count // 2)], axis=1)
        ends.append(np.concatenate([there, there[::-1]]))
    sections = [ends[0], ring, 1.1 * ring, ends[1]]
    net = np.stack([np.insert(each, 2, height, axis=1) for height, each in enumerate(sections)])
    if not is_rational:
        return net, None
    weights = rng.uniform(0.5, 2, (4, count))
    for row in (0, 3):
        weights[row, count // 2 :] = weights[row, : count // 2][::-1]
    return net, weights


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 4),
    st.sampled_from([8, 10]),
    st.tuples(st.booleans(), st.booleans(), st.booleans()),
    st.sampled_from([1.0, 1e-3, 1e4]),
)
def test_a_tube_that_is_pinched_flat_is_closed(
    seed: int, degree: int, count: int, kind: tuple[bool, bool, bool], scale: float
) -> None:
    """The ends turn within a span or between two, by the degree; u and v may be exchanged."""
    is_rational, is_turned, is_exchanged = kind
    net, weights = pinch(np.random.default_rng(seed), count, is_rational=is_rational)
    turn = Rotation.random(random_state=seed % 100).as_matrix() if is_turned else np.eye(3)
    net = net @ turn.T * scale
    tube = (
        BsplineSurface(
            net.swapaxes(0, 1),
            (degree, 2),
            ("periodic", "clamped"),
            None if weights is None else weights.T,
        )
        if is_exchanged
        else BsplineSurface(net, (2, degree), ("clamped", "periodic"), weights)
    )
    mesh = build_mesh(tube.lower(), resolution=(4, 4))
    check_sound(mesh)
    assert mesh.report.watertight
    result = measure(tube.lower(), MeasureQuery(tolerance=1e-3))
    assert result.closed
    assert result.boundaries == ()
    assert result.volume is not None
    assert abs(result.volume.value) > 0.1 * scale**3


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 1e-9])
@pytest.mark.parametrize("turn", [0.3, 0.5, 0.7])
def test_a_border_that_turns_at_any_parameter_is_open_where_it_is_alone(
    turn: float, noise: float
) -> None:
    """The border is an even function about the turn; inserted knots do not change its length."""
    v = np.arange(5) / 4
    border = np.stack([(v - turn) ** 2 - 0.4 * (v - turn) ** 4, 0.3 * (v - turn) ** 2, 0 * v], 1)
    rows = [border + k * np.stack([0 * v, v - 0.5, v**0], axis=1) for k in range(3)]
    powers = np.stack([BSpline.design_matrix(v, [0] * 5 + [1] * 5, 4).toarray()] * 3)
    net = np.linalg.solve(powers, np.stack(rows))
    net[0] += noise * np.random.default_rng(1).uniform(-1, 1, (5, 3))
    lengths = []
    for inserted in ((), (0.2,), (0.2, 0.85)):
        spline = BSpline(np.array([0.0] * 5 + [1] * 5), net.swapaxes(0, 1), 4)
        for knot in inserted:
            spline = spline.insert_knot(knot)
        surface = BsplineSurface(spline.c.swapaxes(0, 1), (1, 4), ("clamped", spline.t))
        mesh = build_mesh(surface.lower(), resolution=(3, 3), weld_tolerance=1e-7)
        check_sound(mesh)
        result = measure(surface.lower(), MeasureQuery(weld_tolerance=1e-7))
        # Three divisions of each open side.
        assert mesh.report.boundary_edges == 3 * result.open_edges
        assert result.boundary_count == 1
        lengths.append(result.boundary_length.value)
    assert lengths[1:] == pytest.approx(lengths[:1] * 2, rel=1e-6)


def test_a_border_that_turns_several_times_is_folded_where_it_is_even() -> None:
    """T4, the polynomial of Chebyshev, turns three times, but is even about the second one only."""
    v = np.arange(5) / 4
    bernstein = BSpline.design_matrix(v, [0] * 5 + [1] * 5, 4).toarray()
    chebyshev = np.polynomial.Chebyshev.basis(4)(2 * v - 1)
    border = np.linalg.solve(bernstein, np.stack([chebyshev, 0.3 * chebyshev, 0 * v], axis=1))
    opposite = np.array([[-1, 0, 2], [-0.5, 0.2, 2], [0, 0, 2.1], [0.5, -0.1, 2], [1, 0, 2]])
    turn = Rotation.random(random_state=3).as_matrix()
    surface = BezierSurface(np.stack([border, opposite]) @ turn.T)
    mesh = build_mesh(surface.lower(), resolution=(3, 3))
    check_sound(mesh)
    # The border is one edge with two sides; the opposite side is two edges.
    assert mesh.report.boundary_edges == 3 * 4
    result = measure(surface.lower(), MeasureQuery(tolerance=1e-2))
    assert (result.open_edges, result.boundary_count) == (4, 1)
