"""Loops that touch, cross, or nearly do so; loops on the wrong side; many holes."""

from collections.abc import Sequence
from math import atan2, hypot, pi

import numpy as np
import pytest

from service.engine.bounds.goal import Goal
from service.engine.brep.borders import settling
from service.engine.brep.borders.border import build_border
from service.engine.brep.borders.border_measure import measure_border
from service.engine.brep.borders.crossings import find_conflicts
from service.engine.brep.borders.sampling import sample_edges
from service.engine.brep.borders.settling import settle_border
from service.engine.brep.borders.windings import count_windings
from service.engine.brep.prepared import PreparedBrep
from tests.engine.brep.sheets import (
    SQUARE,
    Against,
    Loop,
    arc,
    hole,
    line,
    list_lines,
    prepare_sheets,
)

ANGLE = atan2(5, 5)
LENS = [
    *arc((5, 0), hypot(5, 5), ANGLE, pi - ANGLE),
    *arc((5, 10), hypot(5, 5), ANGLE - pi, -ANGLE),
]
NECK = [(0, 0), (10, 0), (10, 10), (5.0005, 10), (5.0005, 1), (4.9995, 1), (4.9995, 10), (0, 10)]

VALID: dict[str, Sequence[Loop]] = {
    "a hole that touches the border": [SQUARE, hole((5, 2), 2)],
    "a hole near the border": [SQUARE, hole((5, 2.001), 2)],
    "two holes that touch": [SQUARE, hole((4, 5), 1), hole((6, 5), 1)],
    "a neck": [list_lines(NECK)],
    "a needle": [list_lines([(0, 0), (10, 0), (0, 1e-4)])],
    "a crescent": [arc((5, 5), 5, 0, 2 * pi), arc((5 + 0.999e-3, 5), 4.999, 0, -2 * pi)],
    "a lens": [LENS],
    "two triangles that share a vertex": [
        list_lines([(0, 0), (5, 5), (10, 0), (10, 10), (5, 5), (0, 10)])
    ],
    "a slit of two edges": [
        [
            *(line((0, 0), (10, 0)), line((10, 0), (10, 10)), line((10, 10), (5, 10))),
            *(line((5, 10), (5, 5)), line((5, 5), (5, 10))),
            *(line((5, 10), (0, 10)), line((0, 10), (0, 0))),
        ]
    ],
    "a slit of one edge": [
        [
            *(line((0, 0), (10, 0)), line((10, 0), (10, 10)), line((10, 10), (5, 10))),
            *(line((5, 10), (5, 5)), Against(line((5, 10), (5, 5)))),
            *(line((5, 10), (0, 10)), line((0, 10), (0, 0))),
        ]
    ],
    "a circle around a circle": [hole((5, 5), 3), arc((5, 5), 4, 0, 2 * pi)],
}

CROSSING: dict[str, tuple[Sequence[Loop], dict[int, str]]] = {
    f"a hole that crosses the border by {depth}": (
        [SQUARE, hole((5, 2 - depth), 2)],
        {0: "loops_cross", 1: "loops_cross"},
    )
    for depth in (1e-7, 1e-5, 1e-3)
}
INVALID: dict[str, tuple[Sequence[Loop], dict[int, str]]] = {
    **CROSSING,
    "two holes that overlap": (
        [SQUARE, hole((4, 5), 1), hole((6 - 1e-5, 5), 1)],
        {1: "loops_cross", 2: "loops_cross"},
    ),
    "lines that cross": ([list_lines([(0, 0), (10, 10), (10, 0), (0, 10)])], {0: "loops_cross"}),
    "two triangles that cross at a vertex": (
        [list_lines([(0, 0), (5, 5), (10, 10), (10, 0), (5, 5), (0, 10)])],
        {0: "loops_cross"},
    ),
    "a hole along the border": (
        [SQUARE, list_lines([(2, 0), (2, 2), (4, 2), (4, 0)])],
        {0: "loops_cross", 1: "loops_cross"},
    ),
    "three corners at one place": (
        [SQUARE, list_lines([(5, 0), (4, 1), (6, 1)]), list_lines([(5, 1e-9), (4.9, 1), (5.1, 1)])],
        {0: "loops_cross", 1: "loops_cross", 2: "loops_cross"},
    ),
    "a clockwise border": ([hole((5, 5), 4)], {0: "loop_reversed"}),
    "a counter-clockwise hole": ([SQUARE, arc((5, 5), 4, 0, 2 * pi)], {1: "loop_reversed"}),
    "a hole outside": ([arc((2, 2), 1, 0, 2 * pi), hole((7, 7), 1)], {1: "loop_reversed"}),
}


def _settle(prepared: PreparedBrep, tolerance: float) -> tuple[dict[int, str], int]:
    """The faults of loops by number; how many sides were added."""
    samples = sample_edges(prepared, tolerance)
    border = build_border(prepared, samples)
    before = len(border.faces)
    samples, border, faults = settle_border(prepared, samples, border)
    bad = np.isin(border.faces, faults.faces)
    conflicts = find_conflicts(border)
    assert bad[conflicts.sides].all()
    sides = np.flatnonzero(~bad & (border.begins != border.ends).any(axis=1))
    assert (count_windings(border, sides) == 1).all()
    # All images of a piece have the vertices of its samples.
    ends = np.stack([border.begin_vertices, border.end_vertices])
    backward = prepared.coedge_reversed[border.coedges]
    ends[:, backward] = ends[::-1, backward]
    expected = np.stack([samples.vertices[border.samples], samples.vertices[border.samples + 1]])
    assert (ends == expected).all()
    # Corners stay near the parameter curves.
    exact = border.places[border.rows]
    assert np.abs(border.begins - exact).max() <= 1.4
    measured = measure_border(prepared, samples, border, Goal(tolerance))
    assert measured.segment_bounds.max() < 1e-6
    return dict(zip(faults.loops.tolist(), faults.codes.tolist(), strict=True)), len(bad) - before


@pytest.mark.parametrize("tolerance", [0.14, 1.4e-3])
@pytest.mark.parametrize("name", VALID)
def test_valid_loops_stay_valid(name: str, tolerance: float) -> None:
    faults, added = _settle(prepare_sheets([VALID[name]]), tolerance)
    assert not faults
    assert added < 40


@pytest.mark.parametrize("tolerance", [0.14, 1.4e-3])
@pytest.mark.parametrize("name", INVALID)
def test_invalid_loops_are_found(name: str, tolerance: float) -> None:
    loops, expected = INVALID[name]
    # Another face beside it is valid.
    faults, added = _settle(prepare_sheets([loops, [SQUARE]]), tolerance)
    assert faults == expected
    assert added < 60


def test_a_plate_with_many_holes_near_each_other() -> None:
    """Holes of two curves at 1e-4 from each other; chords of the first samples overlap."""
    radius = 0.49995
    holes = [hole((i + 0.5, j + 0.5), radius) for i in range(10) for j in range(10)]
    faults, _ = _settle(
        prepare_sheets([[list_lines([(-1, -1), (11, -1), (11, 11), (-1, 11)]), *holes]]), 0.5
    )
    assert not faults


def test_halving_ends_where_loops_are_too_near(monkeypatch: pytest.MonkeyPatch) -> None:
    thin = [arc((5, 5), 5, 0, 2 * pi), arc((5 + 0.9e-5, 5), 5 - 1e-5, 1, 1 - 2 * pi)]
    assert not _settle(prepare_sheets([thin]), 0.14)[0]
    monkeypatch.setattr(settling, "MOST_SIDES", 200)
    faults, added = _settle(prepare_sheets([thin]), 0.14)
    assert set(faults.values()) == {"loops_cross"}
    assert added < 800
