"""Places for Delaunay insertion: inside of the faces, on no segment, and apart from each other."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.brep.borders.predicates import orient
from service.engine.brep.filling.insertion import choose_places
from service.engine.brep.filling.triangles import build_triangles, find_mates
from tests.engine.brep.filled_faces import draw_inner_places, fill

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_places_are_in_different_triangles_and_on_no_segment(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, int(rng.integers(1, 30))))
    corners, own = filled.corners, filled.read()
    triangles = build_triangles(own, np.zeros(own.shape[1]))
    triangles.bounds[:] = rng.random(own.shape[1])
    rows = rng.permutation(own.shape[1])[: rng.integers(1, own.shape[1])]
    faces, places = choose_places(corners, triangles, find_mates(own), rows)
    assert (np.diff(faces) >= 0).all()
    assert 0 < len(faces) <= len(rows)
    used: set[int] = set()
    fixed, corner_places = corners.find_fixed(own), corners.places[own]
    for face, place in zip(faces, places, strict=True):
        sides = orient(corner_places, corner_places[[1, 2, 0]], place)
        holds = (sides >= 0).all(axis=0) & (corners.faces[own[0]] == face)
        # One triangle, or the two at an edge.
        found = holds.nonzero()[0].tolist()
        assert len(found) == 1 + int((sides[:, holds] == 0).any())
        assert not ((sides[:, holds] == 0) & fixed[:, holds]).any()
        assert not used & set(found)
        used |= set(found)
    before = filled.measure_areas(own)
    filled.insert(faces, places)
    assert filled.measure_areas(filled.read()).tolist() == before.tolist()


def test_the_worst_triangle_gets_a_place() -> None:
    filled = fill()
    own = filled.read()
    for worst in range(own.shape[1]):
        triangles = build_triangles(own, np.zeros(own.shape[1]))
        triangles.bounds[:] = 1.0
        triangles.bounds[worst] = 2.0
        rows = np.array([worst, *np.arange(own.shape[1])])
        alone = choose_places(filled.corners, triangles, find_mates(own), rows[:1])
        together = choose_places(filled.corners, triangles, find_mates(own), np.unique(rows))
        assert alone[1].tolist()[0] in together[1].tolist()
