"""Tables of splines are checked as single splines are; single splines are the slow truth."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.errors import InvalidRequest
from service.surface.bspline import BsplineSurface
from service.surface.curve import BsplineCurve
from service.surface.knot_tables import KnotTable, complete_knots, has_valid_form
from service.surface.knots import build_knot_vector, find_least_span
from service.surface.spline_checks import check_curves, check_surfaces, find_end_points
from service.surface.spline_tables import CurveTable, SurfaceTable, expand_rows, find_starts

NUMBERS = st.sampled_from([0.0, -0.0, 1.0, 2.0, -3.5, 1e-13])
GAPS = st.sampled_from([0.0, 1.0, 1.0, 0.5, 1e-13])
WEIGHTS = st.sampled_from([1.0, 1.0, 2.0, 3.0])
FAULTS: dict[str, list[float]] = {
    "control_points": [4e38, -1e300],
    "knots": [-1e-14, -1.0, 1e-39, 5e38],
    "weights": [0.0, -1.0, 1e-9, 1e30],
}


@st.composite
def draw_curves(draw: st.DrawFn) -> list[dict[str, Any]]:
    """Arguments of some curves, one of which may have a fault."""
    curves = []
    for _ in range(draw(st.integers(1, 4))):
        degree = draw(st.integers(1, 3))
        count = draw(st.integers(degree + 1, degree + 4))
        gaps = draw(st.lists(GAPS, min_size=count + degree, max_size=count + degree))
        if draw(st.booleans()):
            gaps[:degree] = gaps[-degree:] = [0.0] * degree
        knots = np.cumsum([draw(st.sampled_from([0.0, -1.0, 1e6])), *gaps])
        points = draw(st.lists(NUMBERS, min_size=3 * count, max_size=3 * count))
        weights = draw(st.none() | st.lists(WEIGHTS, min_size=count, max_size=count))
        scale = draw(st.sampled_from([1.0, 1.0, 1e30]))
        curves.append(
            {
                "control_points": np.reshape(points, (count, 3)),
                "degree": degree,
                "knots": knots,
                "weights": None if weights is None else np.array(weights) * scale,
            }
        )
    if draw(st.integers(0, 2)) == 0:
        arguments: dict[str, Any] = draw(st.sampled_from(curves))
        name = draw(st.sampled_from([n for n in FAULTS if arguments[n] is not None]))
        array = arguments[name].reshape(-1)
        array[draw(st.integers(0, len(array) - 1))] = draw(st.sampled_from(FAULTS[name]))
    return curves


def to_table(curves: list[dict[str, Any]]) -> CurveTable:
    weights = [
        np.ones(len(c["control_points"])) if c["weights"] is None else c["weights"] for c in curves
    ]
    return CurveTable(
        np.array([c["degree"] for c in curves]),
        np.array([len(c["control_points"]) for c in curves]),
        np.concatenate([c["control_points"] for c in curves]),
        np.concatenate(weights),
        np.array([c["weights"] is not None for c in curves]),
        np.concatenate([c["knots"] for c in curves]),
    )


def build(**arguments: Any) -> BsplineCurve | None:
    try:
        return BsplineCurve(**arguments)
    except InvalidRequest:
        return None


@given(draw_curves())
def test_a_table_refuses_the_curves_that_are_refused_alone(curves: list[dict[str, Any]]) -> None:
    table, invalid = check_curves(to_table(curves))
    singles = [build(**arguments) for arguments in curves]
    refused = [number for number, single in enumerate(singles) if single is None]
    # The table stops at the first kind of error, so it may name fewer curves.
    assert set(invalid.tolist()) <= set(refused)
    assert bool(len(invalid)) == bool(refused)
    if refused:
        return
    ends = find_end_points(table)
    for number, single in enumerate(singles):
        assert single is not None
        one = table.select(np.array([number]))
        assert one.points.tobytes() == single.control_points.tobytes()
        assert np.array_equal(one.knots, single.knot_vector)
        pieces = single.lower()
        expected = np.stack([pieces.points[0, 0], pieces.points[-1, -1]])
        scale = np.abs(single.control_points).max()
        np.testing.assert_allclose(ends[number], expected, rtol=0, atol=1e-9 * scale)
        if single.weights is None or single.weights.min() == single.weights.max():
            assert not one.is_rational[0]
            assert (one.weights == 1).all()
        else:
            assert one.weights.tobytes() == single.weights.tobytes()


@given(draw_curves())
def test_the_ends_of_clamped_curves_are_their_control_points(curves: list[dict[str, Any]]) -> None:
    for arguments in curves:
        count, degree = len(arguments["control_points"]), arguments["degree"]
        arguments["knots"] = knot.clamped_knots(count, degree)
        arguments["control_points"] = np.arange(3.0 * count).reshape(count, 3)
        arguments["weights"] = None
    table, _ = check_curves(to_table(curves))
    ends = find_end_points(table)
    assert np.array_equal(ends[:, 0], table.points[table.point_starts[:-1]])
    assert np.array_equal(ends[:, 1], table.points[table.point_starts[1:] - 1])


@given(draw_curves(), draw_curves())
def test_a_table_refuses_the_surfaces_that_are_refused_alone(
    along_u: list[dict[str, Any]], along_v: list[dict[str, Any]]
) -> None:
    pairs = list(zip(along_u, along_v, strict=False))
    nets: list[FloatArray] = []
    refused = []
    for number, (u, v) in enumerate(pairs):
        shape = len(u["control_points"]), len(v["control_points"])
        nets.append(np.arange(3.0 * shape[0] * shape[1]).reshape(*shape, 3))
        try:
            surface = BsplineSurface(nets[-1], (u["degree"], v["degree"]), (u["knots"], v["knots"]))
        except InvalidRequest:
            refused.append(number)
            continue
        for axis in range(2):
            vector, degree = surface.knot_vectors[axis], surface.degree[axis]
            low, high = knot.domain(vector, degree)
            inside = vector[(vector > low) & (vector < high)]
            if len(inside) and np.unique(inside, return_counts=True)[1].max() > degree:
                refused.append(number)  # a surface alone may jump, a face may not
                break
    table = SurfaceTable(
        np.array([(u["degree"], v["degree"]) for u, v in pairs]),
        np.array([net.shape[:2] for net in nets]),
        np.concatenate([net.reshape(-1, 3) for net in nets]),
        np.ones(sum(net.size // 3 for net in nets)),
        np.zeros(len(pairs), bool),
        np.concatenate([np.concatenate([u["knots"], v["knots"]]) for u, v in pairs]),
    )
    _, invalid = check_surfaces(table)
    assert set(invalid.tolist()) <= set(refused)
    assert bool(len(invalid)) == bool(refused)


@given(draw_curves())
def test_knots_are_merged_as_those_of_single_curves(curves: list[dict[str, Any]]) -> None:
    for arguments in curves:
        arguments["knots"] = np.sort(arguments["knots"])
    table = to_table(curves)
    merged = KnotTable(table.knots, table.degrees, table.counts).merge()
    for number, arguments in enumerate(curves):
        vector, degree = arguments["knots"], arguments["degree"]
        least = find_least_span(*knot.domain(vector, degree))
        expected = knot.merge_knots(vector, degree, least)
        rows = slice(*merged.starts[number : number + 2])
        assert np.array_equal(merged.knots[rows], expected)
        assert merged.span_counts[number] == len(knot.spans(expected, degree))


def test_the_first_and_the_last_knot_may_be_left_out() -> None:
    vectors = [np.array([0.0, 0, 1, 2, 2]), np.array([0.0, 1.0]), np.array([-1.0, 0, 1, 2, 3, 4])]
    degrees, counts = np.array([2, 1, 2]), np.array([4, 2, 3])
    lengths = np.array(list(map(len, vectors)))
    assert has_valid_form(degrees, counts, lengths).all()
    table = complete_knots(np.concatenate(vectors), lengths, degrees, counts)
    for number, vector in enumerate(vectors):
        expected = build_knot_vector(vector, counts.item(number), degrees.item(number))
        assert np.array_equal(table.knots[slice(*table.starts[number : number + 2])], expected)


@pytest.mark.parametrize(
    ("degree", "count", "length"), [(0, 2, 3), (65, 70, 136), (2, 2, 5), (1, 2, 3), (1, 2, 5)]
)
def test_other_numbers_of_knots_have_no_valid_form(degree: int, count: int, length: int) -> None:
    assert not has_valid_form(*map(np.array, ([degree], [count], [length])))[0]


def test_rows_of_chosen_entries() -> None:
    starts = find_starts(np.array([2, 0, 3]))
    assert starts.tolist() == [0, 2, 2, 5]
    assert expand_rows(starts, np.array([2, 1, 0, 2])).tolist() == [2, 3, 4, 0, 1, 2, 3, 4]
    assert expand_rows(starts, np.array([], np.intp)).tolist() == []
