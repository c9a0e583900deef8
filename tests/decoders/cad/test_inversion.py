"""Parameters of points on curves, and pieces between vertices, also over seams and reversed."""

import tracemalloc
from math import cos, pi, sin, tau
from time import process_time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.decoders.cad.conics import Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, build_frame
from service.decoders.cad.inversion import find_parameters
from service.decoders.cad.newton import find_middle
from service.decoders.cad.pieces import cut_between
from service.decoders.cad.splines import build_curve, evaluate, find_domain, find_ends
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

FRAME = build_frame((3.0, -1.0, 2.0), (1.0, 2.0, -0.5), (0.0, 1.0, 0.3))
Array = NDArray[np.float64]


def to_vector(point: Array) -> Vector:
    x, y, z = point.tolist()
    return x, y, z


def find_distances(points: Array, curve: Curve) -> Array:
    """Distances of points from a curve, by 20 001 samples; not below the true ones."""
    samples = evaluate(curve, np.linspace(*find_domain(curve), 20_001))
    return np.array([np.sqrt(np.square(samples - point).sum(axis=1).min()) for point in points])


@given(vector=knot_vectors(), seed=st.integers(0, 2**32 - 1))
def test_no_sample_is_nearer_than_the_nearest_point(vector: KnotVector, seed: int) -> None:
    count = vector.point_count
    weights = random_weights(count, seed) ** 0.5
    curve = build_curve(vector.degree, vector.knots, random_points(count, seed), weights)
    points = random_points(6, seed + 1)
    parameters, distances = find_parameters(curve, points)
    there = np.sqrt(np.square(evaluate(curve, parameters) - points).sum(axis=1))
    assert there == pytest.approx(distances, abs=1e-12)
    assert (distances <= find_distances(points, curve) + 1e-9).all()


@given(vector=knot_vectors(), seed=st.integers(0, 2**32 - 1))
def test_points_of_a_curve_are_found(vector: KnotVector, seed: int) -> None:
    curve = build_curve(vector.degree, vector.knots, random_points(vector.point_count, seed))
    t = np.linspace(*find_domain(curve), 7)
    points = evaluate(curve, t)
    parameters, distances = find_parameters(curve, points)
    assert distances.max() < 1e-7
    assert evaluate(curve, parameters) == pytest.approx(points, abs=1e-7)


def test_edges_on_lines_have_no_curve_but_a_gap() -> None:
    line = Line((0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    piece = cut_between(line, (1.0, 0.0, 0.0), (5.0, 0.0, 1e-3))
    assert piece.curve is None
    assert piece.gap == 1e-3
    for is_loop, last in ((True, (1.0, 0.0, 0.0)), (False, (1.0, 0.0, 0.0))):
        with pytest.raises(InvalidGeometry, match="no length"):
            cut_between(line, (1.0, 0.0, 0.0), last, is_loop=is_loop)


@pytest.mark.parametrize("same_sense", [True, False])
@pytest.mark.parametrize(("first", "last"), [(0.3, 2.0), (2.0, 0.3), (-3.0, 3.0), (3.0, -3.0)])
def test_arcs_run_the_right_way_around(first: float, last: float, same_sense: bool) -> None:
    circle = Ellipse(FRAME, 2.0, 1.0)
    ends = circle.evaluate(first), circle.evaluate(last)
    piece = cut_between(circle, *ends, same_sense=same_sense)
    assert piece.curve is not None
    assert piece.gap < 1e-14
    assert find_ends(piece.curve) == pytest.approx(np.array(ends))
    sweep = (last - first) % tau if same_sense else (first - last) % tau
    middle = first + sweep / 2 if same_sense else first - sweep / 2
    assert find_distances(np.array([circle.evaluate(middle)]), piece.curve)[0] < 1e-3
    opposite = np.array([circle.evaluate(middle + pi)])
    assert find_distances(opposite, piece.curve)[0] > 0.1


@pytest.mark.parametrize("same_sense", [True, False])
@pytest.mark.parametrize("is_loop", [True, False])
def test_whole_circles_begin_and_end_at_their_vertex(is_loop: bool, same_sense: bool) -> None:
    circle = Ellipse(FRAME, 2.0, 2.0)
    point = circle.evaluate(1.0)
    # Two vertices at one place are a whole circle, too.
    piece = cut_between(circle, point, point, same_sense=same_sense, is_loop=is_loop)
    assert piece.curve is not None
    assert find_ends(piece.curve) == pytest.approx(np.array([point, point]))
    assert find_domain(piece.curve)[1] - find_domain(piece.curve)[0] == pytest.approx(tau)
    quarter = evaluate(piece.curve, [find_domain(piece.curve)[0] + pi / 2])[0]
    angle = 1.0 + (pi / 2 if same_sense else -pi / 2)
    assert quarter == pytest.approx(np.array(circle.evaluate(angle)))


@pytest.mark.parametrize("same_sense", [True, False])
@pytest.mark.parametrize("conic", [Parabola(FRAME, 0.5), Hyperbola(FRAME, 1.0, 2.0)])
@pytest.mark.parametrize(("first", "last"), [(-1.0, 2.0), (2.0, -1.0)])
def test_open_conics_are_cut(
    conic: Parabola | Hyperbola, first: float, last: float, same_sense: bool
) -> None:
    ends = conic.evaluate(first), conic.evaluate(last)
    piece = cut_between(conic, *ends, same_sense=same_sense)
    assert piece.curve is not None
    assert find_ends(piece.curve) == pytest.approx(np.array(ends))
    assert find_distances(np.array([conic.evaluate(0.5)]), piece.curve)[0] < 1e-3


def build_wave() -> Curve:
    points = [[k, sin(k), cos(k)] for k in range(9)]
    return build_curve(3, [0, 0, 0, *np.linspace(0, 1, 7), 1, 1, 1], points)


@pytest.mark.parametrize("same_sense", [True, False])
@pytest.mark.parametrize(("first", "last"), [(0.0, 1.0), (0.2, 0.7), (0.7, 0.2), (0.0, 0.5)])
def test_open_splines_are_cut_to_the_piece_between_both_points(
    first: float, last: float, same_sense: bool
) -> None:
    wave = build_wave()
    ends = evaluate(wave, [first, last])
    piece = cut_between(wave, *map(to_vector, ends), same_sense=same_sense)
    assert piece.curve is not None
    assert piece.gap < 1e-12
    assert find_ends(piece.curve) == pytest.approx(ends)
    t = np.linspace(min(first, last), max(first, last), 9)
    assert find_distances(evaluate(wave, t), piece.curve).max() < 1e-3
    low, high = find_domain(piece.curve)
    assert high - low == pytest.approx(abs(last - first))


def test_vertices_a_little_off_the_ends_of_a_spline_do_not_cut_it() -> None:
    wave = build_wave()
    ends = find_ends(wave) + np.array([[1e-4, 0, 1e-4], [0, 1e-4, 0]])
    piece = cut_between(wave, *map(to_vector, ends))
    assert piece.curve is not None
    assert find_domain(piece.curve) == (0.0, 1.0)
    assert piece.gap == pytest.approx(1e-4 * 2**0.5)


RING = build_curve(
    3, np.arange(-3.0, 12.0), [[3 * cos(k * pi / 4), 2 * sin(k * pi / 4), 0] for k in range(11)]
)
"""A closed spline of uniform knots, over [0, 8]."""


@pytest.mark.parametrize("same_sense", [True, False])
@pytest.mark.parametrize(
    ("first", "last"), [(1.0, 3.0), (6.5, 2.5), (0.0, 3.0), (3.0, 0.0), (0.0, 8.0), (3.0, 2.9999)]
)
def test_closed_splines_are_cut_over_their_seam(
    first: float, last: float, same_sense: bool
) -> None:
    ends = evaluate(RING, [first, last])
    piece = cut_between(RING, *map(to_vector, ends), same_sense=same_sense)
    assert piece.curve is not None
    assert piece.gap < 1e-9
    assert find_ends(piece.curve) == pytest.approx(ends, abs=1e-8)
    low, high = find_domain(piece.curve)
    whole = ends[0] == pytest.approx(ends[1])
    expected = 8.0 if whole else (last - first if same_sense else first - last) % 8
    assert high - low == pytest.approx(expected, abs=1e-6)
    begin = first if same_sense else last
    inside = evaluate(RING, (begin + np.linspace(0.05, 0.95, 5) * expected) % 8)
    assert find_distances(inside, piece.curve).max() < 1e-3


@pytest.mark.parametrize("start", [0.0, 8.0, 2.3])
def test_a_whole_closed_spline_begins_at_its_vertex(start: float) -> None:
    point = evaluate(RING, [start])[0]
    piece = cut_between(RING, to_vector(point), to_vector(point), is_loop=True)
    assert piece.curve is not None
    assert find_ends(piece.curve) == pytest.approx(np.array([point, point]), abs=1e-9)
    assert find_domain(piece.curve)[1] - find_domain(piece.curve)[0] == pytest.approx(8.0)


def test_a_short_piece_at_the_seam_is_not_the_whole_curve() -> None:
    """With a tolerance above its length it was the whole ring."""
    ends = evaluate(RING, [0.0, 0.001])
    piece = cut_between(RING, *map(to_vector, ends), tolerance=0.01)
    assert piece.curve is not None
    assert find_domain(piece.curve)[1] == pytest.approx(0.001, abs=1e-6)


def test_impossible_pieces_are_refused() -> None:
    wave = build_wave()
    point = to_vector(evaluate(wave, [0.4])[0])
    with pytest.raises(InvalidGeometry, match="not closed"):
        cut_between(wave, point, point, is_loop=True)
    with pytest.raises(InvalidGeometry, match="no length"):
        cut_between(wave, point, point)


@pytest.mark.slow
def test_long_curves_take_little_memory() -> None:
    """With 65 samples of each span at once this curve would take 60 MB, and copies of that."""
    count, degree = 1_000, 30
    points = np.column_stack([np.arange(count), np.zeros((count, 2))])
    curve = build_curve(degree, np.arange(count + degree + 1.0), points)
    tracemalloc.start()
    parameters, distances = find_parameters(curve, np.array([[777.5, 0.0, 1.0]]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
    assert distances[0] == pytest.approx(1.0)
    assert evaluate(curve, parameters)[0, 0] == pytest.approx(777.5)


@given(vector=knot_vectors(), seed=st.integers(0, 2**32 - 1))
def test_the_middle_of_a_curve_is_on_it(vector: KnotVector, seed: int) -> None:
    count = vector.point_count
    curve = build_curve(
        vector.degree, vector.knots, random_points(count, seed), random_weights(count, seed)
    )
    middle = np.array([find_middle(curve)])
    assert find_parameters(curve, middle)[1][0] < 1e-9
    assert np.abs(middle - find_ends(curve)).max() > 1e-6


@pytest.mark.slow
def test_many_edges_may_be_parts_of_one_long_curve() -> None:
    """Each of them took half a second, for samples and for knots that stay."""
    count, degree = 4_000, 30
    points = np.column_stack([np.arange(count), np.zeros((count, 2))])
    curve = build_curve(degree, np.arange(count + degree + 1.0), points)
    begin = process_time()
    for k in range(100, 3_900, 76):
        piece = cut_between(curve, (float(k), 0.0, 0.0), (k + 50.5, 0.0, 0.0))
        assert piece.curve is not None
        assert find_ends(piece.curve)[:, 0] == pytest.approx([k, k + 50.5])
    assert process_time() - begin < 6.0  # it was half a minute
