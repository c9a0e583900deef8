"""Triangulations of faces: what is inside, numbers of corners, and which triangles stay."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.brep.filling.triangles import join_ends
from service.engine.vectors import NEXT
from tests.engine.brep.filled_faces import HOLE, SQUARE, UNIT, draw_inner_places, fill

seeds = st.integers(0, 2**32 - 1)
AREA = 2 * (256 - 16) * UNIT**2
"""Twice the area of the square less the hole."""


def test_triangles_fill_the_polygons_and_have_their_segments_as_edges() -> None:
    filled = fill()
    triangles = filled.read()
    assert filled.measure_areas(triangles).tolist() == [AREA] * 3
    fixed = filled.corners.find_fixed(triangles)
    # Each segment is an edge of one triangle, in its own direction.
    edges = set(zip(triangles[fixed].tolist(), triangles[NEXT][fixed].tolist(), strict=True))
    segments = filled.triangulations  # one triangulation for each face
    assert segments.faces == [0, 1, 2]
    assert len(edges) == fixed.sum() == len(filled.polygons.faces)
    keys = join_ends(triangles[fixed], triangles[NEXT][fixed])
    assert np.array_equal(np.sort(keys), filled.corners.segments)


def test_a_face_without_segments_has_no_triangulation() -> None:
    filled = fill([SQUARE], [], [SQUARE, HOLE])
    assert filled.triangulations.faces == [0, 2]
    assert filled.measure_areas(filled.read()).tolist() == [512 * UNIT**2, 0, AREA]


@given(seeds)
def test_inserted_points_are_corners_and_other_triangles_stay(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    before = filled.read()
    filled.insert(*draw_inner_places(filled, rng, 20))
    after, previous = filled.triangulations.read([0, 1, 2])
    assert filled.measure_areas(after).tolist() == [AREA] * 3
    count = len(filled.corners.places)
    assert set(after.ravel().tolist()) == set(range(count))
    old_faces, new_faces = (filled.corners.faces[rows[0]] for rows in (before, after))
    kept = 0
    for row in range(after.shape[1]):
        own = before[:, old_faces == new_faces[row]]
        same = [k for k in range(own.shape[1]) if set(own[:, k]) == set(after[:, row])]
        if previous[row] >= 0:
            assert same == [previous[row]]
            kept += 1
    assert (filled.triangulations.read([0, 1, 2])[1] >= 0).all()
    assert kept < after.shape[1]


def test_the_delaunay_test_is_made_after_v_is_scaled() -> None:
    # A rectangle and a point on each long side; with v times 8 it is a tall one.
    rectangle = [(0, 0), (8, 0), (16, 0), (16, 4), (8, 4), (0, 4)]
    filled = fill([rectangle], [rectangle], [rectangle])
    triangles = filled.read()
    places = filled.corners.places[triangles]
    sizes = np.ptp(places, axis=0) / UNIT
    flat, tall = (sizes[filled.corners.faces[triangles[0]] == face] for face in (1, 2))
    assert flat.shape == tall.shape == (4, 2)
    assert tall[:, 0].max() == 8
    assert flat[:, 0].max() >= tall[:, 0].max()
