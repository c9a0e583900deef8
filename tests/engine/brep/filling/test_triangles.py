"""Which triangles meet at an edge, and which edges of a mesh exist twice: by dictionaries."""

from collections import Counter, defaultdict

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.brep.filling.double_edges import find_double_edges
from service.engine.brep.filling.triangles import build_triangles, find_mates, join_ends
from service.engine.vectors import NEXT
from tests.engine.brep.filled_faces import draw_inner_places, fill

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_mates_are_the_same_edges_of_other_triangles(seed: int) -> None:
    filled = fill()
    filled.insert(*draw_inner_places(filled, np.random.default_rng(seed), 9))
    triangles = filled.read()
    mates, count = find_mates(triangles), triangles.shape[1]
    edges = {
        (int(triangles[k, t]), int(triangles[(k + 1) % 3, t])): k * count + t
        for t in range(count)
        for k in range(3)
    }
    for (begin, end), number in edges.items():
        other = edges.get((end, begin), -1)
        assert mates.edges[number] == other
        assert mates.beyond[number // count, number % count] == (
            other % count if other >= 0 else -1
        )
    ends = np.array(list(edges))
    assert mates.has_edges(join_ends(*ends.T)).all()
    assert not mates.has_edges(join_ends(ends[:, 0], ends[:, 0])).any()


def test_bounds_that_are_not_numbers_fail() -> None:
    triangles = build_triangles(np.arange(9).reshape(3, 3), np.ones(3))
    assert triangles.fails.all()
    triangles.bounds[:] = 1.0, np.nan, 1.5
    assert triangles.fails.tolist() == [False, True, True]


@given(seeds)
def test_double_edges_are_those_inside_faces_that_occur_twice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = fill()
    filled.insert(*draw_inner_places(filled, rng, 12))
    triangles = filled.read()
    # Some corners become one point.
    names = np.arange(len(filled.corners.points))
    names[rng.integers(0, len(names), 6)] = rng.integers(0, len(names), 6)
    points, fixed = names[triangles], filled.corners.find_fixed(triangles)
    proper = (points != points[NEXT]).all(axis=0)
    directed: Counter[tuple[int, int]] = Counter()
    between = defaultdict(list)
    for t in proper.nonzero()[0].tolist():
        for k in range(3):
            a, b = int(points[k, t]), int(points[(k + 1) % 3, t])
            directed[a, b] += 1
            if not fixed[k, t]:
                between[frozenset((a, b))].append(k * points.shape[1] + t)
    expected = {edge for ends, n in directed.items() if n > 1 for edge in between[frozenset(ends)]}
    assert set(find_double_edges(points, fixed).tolist()) == expected
