"""Slivers cover what is between loops and polygons; bounds of sides, against sampled distances."""

from math import cos, pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import Border, build_border
from service.engine.brep.borders.border_measure import (
    bound_overhangs,
    measure_border,
    refine_border,
)
from service.engine.brep.borders.convex import clip_to_square, list_fans
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.sampling import sample_edges
from service.engine.brep.borders.slivers import Slivers, find_slivers
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE
from tests.engine.brep.sheets import SQUARE, Against, Curve, Loop, arc, hole, prepare_sheets

FINE = 150
"""Lines by which the oracle replaces a coedge."""

coordinates = st.floats(0.5, 9.5).map(lambda x: round(x, 2))
points = st.tuples(coordinates, coordinates)


@st.composite
def wild_loops(draw: st.DrawFn) -> Loop:
    """A closed loop of two to four curves of degree 1 to 3, maybe with crossings."""
    corners = draw(st.lists(points, min_size=2, max_size=4, unique=True))
    loop: list[Curve | Against] = []
    for begin, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        inner = draw(st.lists(points, max_size=2))
        weights = draw(st.none() | st.lists(st.floats(0.3, 3), min_size=4, max_size=4))
        chosen = None if weights is None else weights[: len(inner) + 2]
        if draw(st.booleans()):
            loop.append(Against(Curve([end, *inner, begin], chosen)))
        else:
            loop.append(Curve([begin, *inner, end], chosen))
    return loop


def _flatten(prepared: PreparedBrep) -> tuple[FloatArray, FloatArray]:
    """The loops of one face as many lines: beginnings and ends, in places."""
    t = np.linspace(0, 1, FINE + 1)
    begins, ends = [], []
    for coedge, is_reversed in enumerate(prepared.coedge_reversed.tolist()):
        low, high = prepared.edge_ranges[prepared.coedge_edges[coedge]]
        curve = prepared.pcurves.evaluate(np.full(FINE + 1, coedge), low + t * (high - low))
        curve = curve[::-1] if is_reversed else curve
        begins.append(curve[:-1])
        ends.append(curve[1:])
    return np.concatenate(begins), np.concatenate(ends)


def _count(points: FloatArray, begins: FloatArray, ends: FloatArray) -> Ints:
    """Winding numbers (m,) of polygons, as sums of angles; and whether points are far from them."""
    a, b = begins - points[:, np.newaxis], ends - points[:, np.newaxis]
    angles = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=2))
    windings: Ints = np.rint(angles.sum(axis=1) / (2 * pi)).astype(np.intp)
    return windings


def _are_far(points: FloatArray, begins: FloatArray, ends: FloatArray, reach: float) -> Bools:
    along = ends - begins
    squared = np.maximum((along * along).sum(axis=1), 1e-9)
    foot = ((points[:, np.newaxis] - begins) * along).sum(axis=2) / squared
    nearest = begins + np.clip(foot, 0, 1)[..., np.newaxis] * along
    distances = np.hypot(*np.moveaxis(points[:, np.newaxis] - nearest, 2, 0)).min(axis=1)
    far: Bools = distances > reach
    return far


def _are_inside(points: FloatArray, slivers: Slivers) -> Bools:
    """Whether points are in one of the triangles."""
    inside = np.zeros(len(points), bool)
    for triangle in np.moveaxis(slivers.corners, 2, 0).astype(float):
        sides = []
        for a, b in ((0, 1), (1, 2), (2, 0)):
            run, to_point = triangle[b] - triangle[a], points - triangle[a]
            sides.append(run[0] * to_point[:, 1] - run[1] * to_point[:, 0])
        inside |= (np.min(sides, axis=0) >= 0) | (np.max(sides, axis=0) <= 0)
    return inside


def _find_all(
    prepared: PreparedBrep, tolerance: float, inner: bool
) -> tuple[EdgeSamples, Border, Slivers]:
    samples = sample_edges(prepared, tolerance)
    border = build_border(prepared, samples)
    sides = np.arange(len(border.faces))
    return samples, border, find_slivers(prepared, samples, border, sides, inner=inner)


GRID = (np.stack(np.meshgrid(*[np.arange(25)] * 2), axis=-1).reshape(-1, 2) + 0.5) / 25 * SIZE


@given(wild_loops(), st.sampled_from([3.0, 0.3]), st.booleans())
def test_slivers_cover_what_the_polygon_leaves_out(
    loop: Loop, tolerance: float, inner: bool
) -> None:
    prepared = prepare_sheets([[loop]])
    _, border, slivers = _find_all(prepared, tolerance, inner)
    curves = _flatten(prepared)
    polygon = border.begins.astype(float), border.ends.astype(float)
    # Near the curves the lines of the oracle do not know the winding number.
    far = _are_far(GRID, *curves, 2e-3 * SIZE) & _are_far(GRID, *polygon, 3)
    places = GRID[far]
    region, covered = _count(places, *curves), _count(places, *polygon)
    missing = (region < covered) if inner else (region > covered)
    assert _are_inside(places[missing], slivers).all()


def test_slivers_of_graphs_are_on_one_side() -> None:
    """A disc has slivers outside of its polygon, a hole none."""
    disc, cut = prepare_sheets([[arc((5, 5), 4, 0, 2 * pi)]]), prepare_sheets([[hole((5, 5), 4)]])
    outside = _find_all(disc, 0.5, False)[2]
    assert len(outside.owners) > 0
    assert not len(_find_all(disc, 0.5, True)[2].owners)
    assert not len(_find_all(cut, 0.5, False)[2].owners)
    assert len(_find_all(cut, 0.5, True)[2].owners) > 0
    places = outside.corners.transpose(0, 2, 1).reshape(-1, 2)
    parameters = disc.places.to_parameters(np.zeros(len(places), np.intp), places)
    assert (np.hypot(*(parameters - 5).T) > 4 * cos(pi / 9) - 1e-6).all()
    # Straight sides have none, a curve that turns back has one on both sides.
    assert not len(_find_all(prepare_sheets([[SQUARE]]), 0.5, False)[2].owners)


@pytest.mark.parametrize("bend", [0.0, 0.08])
@pytest.mark.parametrize("tolerance", [2.0, 0.1])
def test_bounds_of_sides(bend: float, tolerance: float) -> None:
    outer: Loop = [
        Curve([(0, 1), (4, 0), (10, 0)]),
        Curve([(10, 0), (10, 5), (7, 6), (10, 10)]),
        Against(Curve([(0, 1), (3, 9), (10, 10)], (1, 2, 0.5))),
    ]
    loops = [outer, hole((6, 3), 1.5)]
    prepared = prepare_sheets([loops], bend=bend)
    samples, border, slivers = _find_all(prepared, tolerance, False)
    goal = Goal(tolerance)
    measured = measure_border(prepared, samples, border, goal)
    chords = samples.positions[np.stack([border.begin_vertices, border.end_vertices], axis=1)]
    share = np.linspace(0, 1, 21)[:, np.newaxis, np.newaxis]
    places = (1 - share) * border.begins + share * border.ends
    faces = np.zeros(len(border.faces), np.intp)
    far = np.array([_measure(prepared.places.evaluate(faces, x), chords) for x in places])
    assert (far.max(axis=0) <= measured.segment_bounds).all()
    assert measured.segment_bounds.max() < 1.5 * far.max() + 1e-9
    rng = np.random.default_rng(0)
    for overhang in (False, True):
        if overhang:
            slivers = _find_all(prepared, tolerance, True)[2]
            bounds = bound_overhangs(prepared, samples, border, goal)
        else:
            bounds = measured.sliver_bounds
        weights = rng.dirichlet(np.ones(3) / 2, len(slivers.owners) * 30).reshape(-1, 30, 3)
        inside = np.einsum("qsk,kcq->qsc", weights, slivers.corners.astype(float))
        owner = slivers.owners.repeat(30)
        surface = prepared.places.evaluate(faces[owner], inside.reshape(-1, 2))
        found = _measure(surface, chords[owner])
        assert (found <= bounds[owner]).all()
    refined = refine_border(prepared, samples, border, goal)[1]
    assert max(refined.segment_bounds.max(), refined.sliver_bounds.max()) <= 0.95 * tolerance


def _measure(points: FloatArray, chords: FloatArray) -> FloatArray:
    """Distances (m,) of points (m, 3) from segments (m, 2, 3)."""
    along = chords[:, 1] - chords[:, 0]
    foot = ((points - chords[:, 0]) * along).sum(axis=1) / (along * along).sum(axis=1)
    nearest = chords[:, 0] + np.clip(foot, 0, 1)[:, np.newaxis] * along
    distances: FloatArray = np.linalg.norm(points - nearest, axis=1)
    return distances


@given(st.lists(st.tuples(st.integers(-8, 24), st.integers(-8, 24)), min_size=3, max_size=3))
def test_polygons_are_clipped_to_the_square(corners: list[tuple[int, int]]) -> None:
    triangle = np.array(corners, float)
    clipped = clip_to_square(triangle[np.newaxis], 16.0)
    assert ((clipped >= 0) & (clipped <= 16)).all()
    run = triangle[1:] - triangle[0]
    area = run[0, 0] * run[1, 1] - run[0, 1] * run[1, 0]
    assume(area != 0)
    points = (np.stack(np.meshgrid(*[np.arange(23)] * 2), axis=-1).reshape(-1, 2) + 0.37) / 23 * 16
    before = Slivers(np.zeros(1, np.intp), triangle[:, :, np.newaxis].astype(np.intp))
    scaled = np.rint(clipped * 2**24).astype(np.intp)
    polygon, triangles = list_fans(scaled)
    after = Slivers(polygon, triangles)
    expected = _are_inside(points, before)
    unsure = ~_are_far(points, triangle, np.roll(triangle, -1, axis=0), 1e-5)
    found = _are_inside(points * 2**24, after)
    assert (found == expected)[~unsure].all()
