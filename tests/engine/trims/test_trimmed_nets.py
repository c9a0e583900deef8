"""Rectangles of nets against points of regions that rational arithmetic decides."""

import numpy as np
from hypothesis import given

from oracles.regions import Region, build_region
from oracles.solids import read_solid
from service.bases.arrays import FloatArray, Ints
from service.engine.brep.preparation.prepare import prepare
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED, Regions
from service.engine.trims.trimmed_nets import COVER, WHOLE, NetTrims
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.tables import seeds
from tests.engine.trims.test_inside import (
    SQUARE,
    draw_star,
    list_near,
    make_circle,
    make_face,
    make_polygon,
    read_regions,
)

FULL = np.array([[0.0], [1.0], [0.0], [1.0]])


def trim(regions: Regions, low: FloatArray, high: FloatArray) -> NetTrims:
    """A net over [low, high] of the first face, one without trims, and one that only covers."""
    first, last = (np.stack([end, np.zeros(2), np.ones(2)]) for end in (low, high))
    none = np.zeros(3)
    return NetTrims(regions, np.array([0, WHOLE, COVER]), first, last, none, none)


def draw_rectangles(rng: np.random.Generator, centers: FloatArray) -> FloatArray:
    halves = 10 ** rng.uniform(-6, -0.5, centers.shape)
    low, high = np.clip([centers - halves, centers + halves], 0.0, 1.0)
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]])


def sample(rng: np.random.Generator, rectangles: FloatArray, count: int) -> FloatArray:
    """Parameters (m, count, 2) in rectangles (4, m), at corners and inside."""
    shares = rng.random((rectangles.shape[1], count, 2))
    shares[:, :4] = [[0, 0], [1, 0], [0, 1], [1, 1]]
    low, high = rectangles[::2].T[:, np.newaxis], rectangles[1::2].T[:, np.newaxis]
    points: FloatArray = low + shares * (high - low)
    return points


def check(answers: Ints, oracle: Region, points: FloatArray) -> None:
    is_inside, is_sure = (x.reshape(len(answers), -1) for x in oracle.find_inside(points))
    assert is_inside[is_sure & (answers == INSIDE)[:, np.newaxis]].all()
    assert not is_inside[is_sure & (answers == OUTSIDE)[:, np.newaxis]].any()


@given(seeds)
def test_rectangles_agree_with_their_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outer = draw_star(rng, np.array([0.5, 0.5]), 0.5)
    holes = [
        draw_star(rng, np.array(middle), 0.04) | {"reversed": [True]}
        for middle in ((0.45, 0.5), (0.55, 0.5))
        if rng.random() < 0.7
    ]
    document = make_face(outer, *holes)
    regions, oracle = read_regions(document), build_region(document, 0, flatness=1e-3)
    assert oracle is not None
    low, high = np.array([-0.25, 0.0]), np.array([1.0, 1.5])
    trims = trim(regions, low, high)
    near = (list_near(regions, rng, 100) - low) / (high - low)
    centers = np.concatenate([rng.random((100, 2)), np.clip(near, 0, 1)])
    rectangles = draw_rectangles(rng, centers)
    net = np.zeros(len(centers), np.intp)
    answers = trims.classify(net, rectangles)
    assert {INSIDE, OUTSIDE, UNDECIDED} == set(answers.tolist())
    points = low + sample(rng, rectangles, 20) * (high - low)
    check(answers, oracle, points.reshape(-1, 2))
    # The convex sets about pieces are narrow: few rectangles are undecided without need.
    is_inside, is_sure = (
        x.reshape(len(net), -1) for x in oracle.find_inside(points.reshape(-1, 2))
    )
    is_clear = (is_inside == is_inside[:, :1]).all(axis=1) & is_sure.all(axis=1)
    assert ((answers == UNDECIDED) & is_clear).mean() < 0.25
    for number, answer in ((1, INSIDE), (2, UNDECIDED)):
        np.testing.assert_array_equal(trims.classify(net + number, rectangles), answer)
        np.testing.assert_array_equal(trims.find_inside(net + number, rectangles[::2]), answer)


def test_parts_of_rectangles_keep_their_answers() -> None:
    rng = np.random.default_rng(1)
    hole = make_circle((0.4, 0.6), 0.25) | {"reversed": [True]}
    trims = trim(read_regions(make_face(make_polygon(SQUARE), hole)), np.zeros(2), np.ones(2))
    rectangles = draw_rectangles(rng, rng.random((400, 2)))
    net = np.zeros(400, np.intp)
    answers = trims.classify(net, rectangles)
    u, v = (rectangles[k] + rectangles[k + 1] for k in (0, 2))
    halves = rectangles.copy()
    halves[1], halves[2] = u / 2, v / 2
    parts = trims.classify(net, halves)
    is_decided = answers != UNDECIDED
    np.testing.assert_array_equal(parts[is_decided], answers[is_decided])
    assert (parts[~is_decided] != UNDECIDED).any()


def test_borders_along_sides_cut_nothing() -> None:
    trims = trim(read_regions(make_face(make_polygon(SQUARE))), np.zeros(2), np.ones(2))
    net = np.zeros(1, np.intp)
    assert trims.classify(net, FULL).tolist() == [INSIDE]
    # At the sides, points are tested by themselves.
    points = np.array([[0.5, 0.5, 1.0, 1e-12], [0.5, 1e-12, 0.5, 1.0]])
    every, sides = np.zeros(4, np.intp), np.repeat(FULL, 4, axis=1)
    assert trims.needs_test(every, sides, points).tolist() == [False, True, True, True]
    assert trims.find_inside(every, points).tolist() == [1, -1, -1, -1]
    assert not trims.needs_test(every + 1, sides, points).any()
    beyond = trim(trims.regions, np.array([1.0, 0.0]), np.array([2.0, 1.0]))
    assert beyond.classify(net, FULL).tolist() == [UNDECIDED]
    far = trim(trims.regions, np.array([1.0 + 1e-9, 0.0]), np.array([2.0, 1.0]))
    assert far.classify(net, FULL).tolist() == [OUTSIDE]


def test_a_seam_at_the_sides_of_the_box_cuts_nothing() -> None:
    """All borders of a torus are seams; a point on them is inside."""
    regions = prepare(lower(read_solid("torus"))).regions
    assert not regions.is_border.any()
    trims = trim(regions, regions.low[0], regions.high[0])
    net = np.zeros(3, np.intp)
    assert trims.classify(net[:1], FULL).tolist() == [INSIDE]
    seams = np.array([[0.0, 1.0, 0.5], [0.5, 0.5, 1.0]])
    assert trims.needs_test(net, np.repeat(FULL, 3, axis=1), seams).all()
    assert trims.find_inside(net, seams).tolist() == [INSIDE] * 3
