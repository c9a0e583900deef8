"""How far surfaces move over a few units, near their borders."""

from dataclasses import replace

import numpy as np
from hypothesis import given

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.places import SIZE, Places
from service.engine.trims.slack import UNITS, bound_slack
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.trims.tables import build_surfaces, seeds
from tests.engine.trims.test_places import build_curved_strips


def build_polygons(corners: FloatArray) -> tuple[Splines, Ints, Ints]:
    """Closed polygons (F, k, 2), one for each face: straight curves, their faces and loops."""
    count, sides = corners.shape[:2]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)
    n = count * sides
    table = CurveTable(
        np.ones(n, np.intp),
        np.full(n, 2),
        ends.reshape(-1, 2),
        np.ones(2 * n),
        np.zeros(n, bool),
        np.tile([0.0, 0, 1, 1], n),
    )
    face = np.repeat(np.arange(count), sides)
    return Splines.of(table), face, face


def bound(places: Places, corners: FloatArray) -> FloatArray:
    """The slack of faces whose borders are polygons of places."""
    pcurves, face, loop = build_polygons(corners)
    return bound_slack(places, pcurves, face, loop, np.zeros(len(face), bool))


def build_step(width: float) -> Places:
    """A surface that rises by 1 in a span of this width, in the middle of its domain."""
    others = np.linspace(0.6, 0.9, 16)
    knots = np.concatenate([[0.5, 0.5, 0.5 + width, 0.5 + width], others])
    table = build_curved_strips(knots)
    points = table.points.reshape(-1, 2, 3).copy()
    points[3:, :, 2] += 1.0
    surfaces = FaceSurfaces.of(replace(table, points=points.reshape(-1, 3)))
    return Places.of(surfaces, np.zeros((1, 2)), np.ones((1, 2)))


@given(seeds)
def test_no_surface_moves_further_near_its_border(seed: int) -> None:
    rng = np.random.default_rng(seed)
    surfaces = FaceSurfaces.of(build_surfaces(rng, 4))
    places = Places.of(surfaces, surfaces.low, surfaces.high)
    corners = rng.integers(0, SIZE + 1, (4, 3, 2)).astype(float)
    slack = bound(places, corners)
    side, share = rng.integers(0, 3, (4, 20)), rng.random((4, 20, 1))
    face = np.repeat(np.arange(4), 20)
    rows = np.arange(4)[:, np.newaxis]
    begin, end = corners[rows, side], corners[rows, (side + 1) % 3]
    x = (begin + share * (end - begin)).reshape(-1, 2)
    y = x + UNITS * rng.choice([-1, 1], x.shape)
    moved = places.evaluate(face, np.clip(y, 0, SIZE)) - places.evaluate(face, x)
    assert (np.sqrt(np.square(moved).sum(axis=1)) <= slack[face] + 1e-13 * 200).all()
    # Coarse, but not much: a span of a surface moves as far as this somewhere.
    assert (slack < 100 * UNITS * 200 / SIZE * 8).all()


def test_weights_move_a_surface_whose_points_do_not() -> None:
    """The points do not depend on u, but the weights do, and so does the surface."""
    points = np.array([[0, 0, 0], [0, 10, 0], [0, 0, 0], [0, 10, 0]], float)
    table = SurfaceTable(
        np.array([[1, 1]]),
        np.array([[2, 2]]),
        points,
        np.array([1.0, 1, 1, 4]),
        np.ones(1, bool),
        np.tile([0.0, 0, 1, 1], 2),
    )
    surfaces = FaceSurfaces.of(table)
    places = Places.of(surfaces, surfaces.low, surfaces.high)
    half = SIZE / 2
    corners = np.array([[[0.0, half], [half, half], [half, 0]]])
    slack = bound(places, corners)
    face = np.zeros(2, np.intp)
    a, b = places.evaluate(face, np.array([[0.0, half], [UNITS, half]]))
    moved = np.abs(b - a).max()
    assert moved > 1e-9
    assert moved < slack[0] < 100 * moved


def test_short_spans_count_only_near_the_border() -> None:
    """A span of 1e-4 of the domain, in which the surface moves as far as in all others."""
    places = build_step(1e-4)
    square = np.array([[[0.0, 0.0], [0.4, 0.0], [0.4, 1.0], [0.0, 1.0]]]) * SIZE
    far = bound(places, square)[0]
    square[0, 1:3, 0] = 0.5 * SIZE - 1
    near = bound(places, square)[0]
    assert far < 1e-7
    assert near > 100 * far


def test_spans_without_places_count_with_their_lengths() -> None:
    """The surface moves by about 1 in a span that is shorter than a unit."""
    places = build_step(2.0**-33)
    corner = np.array([[[0.0, 0.0], [0.1, 0.0], [0.0, 1.0]]]) * SIZE
    slack = bound(places, corner)[0]
    assert 0.5 < slack < 4
    # Every point of the spans is this near to a point that has a place.
    u = 0.5 + np.linspace(0, 2.0**-33, 33)
    lost = places.surfaces.evaluate(np.zeros(33, np.intp), np.stack([u, np.full(33, 0.5)], axis=1))
    ends = lost[[0, -1]]
    distances = np.sqrt(np.square(lost[:, np.newaxis] - ends).sum(axis=2)).min(axis=1)
    assert 0.1 < distances.max() < slack


def test_missing_joins_of_loops_count() -> None:
    """A loop that leaves a gap is joined by a straight segment, which may cross other spans."""
    places = build_step(1e-4)
    corners = np.array([[[0.1, 0.0], [0.2, 0.0], [0.8, 1.0], [0.1, 1.0]]]) * SIZE
    pcurves, face, loop = build_polygons(corners)
    is_reversed = np.zeros(4, bool)
    whole = bound_slack(places, pcurves, face, loop, is_reversed)
    kept = np.array([0, 2, 3])
    gap = bound_slack(places, pcurves.take(kept), face[kept], loop[kept], is_reversed[kept])
    np.testing.assert_array_equal(gap, whole)
