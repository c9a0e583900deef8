"""Places in regions of loops, against winding numbers in rational arithmetic."""

import tracemalloc
from itertools import pairwise
from math import tau
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.regions import build_region
from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from service.engine.trims import border_tree, border_windings, inside
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED, Regions
from service.engine.trims.places import SIZE
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.tables import seeds

Document = dict[str, Any]

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
S = 0.5**0.5
CIRCLE = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]])
ROUND = {"type": "bspline", "degree": 2, "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
         "weights": [1, S, 1, S, 1, S, 1, S, 1]}  # fmt: skip


def make_face(*loops: Document, size: float = 1.0, origin: float = 0.0) -> Document:
    """A plane face over [origin, origin + size]²."""
    low, high = origin, origin + size
    net = [[[x, y, 0] for y in (low, high)] for x in (low, high)]
    knots = [[low, low, high, high]] * 2
    surface = {"type": "bspline", "degree": [1, 1], "knots": knots, "control_net": net}
    return {"type": "brep", "vertices": [], "edges": [],
            "faces": [{"surface": surface, "loops": list(loops)}]}  # fmt: skip


def make_polygon(corners: Any) -> Document:
    sides = pairwise(np.asarray(corners, float).tolist())
    return {"pcurves": [{"type": "bezier", "control_points": [a, b]} for a, b in sides]}


def make_circle(middle: tuple[float, float], radius: float) -> Document:
    points = (np.array(middle) + radius * CIRCLE).tolist()
    return {"pcurves": [ROUND | {"control_points": points}]}


def read_regions(document: Document) -> Regions:
    return prepare(lower(document)).regions


def ask(regions: Regions, parameters: Any) -> list[int]:
    points = np.asarray(parameters, float).reshape(-1, 2)
    answers: list[int] = regions.find_inside(np.zeros(len(points), np.intp), points).inside.tolist()
    return answers


def draw_star(rng: np.random.Generator, middle: FloatArray, radius: float) -> Document:
    """A closed curve around a point: a ray from there crosses it once."""
    degree, count = int(rng.integers(1, 5)), int(rng.integers(7, 14))
    angles = np.arange(count) * tau / (count - 1)
    points = middle + np.stack([np.cos(angles), np.sin(angles)], axis=1) * (
        radius * (0.3 + 0.7 * rng.random((count, 1)))
    )
    points[-1] = points[0]
    inner = np.arange(1.0, count - degree)
    knots = [0.0] * (degree + 1) + inner.tolist() + [count - degree + 0.0] * (degree + 1)
    curve = {"type": "bspline", "degree": degree, "knots": knots}
    if rng.random() < 0.5:
        curve["weights"] = (0.2 + rng.random(count)).tolist()
    return {"pcurves": [curve | {"control_points": points.tolist()}]}


def list_near(regions: Regions, rng: np.random.Generator, count: int) -> FloatArray:
    """Points at random distances from the border, down to 1e-9 of the box."""
    tree = regions.tree
    curve = rng.integers(0, len(tree.pcurves), count)
    start, end = tree.pcurves.start[curve], tree.pcurves.end[curve]
    places = tree.pcurves.evaluate(curve, start + rng.random(count) * (end - start))
    places += rng.normal(size=(count, 2)) * SIZE * 10 ** rng.uniform(-9, -1, (count, 1))
    return regions.places.to_parameters(np.zeros(count, np.intp), places)


@given(seeds)
def test_curved_loops_agree_with_rationals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outer = draw_star(rng, np.array([0.5, 0.5]), 0.5)
    holes = [
        draw_star(rng, np.array(middle), 0.04) | {"reversed": [True]}
        for middle in ((0.45, 0.5), (0.55, 0.5))
        if rng.random() < 0.7
    ]
    document = make_face(outer, *holes)
    regions, oracle = read_regions(document), build_region(document, 0, flatness=3e-4)
    assert oracle is not None
    points = np.concatenate([rng.random((100, 2)), list_near(regions, rng, 100)])
    is_inside, is_sure = oracle.find_inside(points)
    answers = np.array(ask(regions, points))
    assert (answers != UNDECIDED).all()
    assert is_sure.mean() > 0.5
    np.testing.assert_array_equal(answers[is_sure] == INSIDE, is_inside[is_sure])


@given(seeds)
def test_circles_have_points_inside_down_to_the_margin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    middle, radius = rng.uniform(0.4, 0.6, 2), rng.uniform(0.1, 0.35)
    outer = make_polygon(SQUARE)
    hole = make_circle((middle[0], middle[1]), radius) | {"reversed": [True]}
    regions = read_regions(make_face(outer, hole))
    angle = rng.random(200) * tau
    distance = 10 ** rng.uniform(-9.5, -2, 200) * rng.choice([-1, 1], 200)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    answers = ask(regions, middle + (radius + distance)[:, np.newaxis] * way)
    assert answers == np.where(distance > 0, INSIDE, OUTSIDE).tolist()
    assert set(ask(regions, middle + radius * way)) == {UNDECIDED}


@pytest.mark.parametrize(("origin", "size"), [(0.0, 1.0), (-7.0, 0.125), (1e6, 1e-3)])
def test_points_on_sides_are_undecided_and_no_others(origin: float, size: float) -> None:
    corners = np.array([[0, 0], [1, 0], [1, 0.5], [0.25, 1], [0, 0]])
    regions = read_regions(
        make_face(make_polygon(origin + size * corners), size=size, origin=origin)
    )
    share = np.arange(0, 17) / 16
    step = max(1e-10, 1e-15 * abs(origin) / size * 50)
    for (a, b), (x, y) in zip(pairwise(corners), np.diff(corners, axis=0), strict=True):
        on = a + share[:, np.newaxis] * (b - a)
        normal = np.array([-y, x]) / np.hypot(x, y)
        assert set(ask(regions, origin + size * on)) == {UNDECIDED}
        inner = on[1:-1]
        assert set(ask(regions, origin + size * (inner + step * normal))) == {INSIDE}
        assert set(ask(regions, origin + size * (inner - step * normal))) == {OUTSIDE}


@given(seeds, st.integers(0, 3))
def test_rays_through_corners_count_once(seed: int, turns: int) -> None:
    """A polygon on a small grid, and points on the same grid: most rays meet corners or sides."""
    rng = np.random.default_rng(seed)
    heights = rng.integers(1, 8, 9)
    heights[1:] += heights[1:] == heights[:-1]
    top = [[k, 8 + h] for k, h in enumerate(heights.tolist())]
    bottom = [[k, 8 - h] for k, h in enumerate(heights[::-1].tolist())]
    corners = np.array([*bottom, *top[::-1], bottom[0]]) / 16.0
    for _ in range(turns):
        corners = np.stack([1 - corners[:, 1], corners[:, 0]], axis=1)
    document = make_face(make_polygon(corners))
    regions, oracle = read_regions(document), build_region(document, 0)
    assert oracle is not None
    points = np.stack(np.meshgrid(*[np.arange(17) / 16] * 2), axis=-1).reshape(-1, 2)
    is_inside, is_sure = oracle.find_inside(points)
    expected = np.where(is_sure, is_inside, UNDECIDED)
    assert ask(regions, points) == expected.tolist()


def test_curves_that_do_not_meet_are_joined_by_segments() -> None:
    sides = [[[0, 0], [0.9, 0]], [[1, 0.1], [1, 1]], [[1, 1], [0, 1]], [[0, 1], [0, 0]]]
    loop = {"pcurves": [{"type": "bezier", "control_points": side} for side in sides]}
    regions = read_regions(make_face(loop))
    assert ask(regions, [[0.949, 0.05], [0.951, 0.05], [0.95, 0.05]]) == [1, 0, -1]


def test_few_pairs_are_tested_of_a_point_and_a_long_border() -> None:
    """2,000 sides, and a circle of few pieces."""
    angle = np.linspace(0, tau, 2001)
    radius = 0.45 + 0.02 * np.cos(40 * angle)
    corners = 0.5 + radius[:, np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners[-1] = corners[0]
    regions = read_regions(
        make_face(make_polygon(corners), make_circle((0.5, 0.5), 0.2) | {"reversed": [True]})
    )
    assert regions.tree.counts[0] == 2000
    assert regions.tree.counts[1] < 100
    points = np.random.default_rng(0).random((5000, 2))
    answers = regions.find_inside(np.zeros(5000, np.intp), points)
    distance = np.hypot(*(points - 0.5).T)
    limit = 0.45 + 0.02 * np.cos(40 * np.arctan2(*(points - 0.5).T[::-1]))
    is_clear = np.abs(distance - limit) > 1e-4
    expected = (distance < limit) & (distance > 0.2)
    np.testing.assert_array_equal((answers.inside == INSIDE)[is_clear], expected[is_clear])
    assert answers.tests < 40 * 5000
    assert answers.halves < 0.1 * 5000


def test_few_pairs_are_tested_of_a_point_and_many_holes() -> None:
    """A sieve with 400 square holes, in no order."""
    count, rng = 20, np.random.default_rng(0)
    middles = (np.stack(np.divmod(rng.permutation(count * count), count), axis=1) + 0.5) / count
    half = 0.3 / count
    square = half * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1], [-1, -1]])
    holes = [make_polygon(middle + square) for middle in middles]
    regions = read_regions(make_face(make_polygon(SQUARE), *holes))
    points = rng.random((2000, 2))
    answers = regions.find_inside(np.zeros(2000, np.intp), points)
    distance = np.abs(points - (np.floor(points * count) + 0.5) / count).max(axis=1)
    np.testing.assert_array_equal(answers.inside == INSIDE, distance > half)
    assert answers.tests < 50 * 2000


def test_answers_do_not_depend_on_the_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    document = make_face(draw_star(rng, np.array([0.5, 0.5]), 0.5))
    regions = read_regions(document)
    points = np.concatenate([rng.random((100, 2)), list_near(regions, rng, 100)])
    expected = ask(regions, points)
    assert {INSIDE, OUTSIDE} <= set(expected)
    monkeypatch.setattr(border_tree, "WIDTH", np.inf)
    monkeypatch.setattr(border_tree, "BRANCHES", 2)
    monkeypatch.setattr(inside, "CHUNK", 7)
    monkeypatch.setattr(border_windings, "PAIRS", 3)
    assert ask(read_regions(document), points) == expected


def test_many_boxes_about_one_point_take_little_memory() -> None:
    """Two nested spirals of long sides: half of their boxes contain a point of one quadrant."""
    turns = 300
    angle = np.arange(4 * turns + 1) * tau / 4 + 0.4
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radius = np.linspace(0.2, 0.49, len(angle))[:, np.newaxis]
    out, back = 0.5 + radius * way, 0.5 + (radius - 1e-4) * way
    corners = np.concatenate([out, back[::-1], out[:1]])
    regions = read_regions(make_face(make_polygon(corners)))
    points = 0.5 + np.random.default_rng(1).uniform(-0.13, 0.13, (2_000, 2))
    face = np.zeros(len(points), np.intp)
    tracemalloc.start()
    try:
        answers = regions.find_inside(face, points)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert answers.tests > 100 * len(points)
    assert peak < 40e6
    is_center = np.hypot(*(points - 0.5).T) < 0.13
    assert (answers.inside[is_center] == OUTSIDE).all()


def test_no_points_have_no_answers() -> None:
    assert ask(read_regions(make_face(make_polygon(SQUARE))), []) == []
