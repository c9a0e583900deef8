"""Conflicts between sides of polygons, against rational numbers; moves of corners."""

from dataclasses import replace
from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.brep.borders import box_pairs, crossings
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.crossings import find_conflicts, find_steps
from tests.engine.brep.polygons import Loop, build_polygons

SQUARE = [(0, 0), (100, 0), (100, 100), (0, 100)]

small = st.tuples(st.integers(0, 6), st.integers(0, 6))
large = st.tuples(*(st.sampled_from([0, 1, 2, (1 << 30) - 1, 1 << 30]),) * 2)


def _are_in_conflict(polygons: Polygons, i: int, j: int) -> bool:
    """Whether two sides cross, or an end of one is on the other, but not at its end and vertex."""
    ends = [
        [
            (tuple(map(Fraction, places[k].tolist())), int(vertices[k]))
            for places, vertices in (
                (polygons.begins, polygons.begin_vertices),
                (polygons.ends, polygons.end_vertices),
            )
        ]
        for k in (i, j)
    ]
    if ends[0] == ends[1] and ends[0][0] != ends[0][1]:
        return True
    for own, other in (ends, ends[::-1]):
        (a, _), (b, _) = other
        if any(_is_on(end[0], a, b) and end not in other for end in own):
            return True
    return _cross(polygons, i, j)


def _cross(polygons: Polygons, i: int, j: int) -> bool:
    """Whether two sides cross at a point inside both."""
    a, b, c, d = (
        tuple(map(Fraction, places[k].tolist()))
        for k in (i, j)
        for places in (polygons.begins, polygons.ends)
    )
    r, s = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    determinant = r[0] * s[1] - r[1] * s[0]
    if not determinant:
        return False
    t = ((c[0] - a[0]) * s[1] - (c[1] - a[1]) * s[0]) / determinant
    u = ((c[0] - a[0]) * r[1] - (c[1] - a[1]) * r[0]) / determinant
    return bool(0 < t < 1 and 0 < u < 1)


Point = tuple[Fraction, ...]


def _is_on(p: Point, a: Point, b: Point) -> bool:
    area = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    within = all(min(a[k], b[k]) <= p[k] <= max(a[k], b[k]) for k in range(2))
    return area == 0 and within


@given(
    st.lists(st.lists(small, min_size=3, max_size=7), min_size=1, max_size=3),
    st.lists(st.lists(large, min_size=3, max_size=4), min_size=1, max_size=2),
    st.integers(1, 30),
)
def test_conflicts_are_those_of_rational_numbers(
    first: list[Loop], second: list[Loop], vertices: int
) -> None:
    polygons = build_polygons(first, second)
    # Some corners at one place have different vertices.
    numbers = polygons.begin_vertices * 100 + np.arange(len(polygons.faces)) // vertices
    polygons = replace(polygons, begin_vertices=numbers, end_vertices=numbers[polygons.nexts])
    count = len(polygons.faces)
    pairs = {
        pair
        for pair in permutations(range(count), 2)
        if polygons.faces[pair[0]] == polygons.faces[pair[1]] and _are_in_conflict(polygons, *pair)
    }
    conflicts = find_conflicts(polygons)
    short = (polygons.begins == polygons.ends).all(axis=1)
    short &= polygons.begin_vertices != polygons.end_vertices
    own = {(side, side) for side in np.flatnonzero(short).tolist()}
    assert set(conflicts.sides.tolist()) == {pair[0] for pair in pairs | own}
    assert set(enumerate(conflicts.others.tolist())) - pairs - own <= {
        (side, -1) for side in range(count)
    }
    crossing = {pair[0] for pair in pairs if _cross(polygons, *pair)}
    assert set(np.flatnonzero(conflicts.crosses).tolist()) == crossing
    assert ((conflicts.crosses | conflicts.touches) == (conflicts.others >= 0)).all()


def test_a_side_without_length_between_two_vertices_is_in_conflict() -> None:
    loop = [(0, 0), (9, 0), (9, 0), (9, 9)]
    assert not len(find_conflicts(build_polygons([loop])).sides)
    conflicts = find_conflicts(build_polygons([loop], vertices=[[0, 1, 2, 3]]))
    assert conflicts.touches[1]
    assert set(conflicts.corners.tolist()) == {1, 2}


@pytest.mark.parametrize(
    "hole",
    [
        [(50, 0), (40, 10), (60, 10)],  # a corner in the border
        [(0, 50), (10, 60), (10, 40)],
        [(0, 0), (20, 30), (30, 20)],  # another vertex at a corner of the border
        [(100, 100), (80, 70), (70, 80)],
    ],
)
def test_a_corner_that_touches_moves_by_a_unit(hole: Loop) -> None:
    polygons = build_polygons([SQUARE, hole], vertices=[range(4), range(4, 7)])
    conflicts = find_conflicts(polygons)
    assert len(conflicts.sides)
    assert not conflicts.crosses.any()
    sides, steps = find_steps(
        polygons, conflicts.corners, polygons.begins.astype(float), np.zeros(7, bool)
    )
    assert len(sides) == 1
    assert np.abs(steps).max() == 1
    assert not len(find_conflicts(_move(polygons, sides, steps)).sides)
    # A corner that must not move stays; that of the border moves, if it can.
    fixed = np.zeros(7, bool)
    fixed[sides] = True
    others, _ = find_steps(polygons, conflicts.corners, polygons.begins.astype(float), fixed)
    assert not set(others.tolist()) & set(sides.tolist())


def test_two_sides_of_a_slit_are_moved_apart_into_the_material() -> None:
    loop = [(0, 0), (100, 0), (100, 100), (50, 100), (50, 70), (50, 40), (50, 70), (0, 100)]
    polygons = build_polygons([loop], vertices=[[0, 1, 2, 3, 4, 5, 6, 7]])
    conflicts = find_conflicts(polygons)
    sides, steps = find_steps(
        polygons, conflicts.corners, polygons.begins.astype(float), np.zeros(8, bool)
    )
    assert sides.tolist() == [4]
    assert steps.tolist() == [[1, 0]]
    assert not len(find_conflicts(_move(polygons, sides, steps)).sides)


def test_a_corner_stays_near_the_parameter_curve() -> None:
    hole = [(50, 0), (40, 10), (60, 10)]
    polygons = build_polygons([SQUARE, hole], vertices=[range(4), range(4, 7)])
    conflicts = find_conflicts(polygons)
    exact = polygons.begins.astype(float)
    for offset, count in ((0.3, 1), (0.45, 0)):
        exact[4] = 50, -offset
        sides, steps = find_steps(polygons, conflicts.corners, exact, np.arange(7) != 4)
        assert len(sides) == count
        assert (np.abs(polygons.begins[sides] + steps - exact[sides]) <= 1.4).all()


def test_two_equal_sides_are_in_conflict() -> None:
    loop = [(0, 0), (9, 0), (9, 9)]
    assert len(find_conflicts(build_polygons([loop, loop])).sides) == 6
    assert not len(find_conflicts(build_polygons([loop, loop[::-1]])).sides)


def test_crossing_sides_are_not_moved() -> None:
    polygons = build_polygons([SQUARE, [(50, -0), (40, 200), (60, 200)]])
    conflicts = find_conflicts(polygons)
    assert conflicts.crosses.any()
    sides, steps = find_steps(
        polygons, conflicts.corners, polygons.begins.astype(float), np.zeros(7, bool)
    )
    assert len(find_conflicts(_move(polygons, sides, steps)).sides)


def _move(polygons: Polygons, sides: np.ndarray, steps: np.ndarray) -> Polygons:
    begins = polygons.begins.copy()
    begins[sides] += steps
    return replace(polygons, begins=begins, ends=begins[polygons.nexts])


def test_faces_with_very_many_conflicts_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """The other faces are searched all the same."""
    places = np.random.default_rng(0).integers(0, 1 << 30, (1500, 2)).tolist()
    star = [(x, y) for x, y in places]
    cross = [(0, 0), (9, 9), (9, 0), (0, 9)]
    polygons = build_polygons([star], [cross])
    every = find_conflicts(polygons).sides
    assert len(every) > 1400
    monkeypatch.setattr(crossings, "MOST_CONFLICTS", 100)
    monkeypatch.setattr(box_pairs, "FEW", 0)
    found = find_conflicts(polygons).sides
    assert 100 < len(found) <= len(every)
    assert set(every[-2:].tolist()) <= set(found.tolist())
