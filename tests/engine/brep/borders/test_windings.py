"""Winding numbers just left of sides, against rational numbers."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.crossings import find_conflicts
from service.engine.brep.borders.windings import choose_sides, count_windings, find_reversed_loops
from tests.engine.brep.polygons import Loop, build_polygons

OUTER = [(0, 0), (100, 0), (100, 100), (0, 100)]
HOLE = [(20, 20), (20, 80), (80, 80), (80, 20)]
ISLAND = [(30, 30), (70, 30), (70, 70), (30, 70)]


def _count_winding(polygons: Polygons, side: int) -> int:
    """The winding number at a point left of the middle of a side, nearer than any other side."""
    a, b = polygons.begins[side].tolist(), polygons.ends[side].tolist()
    tiny = Fraction(1, 1 << 200)
    x = Fraction(a[0] + b[0], 2) - tiny * (b[1] - a[1])
    y = Fraction(a[1] + b[1], 2) + tiny * (b[0] - a[0])
    winding = 0
    for other in np.flatnonzero(polygons.faces == polygons.faces[side]):
        (cx, cy), (dx, dy) = polygons.begins[other].tolist(), polygons.ends[other].tolist()
        if (cy <= y) != (dy <= y):
            at = cx + (y - cy) * (dx - cx) / Fraction(dy - cy)
            winding += (1 if dy > cy else -1) if at > x else 0
    return winding


places = st.tuples(st.integers(0, 5), st.integers(0, 5))
far = st.sampled_from([1, 1 << 27])


@given(st.lists(st.lists(places, min_size=3, max_size=6), min_size=1, max_size=3), far)
def test_windings_are_those_of_rational_numbers(loops: list[Loop], scale: int) -> None:
    polygons = build_polygons([[(x * scale, y * scale) for x, y in loop] for loop in loops])
    assume(not len(find_conflicts(polygons).sides))
    sides = choose_sides(polygons)
    windings = count_windings(polygons, sides)
    assert [_count_winding(polygons, side) for side in sides.tolist()] == windings.tolist()
    # The other sides of a loop have the same number, or one of the chains between shared places.
    for loop in range(len(loops)):
        own = np.flatnonzero((polygons.loops == loop) & (polygons.begins != polygons.ends).any(1))
        expected = {_count_winding(polygons, side) for side in own.tolist()}
        assert set(windings[polygons.loops[sides] == loop].tolist()) == expected


@pytest.mark.parametrize(
    ("loops", "wrong"),
    [
        ([OUTER, HOLE, ISLAND], {}),
        ([OUTER[::-1]], {0: True}),
        ([OUTER, HOLE[::-1]], {1: True}),
        ([OUTER, ISLAND, HOLE], {}),
        ([OUTER, ISLAND], {1: True}),  # an island without a hole around it
        ([HOLE, OUTER], {}),
        ([HOLE], {0: True}),
        # Two triangles that touch at a vertex; one of them is wrong.
        ([[(0, 0), (5, 5), (10, 0), (10, 10), (5, 5), (0, 10)]], {}),
        ([[(0, 0), (5, 5), (10, 10), (10, 0), (5, 5), (0, 10)]], {0: False}),
        # A hole that touches the border at a vertex of both, and a cut along a seam.
        ([OUTER, [(0, 0), (20, 40), (40, 20)]], {}),
        ([[(0, 0), (100, 0), (100, 100), (50, 100), (50, 50), (50, 100), (0, 100)]], {}),
    ],
)
def test_loops_with_the_material_on_their_right_are_found(
    loops: list[Loop], wrong: dict[int, bool]
) -> None:
    polygons = build_polygons(loops)
    assert not len(find_conflicts(polygons).sides)
    sides, whole = find_reversed_loops(polygons)
    assert dict(zip(polygons.loops[sides].tolist(), whole.tolist(), strict=True)) == wrong
