"""Parts cut at knot lines: each piece in one span, equal edges on both sides, no gaps."""

from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.bounds.clip import clip_parts
from service.engine.bounds.faces import SPAN, Faces


def build_face(rows: int, columns: int) -> Faces:
    """A face that begins at patch 5; the model has three patches more in each row than the face."""
    return Faces(np.array([5]), np.array([columns + 3]), np.array([[rows], [columns]]))


def count_edges(corners: np.ndarray) -> Counter[tuple[tuple[int, int], ...]]:
    """The number of uses of each edge."""
    triangles = [[tuple(place) for place in one] for one in np.moveaxis(corners, 2, 0).tolist()]
    return Counter(tuple(sorted((one[k], one[(k + 1) % 3]))) for one in triangles for k in range(3))


@given(st.integers(1, 4), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_pieces_are_in_one_span_and_have_the_border_of_the_face(
    rows: int, columns: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    faces = build_face(rows, columns)
    size = np.array([rows, columns]) * SPAN
    # A face that is divided around an inner point, at places with many digits.
    inner = rng.integers(1, size)
    a, b = np.array([0, 0]), np.array([size[0], 0])
    c, d = size, np.array([0, size[1]])
    parts = np.array([[a, b, inner], [b, c, inner], [c, d, inner], [d, a, inner]])
    pieces = clip_parts(faces, np.zeros(4, dtype=np.intp), np.moveaxis(parts, 0, -1))
    assert (np.diff(pieces.part) >= 0).all()
    assert set(pieces.part.tolist()) == {0, 1, 2, 3}
    assert ((pieces.parameters >= 0) & (pieces.parameters <= 1)).all()
    span_start = np.stack(np.divmod(pieces.patch - 5, columns + 3)) * SPAN
    np.testing.assert_array_equal(
        (pieces.parameters * SPAN).astype(np.int64) + span_start, pieces.corners
    )
    # Every inner edge is used twice; the others are the border.
    border_edges = [edge for edge, n in count_edges(pieces.corners).items() if n % 2]
    for one, other in border_edges:
        assert any(one[axis] == other[axis] in {0, size[axis]} for axis in range(2))
    length = sum(abs(p[0] - q[0]) + abs(p[1] - q[1]) for p, q in border_edges)
    assert length == 2 * size.sum()
    # Two edges of each piece, from its first corner.
    one, two = (pieces.parameters[k] - pieces.parameters[0] for k in (1, 2))
    area = np.abs(one[0] * two[1] - one[1] * two[0]).sum() / 2
    np.testing.assert_allclose(area, rows * columns, rtol=1e-8)
