"""Cuts and flips of edges: the triangles still fill the faces, and meet along whole edges."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import Ints
from service.engine.brep.filling.flips import flip_edges
from service.engine.brep.filling.splits import (
    add_middles,
    choose_edges,
    cut_edges,
    find_cuts,
    join_mates,
    measure_edges,
)
from service.engine.brep.filling.triangles import build_triangles, find_mates
from service.engine.trims.places import SIZE
from tests.engine.brep.filled_faces import (
    BUMP,
    SQUARE,
    FilledFaces,
    build_surfaces,
    draw_inner_places,
    fill,
)

seeds = st.integers(0, 2**32 - 1)


def check_filling(filled: FilledFaces, triangles: Ints, before: Ints) -> None:
    """The triangles cover what those before cover, and only segments have one triangle."""
    expected = filled.measure_areas(before)
    assert filled.measure_areas(triangles).tolist() == expected.tolist()
    alone = find_mates(triangles).edges.reshape(3, -1) < 0
    assert np.array_equal(alone, filled.corners.find_fixed(triangles))


@given(seeds)
def test_cut_edges_divide_triangles_on_both_sides(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, 12))
    before = filled.read()
    triangles, mates = build_triangles(before, np.ones(before.shape[1])), find_mates(before)
    free = (mates.edges >= 0).nonzero()[0]
    edges = join_mates(mates, rng.choice(free, rng.integers(1, 25)))
    count = len(filled.corners.places)
    removed, added = cut_edges(filled.corners, triangles, mates, edges)
    after = np.concatenate([before[:, ~removed], added], axis=1)
    check_filling(filled, after, before)
    assert len(filled.corners.places) == count + len(edges)  # no cut was given up
    new = filled.corners.places[count:]
    ends = filled.corners.places[
        np.stack([before.ravel()[edges], before[[1, 2, 0]].ravel()[edges]])
    ]
    assert ((new >= ends.min(axis=0)) & (new <= ends.max(axis=0))).all()
    # Cuts on knot lines are exactly there, others in the middle.
    off = np.abs(new - ends.sum(axis=0) // 2).max(axis=1) > 1
    knots = filled.corners.surface.knots
    assert np.isin(new[off], knots).any(axis=1).all()


def test_an_edge_is_cut_at_the_middle_of_the_knot_lines_it_crosses() -> None:
    surface = build_surfaces()
    begins, ends = np.array([[0, 0], [0, 5]]), np.array([[SIZE, SIZE // 4], [100, 5]])
    cuts, shares = find_cuts(surface, np.full(2, BUMP), begins, ends)
    assert cuts[0].tolist() == [SIZE // 2, SIZE // 8]  # the knots of u are at 1/4 and 1/2
    assert shares.tolist() == [0.5, 0.5]
    assert cuts[1].tolist() == [50, 5]


def test_edges_off_the_surface_are_cut_and_else_the_longest() -> None:
    filled = fill([SQUARE], [SQUARE], [SQUARE])
    own = filled.read()
    triangles, mates = build_triangles(own, np.full(own.shape[1], 1e-3)), find_mates(own)
    edges, without = choose_edges(filled.corners, triangles, mates, np.arange(own.shape[1]))
    # Each square has one edge inside, its diagonal.
    assert len(edges) == 3
    assert not len(without)
    _, deviations = measure_edges(filled.corners, own)
    on_plane = filled.corners.faces[own[0]] == 2
    assert deviations[:, on_plane].max() < 1e-12
    assert deviations[:, ~on_plane].max() > 0.1


def test_triangles_of_segments_alone_are_divided_at_their_middles() -> None:
    filled = fill([[(0, 0), (16, 0), (0, 16)]])
    before = filled.read()
    triangles, mates = build_triangles(before, np.ones(1)), find_mates(before)
    edges, without = choose_edges(filled.corners, triangles, mates, np.arange(1))
    assert (edges.tolist(), without.tolist()) == ([], [0])
    removed, added = add_middles(filled.corners, triangles, without)
    assert removed.all()
    check_filling(filled, added, before)


@given(seeds)
def test_flips_make_thin_triangles_thicker(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, 15))
    before = filled.read()
    triangles, mates = build_triangles(before, np.zeros(before.shape[1])), find_mates(before)
    after, flipped = flip_edges(
        filled.corners, triangles, mates, np.arange(before.shape[1]), tolerance=10.0
    )
    check_filling(filled, after.corners, before)
    assert len(set(flipped.tolist())) == len(flipped)
    changed = (after.corners != before).any(axis=0).nonzero()[0]
    assert set(changed) == set(flipped)

    def find_lowest(rows: Ints) -> float:
        a, b, c = filled.corners.positions[filled.corners.points[rows]]
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        longest = np.max([np.linalg.norm(x, axis=1) for x in (b - a, c - b, a - c)], axis=0)
        return float((areas / longest).min())

    if len(flipped):
        assert find_lowest(after.corners[:, flipped]) > find_lowest(before[:, flipped])
