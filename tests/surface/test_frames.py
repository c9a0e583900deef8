"""Frames of members: products of placements with those of all parents."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.surface.frames import MAX_DEPTH, find_depths, multiply_frames
from tests.strategies import Array, placements


@st.composite
def trees(draw: st.DrawFn) -> tuple[list[Array | None], list[int | None]]:
    """Placements of some members, and for each the number of an earlier member or None."""
    matrices = draw(st.lists(st.none() | placements(), min_size=1, max_size=8))
    parents = [draw(st.none() | st.integers(0, k - 1)) if k else None for k in range(len(matrices))]
    return matrices, parents


@given(trees())
def test_frames_are_products(tree: tuple[list[Array | None], list[int | None]]) -> None:
    """Each frame is the product along the path from the root, which the test multiplies itself."""
    matrices, parents = tree
    try:
        frames = multiply_frames(matrices, parents, find_depths(parents))
    except InvalidRequest:  # products of some steep placements flatten bodies
        return
    for number in range(len(matrices)):
        product, levels, member = np.eye(4), 0, number
        reach, path = 0.0, []
        while True:
            path.append(member)
            if (above := parents[member]) is None:
                break
            member = above
        stretch = 1.0
        for each in reversed(path):
            matrix = matrices[each]
            if matrix is None:
                continue
            product, levels = product @ matrix, levels + 1
            reach += stretch * float(np.linalg.norm(matrix[:3, 3]))
            stretch *= float(np.linalg.norm(matrix[:3, :3], 2))
        scale = stretch + reach
        assert np.abs(frames.matrices[number] - product).max() <= 1e-13 * scale * max(levels, 1)
        assert frames.levels[number] == levels
        assert stretch <= frames.stretches[number] <= stretch * (1 + 1e-9)
        assert reach * (1 - 1e-15) <= frames.reaches[number] <= reach * (1 + 1e-9)


@pytest.mark.parametrize(
    ("parents", "code", "where"),
    [
        ([0], "unknown_parent", "/members/0/parent"),
        ([None, 1], "unknown_parent", "/members/1/parent"),
        ([None, -1], "unknown_parent", "/members/1/parent"),
        ([None, 2, 0], "unknown_parent", "/members/1/parent"),
        ([None, *range(MAX_DEPTH)], "too_deep", f"/members/{MAX_DEPTH}/parent"),
    ],
)
def test_wrong_parents(parents: list[int | None], code: str, where: str) -> None:
    """A parent is an earlier member, and not too many are above one another."""
    with pytest.raises(InvalidRequest) as caught:
        find_depths(parents)
    assert (caught.value.issues[0].code, caught.value.issues[0].pointer) == (code, where)


def test_the_deepest_tree() -> None:
    """As many levels as the limit allows."""
    parents = [None, *range(MAX_DEPTH - 1)]
    assert find_depths(parents).tolist() == list(range(MAX_DEPTH))


@pytest.mark.parametrize(
    ("scales", "code", "where"),
    [
        ([(1e30, 1e30, 1e30), (1e30, 1e30, 1e30)], "out_of_range", "/members/1/matrix"),
        ([(1e5, 1, 1), (1e5, 1, 1)], "singular_matrix", "/members/1/matrix"),
        ([(1e200, 1e200, 1e200), (1e200, 1e200, 1e200)], "not_finite", "/members/1/matrix"),
        ([(1e5, 1, 1), (1e5, 1, 1), None], "singular_matrix", "/members/1/matrix"),
    ],
)
def test_products_that_place_nothing(
    scales: list[tuple[float, ...] | None], code: str, where: str
) -> None:
    """Each matrix alone may be valid, and the product is not: the first such member is named."""
    matrices = [None if each is None else np.diag([*each, 1]) for each in scales]
    parents = [None, *range(len(scales) - 1)]
    with pytest.raises(InvalidRequest) as caught:
        multiply_frames(matrices, parents, find_depths(parents))
    assert (caught.value.issues[0].code, caught.value.issues[0].pointer) == (code, where)
