"""Triangles and segments of places, cut at knots that are anywhere."""

from collections import Counter

import numpy as np
from hypothesis import given

from service.bases.arrays import Ints
from service.engine.bounds.clip import PatchPieces, clip_parts
from service.engine.trims.clip import clip_segments
from service.engine.trims.places import SIZE, Places
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import SurfaceTable
from tests.engine.trims.tables import seeds


def build_places(rng: np.random.Generator) -> Places:
    """One face of degree (1, 1) with random knots, some of them nearer than a unit."""
    knots, counts = [], []
    for _ in range(2):
        inner = rng.random(rng.integers(0, 5))
        inner = np.sort(np.append(inner, inner[:1] + 2.0**-34))
        knots.append(np.concatenate([[0.0, 0.0], inner, [1.0, 1.0]]))
        counts.append(len(inner) + 2)
    points = rng.random((counts[0] * counts[1], 3))
    table = SurfaceTable(
        np.array([[1, 1]]),
        np.array([counts]),
        points,
        np.ones(len(points)),
        np.zeros(1, bool),
        np.concatenate(knots),
    )
    surfaces = FaceSurfaces.of(table)
    return Places.of(surfaces, np.zeros((1, 2)), np.ones((1, 2)))


def check_patches(places: Places, pieces: PatchPieces) -> None:
    """Every piece is in the box of its patch, whose parameters are those of its corners."""
    number = pieces.patch - places.first[0]
    spans = number // places.stride[0], number % places.stride[0]
    assert ((pieces.parameters >= 0) & (pieces.parameters <= 1)).all()
    face = np.zeros(len(number), np.intp)
    for axis in range(2):
        begin, end = places.knots_at(face, axis, spans[axis])
        assert (begin < end).all()
        assert (begin <= pieces.corners[:, axis]).all()
        assert (pieces.corners[:, axis] <= end).all()
        expected = (pieces.corners[:, axis] - begin) / (end - begin)
        np.testing.assert_allclose(pieces.parameters[:, axis], expected, rtol=0, atol=2.0**-52)
    complements = 1.0 - pieces.parameters
    np.testing.assert_array_equal(1.0 - complements, pieces.parameters)


def count_sides(corners: Ints) -> Counter[tuple[tuple[int, int], ...]]:
    """The number of uses of each side."""
    triangles = [[tuple(place) for place in one] for one in np.moveaxis(corners, 2, 0).tolist()]
    return Counter(tuple(sorted((one[k], one[(k + 1) % 3]))) for one in triangles for k in range(3))


@given(seeds)
def test_pieces_of_triangles_cover_the_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = build_places(rng)
    inner = rng.integers(1, SIZE, 2)
    a, b, c, d = np.array([[0, 0], [SIZE, 0], [SIZE, SIZE], [0, SIZE]])
    parts = np.array([[a, b, inner], [b, c, inner], [c, d, inner], [d, a, inner]])
    pieces = clip_parts(places, np.zeros(4, dtype=np.intp), np.moveaxis(parts, 0, -1))
    assert (np.diff(pieces.part) >= 0).all()
    check_patches(places, pieces)
    # Every inner side is used twice; the others are the border.
    border = [side for side, n in count_sides(pieces.corners).items() if n % 2]
    for one, other in border:
        assert any(one[axis] == other[axis] in {0, SIZE} for axis in range(2))
    assert sum(abs(p[0] - q[0]) + abs(p[1] - q[1]) for p, q in border) == 4 * SIZE
    # Two sides of each piece, from its first corner, in units of the box.
    one, two = ((pieces.corners[k] - pieces.corners[0]) / SIZE for k in (1, 2))
    np.testing.assert_allclose(np.abs(one[0] * two[1] - one[1] * two[0]).sum() / 2, 1, rtol=1e-8)


@given(seeds)
def test_pieces_of_segments_are_chains_that_triangles_share(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = build_places(rng)
    ends = rng.integers(0, SIZE + 1, (2, 2, 7))
    ends[1, :, 5] = ends[0, :, 5]  # a point
    ends[1, 0, 6] = ends[0, 0, 6] = places.knots[1]  # along a knot line, or the border
    pieces = clip_segments(places, np.zeros(7, dtype=np.intp), ends)
    check_patches(places, pieces)
    np.testing.assert_array_equal(pieces.corners[1], pieces.corners[2])
    for k in range(7):
        sides = Counter(
            tuple(place)
            for side in np.moveaxis(pieces.corners[:2, :, pieces.part == k], 2, 0).tolist()
            for place in side
        )
        odd = [place for place, n in sides.items() if n % 2]
        expected = {tuple(ends[0, :, k].tolist()), tuple(ends[1, :, k].tolist())}
        assert set(odd) == (expected if len(expected) == 2 else set())
    # A triangle is cut at the same places as its sides.
    corners = ends[0, :, :3].T[..., np.newaxis]
    whole = clip_parts(places, np.zeros(1, dtype=np.intp), corners)
    edges = np.stack([corners[..., 0].T, corners[[1, 2, 0], :, 0].T])
    cut = clip_segments(places, np.zeros(3, dtype=np.intp), edges)
    in_triangle = {tuple(p) for p in np.moveaxis(whole.corners, 1, 2).reshape(-1, 2).tolist()}
    assert {tuple(p) for p in np.moveaxis(cut.corners, 1, 2).reshape(-1, 2).tolist()} <= in_triangle
