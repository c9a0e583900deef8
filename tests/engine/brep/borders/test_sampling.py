"""Samples of edges: bounds against rational points of curves, kinks, closed edges, collapse."""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.halving import halve_pieces
from service.engine.brep.borders.sampling import EDGE_SHARE, sample_edges
from service.engine.brep.prepared import PreparedBrep
from tests.engine.brep.sheets import SQUARE, Curve, hole, line, list_lines, prepare_sheets

coordinates = st.floats(0, 10).map(lambda x: round(x, 3))
points = st.tuples(coordinates, coordinates)


@st.composite
def curves(draw: st.DrawFn) -> Curve:
    """A Bézier curve of degree 1 to 5, maybe rational."""
    corners = draw(st.lists(points, min_size=2, max_size=6))
    weights = draw(st.none() | st.lists(st.floats(0.2, 5), min_size=6, max_size=6))
    return Curve(corners, None if weights is None else weights[: len(corners)])


def _evaluate(curve: Curve, bend: float, t: Fraction) -> tuple[Fraction, ...]:
    """A point (u, v, b u²) of an edge, exactly, by de Casteljau's algorithm."""
    weights = curve.weights or [1.0] * len(curve.points)
    level = [
        [Fraction(x) * Fraction(w), Fraction(y) * Fraction(w), Fraction(w)]
        for (x, y), w in zip(curve.points, weights, strict=True)
    ]
    while len(level) > 1:
        level = [[a + t * (b - a) for a, b in zip(p, q, strict=True)] for p, q in pairwise(level)]
    u, v = level[0][0] / level[0][2], level[0][1] / level[0][2]
    return u, v, Fraction(bend) * u * u


def _measure_squared(point: tuple[Fraction, ...], begin: list[float], end: list[float]) -> Fraction:
    """Squared distance of a point from a segment, exactly."""
    a, b = [Fraction(x) for x in begin], [Fraction(x) for x in end]
    along = [q - p for p, q in zip(a, b, strict=True)]
    to_point = [q - p for p, q in zip(a, point, strict=True)]
    squared = sum(x * x for x in along)
    foot = sum(x * y for x, y in zip(along, to_point, strict=True)) / squared if squared else 0
    foot = min(max(Fraction(foot), Fraction(0)), Fraction(1))
    return sum(((y - foot * x) ** 2 for x, y in zip(along, to_point, strict=True)), Fraction(0))


@given(curves(), st.sampled_from([0.0, 0.1]), st.sampled_from([1.0, 0.05]))
def test_edges_are_within_their_bounds(curve: Curve, bend: float, tolerance: float) -> None:
    prepared = prepare_sheets([[[curve]]], bend=bend)
    samples = sample_edges(prepared, tolerance)
    assert samples.bounds.max() <= EDGE_SHARE * tolerance
    for piece in range(len(samples.edges) - 1):
        ends = samples.positions[samples.vertices[piece : piece + 2]].tolist()
        low, high = (Fraction(t) for t in samples.parameters[piece : piece + 2].tolist())
        # The control points of a bent edge are products, with some rounding of their own.
        bound = Fraction(float(samples.bounds[piece])) + (Fraction(1, 10**12) if bend else 0)
        for share in (0, 1, 2, 3, 4):
            point = _evaluate(curve, bend, low + (high - low) * Fraction(share, 4))
            assert _measure_squared(point, *ends) <= bound * bound


def test_kinks_of_edges_and_of_parameter_curves_are_samples() -> None:
    bent = line((0, 0), (5, 1), (10, 0))
    prepared = prepare_sheets([[[bent, *list_lines([(10, 0), (10, 10), (0, 10), (0, 0)])[:3]]]])
    samples = sample_edges(prepared, 1.0)
    assert samples.parameters[samples.edges == 0].tolist() == [0, 0.5, 1]
    assert samples.positions[samples.vertices[1]].tolist() == [5, 1, 0]
    assert samples.counts.tolist() == [3, 2, 2, 2]


def test_closed_edges_have_three_pieces_and_double_ones_two() -> None:
    closed = Curve([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0)])
    double = [
        Curve([(6, 6), (8, 5), (9, 9)]),
        Curve([(9, 9), (6, 8), (6, 6)]),
        line((6, 6), (9, 9)),
    ]
    prepared = prepare_sheets([[[closed]], [double]])
    samples = sample_edges(prepared, 100.0)
    assert samples.counts[0] >= 4
    assert (samples.counts[1:] >= 3).all()
    chords = np.sort(np.stack([samples.vertices[:-1], samples.vertices[1:]]), axis=0)
    chords = chords[:, samples.edges[1:] == samples.edges[:-1]]
    assert len(np.unique(chords, axis=1).T) == chords.shape[1]


def _make_chain(length: float, uncertainty: float) -> PreparedBrep:
    """A square with a corner cut into five edges."""
    steps = [(9 + k * length / 5, 0.0) for k in range(6)]
    corners = [(0.0, 0.0), *steps, (10.0, 10.0), (0.0, 10.0)]
    return prepare_sheets([[list_lines(corners)]], uncertainty=uncertainty)


@pytest.mark.parametrize(
    ("length", "uncertainty", "collapsed"),
    [(0.099, 0.02, 5), (0.101, 0.021, 0), (0.099, 0.0197, 0), (1e-9, 1e-3, 5)],
)
def test_short_edges_collapse_by_chain(length: float, uncertainty: float, collapsed: int) -> None:
    prepared = _make_chain(length, uncertainty)
    samples = sample_edges(prepared, 1.0)
    assert samples.is_point.sum() == collapsed
    if collapsed:
        edges = np.flatnonzero(samples.is_point)
        assert len(np.unique(samples.vertices[np.isin(samples.edges, edges)])) == 1
        assert samples.edge_bounds[edges] == pytest.approx(length)
        # The edge after the chain begins at the vertex that stays: its bound has the distance.
        after = edges.max() + 1
        assert samples.edge_bounds[after] == pytest.approx(length, rel=0.05)
        assert samples.ends[after, 0] == samples.ends[edges[0], 0]


def test_edges_with_vertices_elsewhere_are_not_divided_for_ever() -> None:
    prepared = prepare_sheets([[SQUARE, hole((5, 5), 2)]])
    vertices = prepared.vertices.copy()
    vertices[:5, 2] += 3.0
    samples = sample_edges(replace(prepared, vertices=vertices), 1.0)
    assert samples.counts.max() < 16
    assert samples.edge_bounds[:4] == pytest.approx(3.0)
    assert 2.0 < samples.edge_bounds[4] < 3.6
    assert samples.edge_bounds[5:7].max() <= EDGE_SHARE


def _compare(a: EdgeSamples, b: EdgeSamples) -> None:
    for name in ("edges", "parameters", "offsets", "vertices", "bounds", "positions"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_halved_pieces_keep_what_is_known() -> None:
    prepared = prepare_sheets([[SQUARE, hole((5, 5), 2)]])
    samples = sample_edges(prepared, 0.5)
    pieces = np.array([8, 0, 8])
    halved, source = halve_pieces(prepared, samples, pieces)
    assert np.flatnonzero(source < 0).tolist() == [1, 10]
    kept = source >= 0
    assert source[kept].tolist() == list(range(len(samples.edges)))
    np.testing.assert_array_equal(halved.parameters[kept], samples.parameters)
    np.testing.assert_array_equal(
        halved.positions[halved.vertices[kept]], samples.positions[samples.vertices]
    )
    assert halved.parameters[10] == samples.parameters[8:10].mean()
    unchanged = np.setdiff1d(np.flatnonzero(kept), [0, 9])
    np.testing.assert_array_equal(halved.bounds[unchanged], samples.bounds[source[unchanged]])
    assert (halved.bounds[[9, 10]] < 0.3 * samples.bounds[8]).all()
    again, none = halve_pieces(prepared, samples, np.zeros(0, np.intp))
    _compare(again, samples)
    assert (none >= 0).all()
