"""Pieces of conics: on their curves by the implicit equations, and between the right ends."""

from math import cos, cosh, nan, pi, sin, sinh, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.decoders.cad.conics import (
    Conic,
    Ellipse,
    Hyperbola,
    Line,
    Parabola,
    build_polyline,
    find_sweep,
)
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import build_frame
from service.decoders.cad.splines import evaluate, find_ends

FRAME = build_frame((3.0, -1.0, 2.0), (1.0, 2.0, -0.5), (0.0, 1.0, 0.3))

angles = st.floats(-10, 10)
sizes = st.floats(0.01, 100)


def sample(curve: Curve) -> tuple[list[float], list[float], list[float]]:
    """Local coordinates of 41 points of a curve."""
    points = evaluate(curve, np.linspace(curve.knots[0], curve.knots[-1], 41))
    x, y, z = FRAME.locate_all(points).tolist()
    return x, y, z


@given(a=sizes, b=sizes, first=angles, sweep=st.floats(1e-6, tau))
def test_arcs_are_on_their_ellipse(a: float, b: float, first: float, sweep: float) -> None:
    ellipse = Ellipse(FRAME, a, b)
    curve = ellipse.cut(first, first + sweep)
    x, y, z = (np.array(values) for values in sample(curve))
    assert np.hypot(x / a, y / b) == pytest.approx(np.ones(41), abs=1e-9)
    assert z == pytest.approx(np.zeros(41), abs=1e-12 * (a + b) + 1e-13)
    # Angles run forwards from the first to the last, and over all of the sweep.
    turned = np.unwrap(np.arctan2(y / b, x / a))
    assert (np.diff(turned) > -1e-9).all()
    assert turned[-1] - turned[0] == pytest.approx(sweep, abs=1e-6)
    # Knots are angles.
    knots = np.unique(curve.knots)
    expected = [ellipse.evaluate(t) for t in knots.tolist()]
    assert evaluate(curve, knots) == pytest.approx(np.array(expected), abs=1e-9)
    assert np.diff(knots).max() <= pi / 2 + 1e-6


@given(a=sizes, b=sizes, t=st.floats(-3.1, 3.1))
def test_the_parameter_of_a_point_on_an_ellipse(a: float, b: float, t: float) -> None:
    ellipse = Ellipse(FRAME, a, b)
    assert ellipse.find_parameter(ellipse.evaluate(t)) == pytest.approx(t, abs=1e-6)


def test_a_whole_circle_ends_where_it_begins() -> None:
    curve = Ellipse(FRAME, 2.0, 2.0).cut_whole()
    assert (curve.points[0] == curve.points[-1]).all()
    assert np.unique(curve.knots) == pytest.approx(np.arange(5) * pi / 2)
    assert len(curve.points) == 9


@pytest.mark.parametrize(
    ("first", "last", "sweep"),
    [
        (0, 1, 1),
        (1, 0, tau - 1),
        (0, 0, tau),
        (5, 5 + tau, tau),
        (0, 1 + 3 * tau, 1),
        (3, -3, tau - 6),
    ],
)
def test_sweeps(first: float, last: float, sweep: float) -> None:
    assert find_sweep(first, last) == pytest.approx(sweep)


def test_an_infinite_sweep_is_refused() -> None:
    for last in (nan, float("inf")):
        with pytest.raises(InvalidGeometry, match="angle"):
            find_sweep(0.0, last)
    assert 0.0 < find_sweep(0.0, 1e308) <= tau


@given(focal=sizes, first=st.floats(-20, 20), step=st.floats(0.01, 20))
def test_pieces_of_parabolas(focal: float, first: float, step: float) -> None:
    parabola = Parabola(FRAME, focal)
    curve = parabola.cut(first, first + step)
    x, y, _ = (np.array(values) for values in sample(curve))
    size = focal * (abs(first) + step) ** 2 + focal
    assert y**2 == pytest.approx(4 * focal * x, abs=1e-9 * size * size)
    ends = [parabola.evaluate(t) for t in (first, first + step)]
    assert find_ends(curve) == pytest.approx(np.array(ends), abs=1e-11 * size)
    assert parabola.find_parameter(ends[0]) == pytest.approx(first, abs=1e-9 * size / focal)


@given(a=sizes, b=sizes, first=st.floats(-4, 4), step=st.floats(0.01, 5))
def test_pieces_of_hyperbolas(a: float, b: float, first: float, step: float) -> None:
    hyperbola = Hyperbola(FRAME, a, b)
    curve = hyperbola.cut(first, first + step)
    x, y, _ = (np.array(values) for values in sample(curve))
    scale = cosh(abs(first) + step) ** 2 * (1 + 1 / a + 1 / b)
    assert (x / a) ** 2 - (y / b) ** 2 == pytest.approx(np.ones(41), abs=1e-9 * scale)
    assert (x > 0).all()
    ends = [hyperbola.evaluate(t) for t in (first, first + step)]
    assert find_ends(curve) == pytest.approx(np.array(ends), abs=1e-9 * scale * (a + b))


def test_parameters_are_those_of_the_standard() -> None:
    x, y = np.array(FRAME.x), np.array(FRAME.y)
    origin = np.array(FRAME.origin)
    expected: dict[Conic, NDArray[np.float64]] = {
        Ellipse(FRAME, 2.0, 3.0): 2 * cos(0.7) * x + 3 * sin(0.7) * y,
        Parabola(FRAME, 2.0): 2 * 0.49 * x + 4 * 0.7 * y,
        Hyperbola(FRAME, 2.0, 3.0): 2 * cosh(0.7) * x + 3 * sinh(0.7) * y,
    }
    for conic, local in expected.items():
        assert np.array(conic.evaluate(0.7)) == pytest.approx(origin + local)
        assert conic.find_parameter(conic.evaluate(0.7)) == pytest.approx(0.7)


def test_lines() -> None:
    line = Line((1.0, 0.0, 0.0), (0.0, 2.0, 0.0))
    assert line.evaluate(3.0) == (1.0, 6.0, 0.0)
    assert line.find_parameter((5.0, 6.0, 7.0)) == 3.0
    assert find_ends(line.cut(-1.0, 3.0)).tolist() == [[1, -2, 0], [1, 6, 0]]
    with pytest.raises(InvalidGeometry, match="no direction"):
        Line((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(InvalidGeometry, match="no length"):
        line.cut(1.0, 1.0)


def test_polylines_go_through_their_points_once() -> None:
    points = [(0.0, 0.0, 0.0), (3.0, 4.0, 0.0), (3.0, 4.0, 0.0), (3.0, 4.0, 2.0)]
    curve = build_polyline(points)
    assert curve.knots.tolist() == [0, 0, 5, 7, 7]
    assert curve.points[:, :3].tolist() == [list(points[0]), list(points[1]), list(points[3])]
    with pytest.raises(InvalidGeometry, match="no length"):
        build_polyline(points[1:3])


@pytest.mark.parametrize("size", [0.0, -1.0, nan, float("inf")])
def test_sizes_that_are_not_positive_are_refused(size: float) -> None:
    for build in (
        lambda: Ellipse(FRAME, size, 1.0),
        lambda: Ellipse(FRAME, 1.0, size),
        lambda: Parabola(FRAME, size),
        lambda: Hyperbola(FRAME, 1.0, size),
    ):
        with pytest.raises(InvalidGeometry, match="not positive"):
            build()


def test_pieces_that_are_too_long_are_refused() -> None:
    with pytest.raises(InvalidGeometry, match="too long"):
        Hyperbola(FRAME, 1.0, 1.0).cut(-30.0, 30.0)
    with pytest.raises(InvalidGeometry, match="too large"):
        Parabola(FRAME, 1.0).cut(-1e7, 1e7)
    with pytest.raises(InvalidGeometry, match="too large"):
        Ellipse(FRAME, 1e13, 1e13).cut_whole()
