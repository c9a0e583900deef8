"""Curves of each type, compared with their equations."""

from math import cos, cosh, isclose, pi, radians, sin, sinh

import numpy as np
import pytest

from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.splines import evaluate, find_domain, find_ends
from service.decoders.format import FileLimits
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.readers import Readers
from service.errors import InvalidRequest
from tests.decoders.iges.reading import build_readers, sample
from tests.decoders.iges.writing import Word, Writer, add_line


def read_curve(kind: int, *words: Word, form: int = 0) -> Curve:
    writer = Writer()
    number = writer.add(kind, *words, form=form)
    return build_readers(writer).curves.read_one(number)


def test_lines_have_the_parameters_0_to_1() -> None:
    line = read_curve(110, 1.0, 2.0, 3.0, 5.0, 2.0, 3.0)
    assert find_domain(line) == (0.0, 1.0)
    np.testing.assert_allclose(evaluate(line, [0.25]), [[2, 2, 3]])
    with pytest.raises(Unsupported):
        read_curve(110, 1.0, 2.0, 3.0, 5.0, 2.0, 3.0, form=1)
    with pytest.raises(Fault, match="no length"):
        read_curve(110, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0)


@pytest.mark.parametrize(("first", "last"), [(0, 90), (30, 300), (350, 20), (200, 190), (45, 45)])
def test_arcs_run_counter_clockwise_from_start_to_end(first: float, last: float) -> None:
    a, b = radians(first), radians(last)
    b = b if b > a + 1e-6 else b + 2 * pi
    start, end = ((1 + 2 * cos(t), -1 + 2 * sin(t)) for t in (a, b))
    arc = read_curve(100, 7.0, 1.0, -1.0, *start, *end)
    points = sample(arc)
    np.testing.assert_allclose(np.hypot(points[:, 0] - 1, points[:, 1] + 1), 2)
    np.testing.assert_allclose(points[:, 2], 7)
    assert find_domain(arc) == pytest.approx((a, b))
    np.testing.assert_allclose(find_ends(arc)[:, :2], [start, end], atol=1e-12)
    middle = evaluate(arc, [(a + b) / 2])[0]
    expected = 1 + 2 * cos((a + b) / 2), -1 + 2 * sin((a + b) / 2), 7
    np.testing.assert_allclose(middle, expected, atol=1e-12)


def test_an_ellipse_may_be_turned_and_moved() -> None:
    # (x', y') = (3 cos t, 2 sin t), turned by 30 degrees about (4, 1).
    turn = np.array([[cos(pi / 6), -sin(pi / 6)], [sin(pi / 6), cos(pi / 6)]])
    matrix = turn @ np.diag([1 / 9, 1 / 4]) @ turn.T
    center = np.array([4.0, 1.0])
    linear = -2 * matrix @ center
    equation = [matrix[0, 0], 2 * matrix[0, 1], matrix[1, 1], *linear, center @ matrix @ center - 1]
    ends = [turn @ (3 * cos(t), 2 * sin(t)) + center for t in (0.3, 2.5)]
    arc = read_curve(104, *map(float, equation), 5.0, *map(float, np.concatenate(ends)), form=1)
    local = (sample(arc)[:, :2] - center) @ turn
    np.testing.assert_allclose((local[:, 0] / 3) ** 2 + (local[:, 1] / 2) ** 2, 1)
    # Counter-clockwise: by 2.2 radians, not by the rest of the turn.
    angles = np.unwrap(np.arctan2(local[:, 1] / 2, local[:, 0] / 3))
    assert (np.diff(angles) > 0).all()
    assert isclose(angles[-1] - angles[0], 2.2)


def test_an_ellipse_whose_ends_are_equal_is_whole() -> None:
    ellipse = read_curve(104, 0.25, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 2.0, 0.0, 2.0, 0.0, form=1)
    ends = find_ends(ellipse)
    np.testing.assert_allclose(ends[0], ends[1])
    assert np.ptp(sample(ellipse, 33)[:, 1]) == pytest.approx(2)


@pytest.mark.parametrize("is_reversed", [False, True])
def test_a_hyperbola_runs_on_the_branch_of_its_start(is_reversed: bool) -> None:
    # x² / 4 − y² / 9 = 1, on the left branch.
    ends = [(-2 * cosh(t), 3 * sinh(t)) for t in (-1.0, 0.5)]
    ends = ends[::-1] if is_reversed else ends
    words = [0.25, 0.0, -1 / 9, 0.0, 0.0, -1.0, 2.0, *ends[0], *ends[1]]
    curve = read_curve(104, *words, form=2)
    x, y, z = sample(curve).T
    np.testing.assert_allclose(x**2 / 4 - y**2 / 9, 1)
    assert (x < 0).all()
    np.testing.assert_array_equal(z, 2.0)
    np.testing.assert_allclose(find_ends(curve)[:, :2], ends)


@pytest.mark.parametrize("form", [0, 3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_parabola_opens_along_its_axis(form: int, sign: float) -> None:
    # x² = ± 8 y
    ends = [(t, sign * t * t / 8) for t in (-1.0, 3.0)]
    curve = read_curve(
        104, 1.0, 0.0, 0.0, 0.0, -8.0 * sign, 0.0, 0.0, *ends[0], *ends[1], form=form
    )
    x, y, _ = sample(curve).T
    np.testing.assert_allclose(x**2, 8 * sign * y, atol=1e-12)
    np.testing.assert_allclose(find_ends(curve)[:, :2], ends, atol=1e-12)


def test_wrong_conics_are_faults() -> None:
    with pytest.raises(Fault, match="not on the conic"):
        read_curve(104, 1.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 2.0, 0.0, 0.0, 1.0, form=1)
    with pytest.raises(Fault, match="not of the kind"):
        read_curve(104, 1.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 1.0, form=2)
    with pytest.raises(Fault, match="degree 2"):
        read_curve(104, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def test_copious_data_are_lines_through_points() -> None:
    flat = read_curve(106, 1, 3, 5.0, 0.0, 0.0, 1.0, 0.0, 1.0, 2.0, form=11)
    np.testing.assert_array_equal(evaluate(flat, [0, 1, 2]), [[0, 0, 5], [1, 0, 5], [1, 2, 5]])
    space = read_curve(106, 2, 2, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, form=12)
    np.testing.assert_array_equal(find_ends(space), [[0, 1, 2], [3, 4, 5]])
    vectors = read_curve(106, 3, 2, *[0.0, 1.0, 2.0, 9.0, 9.0, 9.0] * 1, *[1.0] * 6, form=13)
    np.testing.assert_array_equal(find_ends(vectors), [[0, 1, 2], [1, 1, 1]])
    closed = read_curve(106, 1, 3, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 2.0, form=63)
    np.testing.assert_array_equal(find_ends(closed), np.zeros((2, 3)))
    repeated = read_curve(106, 1, 4, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 2.0, form=11)
    assert len(repeated.points) == 3
    with pytest.raises(Unsupported):
        read_curve(106, 1, 2, 0.0, 0.0, 0.0, 1.0, 1.0, form=31)


def test_parametric_splines_are_pieces_of_powers() -> None:
    breaks, powers = [1.0, 3.0, 4.0], np.zeros((2, 3, 4))
    powers[0, 0] = [0, 1, 2, -0.5]
    powers[0, 1] = [1, 0, 0, 0]
    # The second piece continues the first one, with another slope.
    powers[1, 0] = [0 + 1 * 2 + 2 * 4 - 0.5 * 8, 3, 0, 1]
    powers[1, 1] = [1, 5, 0, 0]
    curve = read_curve(112, 3, 0, 3, 2, *breaks, *powers.ravel().tolist(), *[0.0] * 12)
    t = np.array([1.0, 1.5, 2.9, 3.25, 4.0])
    piece = (t >= 3).astype(int)
    s = t - np.array(breaks)[piece]
    expected = (powers[piece] * s[:, None, None] ** np.arange(4)).sum(axis=2)
    np.testing.assert_allclose(evaluate(curve, t), expected)
    powers[1, 0, 0] += 1
    with pytest.raises(Fault, match="do not meet"):
        read_curve(112, 3, 0, 3, 2, *breaks, *powers.ravel().tolist(), *[0.0] * 12)


def test_rational_splines_are_cut_to_their_range() -> None:
    half = 0.5**0.5
    words: list[Word] = [
        2, 2, 1, 0, 0, 0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, half, 1.0,
        1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0,
    ]  # fmt: skip
    whole = read_curve(126, *words, 0.0, 1.0, 0.0, 0.0, 1.0)
    np.testing.assert_allclose(np.hypot(*sample(whole)[:, :2].T), 1)
    part = read_curve(126, *words, 0.5, 1.0, 0.0, 0.0, 1.0)
    assert find_domain(part) == (0.5, 1.0)
    np.testing.assert_allclose(find_ends(part), [[half, half, 0], [0, 1, 0]], atol=1e-15)
    without_range = read_curve(126, *words)
    assert find_domain(without_range) == (0.0, 1.0)


def test_polynomial_splines_may_have_no_weights() -> None:
    words = [1, 1, 0, 0, 1, 0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    np.testing.assert_array_equal(find_ends(read_curve(126, *words)), [[0, 0, 0], [1, 2, 3]])
    words[4] = 0
    with pytest.raises(InvalidGeometry, match="weight"):
        read_curve(126, *words)


@pytest.mark.parametrize(("normal", "side"), [(1.0, 1.0), (-1.0, -1.0)])
def test_offset_curves_are_on_the_left_about_their_normal(normal: float, side: float) -> None:
    writer = Writer()
    line = writer.add(110, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0)
    move = writer.add(124, 1.0, 0.0, 0.0, 10.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    arc = writer.add(100, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, matrix=move)
    words = [1, 0, 2, 0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, normal]
    offsets = [
        writer.add(130, line, *words, 0.25, 1.0),
        writer.add(130, arc, *words, 0.0, pi / 2),
        writer.add(130, arc, *words),
    ]
    curves = build_readers(writer).curves
    ends = find_ends(curves.read_one(offsets[0]))
    np.testing.assert_allclose(ends, [[1, 0.5 * side, 0], [4, 0.5 * side, 0]])
    for number in offsets[1:]:
        points = sample(curves.read_one(number)) - [10, 0, 0]
        np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 2 - 0.5 * side)
        np.testing.assert_allclose(points[0], [2 - 0.5 * side, 0, 0], atol=1e-12)


def test_other_offset_curves_are_not_read() -> None:
    writer = Writer()
    polyline = writer.add(106, 1, 2, 0.0, 0.0, 0.0, 1.0, 1.0, form=11)
    arc = writer.add(100, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0)
    words = [0, 2, 0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    wrong = [
        writer.add(130, base, flag, *words) for base, flag in ((polyline, 1), (arc, 2), (arc, 1))
    ]
    curves = build_readers(writer).curves
    for number in wrong:
        with pytest.raises(Fault):
            curves.read(number)


def test_counts_are_checked_before_use() -> None:
    for count, degree in ((10**9, 3), (-1, 1), (2, 10**6)):
        with pytest.raises(Fault):
            read_curve(126, count, degree, 0, 0, 1, 0, 0.0, 0.0, 1.0, 1.0)


def test_composite_curves_are_taken_apart() -> None:
    writer = Writer()
    first = add_line(writer, (0, 0), (1, 0), (1, 1))
    point = writer.add(116, 1.0, 1.0, 0.0)
    last = add_line(writer, (1, 1), (0, 0))
    whole = writer.add(102, 3, first, point, last)
    curves = build_readers(writer).curves.read(whole)
    assert [find_ends(curve)[0].tolist() for curve in curves] == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]


def test_parts_of_composite_curves_that_are_points_are_left_out() -> None:
    writer = Writer()
    line = add_line(writer, (0, 0), (1, 0))
    point = writer.add(110, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    spline = writer.add(126, 1, 1, 1, 0, 1, 0, 0, 0, 1, 1, 1, 1, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    whole = writer.add(102, 3, line, point, spline)
    points = writer.add(102, 2, point, spline)
    curves = build_readers(writer).curves
    assert len(curves.read(whole)) == 1
    with pytest.raises(Fault, match="no parts"):
        curves.read(points)


def test_composite_curves_in_a_circle_are_faults() -> None:
    writer = Writer()
    writer.add(102, 2, 1, 1)
    with pytest.raises(Fault):
        build_readers(writer).curves.read(1)


def test_curves_that_double_again_and_again_are_faults() -> None:
    writer = Writer()
    number = add_line(writer, (0, 0), (1, 0))
    for _ in range(30):
        number = writer.add(102, 2, number, number)
    with pytest.raises(Fault, match="many entities"):
        build_readers(writer).curves.read(number)


def test_a_curve_that_is_read_again_and_again_is_charged_each_time() -> None:
    writer = Writer()
    number = writer.add(106, 1, 500, 0.0, *map(float, range(1000)), form=11)
    readers = Readers.of(writer.file(), FileLimits(max_control_points=1200))
    assert len(readers.curves.read_one(number).points) == 500
    readers.curves.read_one(number)
    with pytest.raises(InvalidRequest) as info:
        readers.curves.read_one(number)
    assert info.value.issues[0].code == "too_many_control_points"


def test_matrices_move_curves_and_apply_one_after_another() -> None:
    writer = Writer()
    outer = writer.add(124, 1.0, 0.0, 0.0, 10.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    turn = writer.add(
        124, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, matrix=outer
    )
    line = writer.add(110, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, matrix=turn)
    again = writer.add(110, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, matrix=outer)
    curves = build_readers(writer).curves
    np.testing.assert_allclose(find_ends(curves.read_one(line)), [[10, 1, 0], [10, 2, 0]])
    np.testing.assert_allclose(find_ends(curves.read_one(again)), [[11, 0, 0], [12, 0, 0]])
    np.testing.assert_allclose(find_ends(curves.read_one(line)), [[10, 1, 0], [10, 2, 0]])


def test_matrices_without_an_inverse_and_circles_of_them_are_faults() -> None:
    writer = Writer()
    flat = writer.add(124, *[0.0] * 12)
    circle = writer.add(
        124, *[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0], matrix=3
    )
    transformations = build_readers(writer).transformations
    for number in (flat, circle, 99):
        with pytest.raises(Fault):
            transformations.find(number)
    assert transformations.find(0) is None
