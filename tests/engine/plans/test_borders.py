"""Counts of the border edges of meshes, compared with counts in a dictionary."""

from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.plans.faces import count_borders

VERTICES = 6
corner = st.integers(0, VERTICES - 1)


@given(
    triangles=st.lists(st.tuples(corner, corner, corner), max_size=8),
    quads=st.lists(st.tuples(corner, corner, corner, corner), max_size=4),
    welds=st.none() | st.permutations(range(VERTICES)),
    has_reversed_copies=st.booleans(),
)
def test_border_edges_are_counted(
    triangles: list[tuple[int, ...]],
    quads: list[tuple[int, ...]],
    welds: list[int] | None,
    has_reversed_copies: bool,
) -> None:
    if has_reversed_copies:
        triangles, quads = (rows + [row[::-1] for row in rows] for rows in (triangles, quads))
    # `welds` of a mesh is the first vertex at each position, so it is never larger than the vertex.
    lowest = list(range(VERTICES)) if welds is None else [min(k, w) for k, w in enumerate(welds)]
    uses = Counter(
        tuple(sorted((lowest[a], lowest[b])))
        for row in (*triangles, *quads)
        for a, b in zip(row, row[1:] + row[:1], strict=True)
    )
    faces = (
        np.array(triangles, dtype=np.uint32).reshape(-1, 3),
        np.array(quads, dtype=np.uint32).reshape(-1, 4),
    )
    boundary_edges, is_watertight = count_borders(
        faces, None if welds is None else np.array(lowest, dtype=np.uint32)
    )
    assert boundary_edges == sum(count == 1 for count in uses.values())
    assert is_watertight == all(count == 2 for count in uses.values())
