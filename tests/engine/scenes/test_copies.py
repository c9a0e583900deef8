"""Copies that are placed at once have the bits of copies that are placed alone."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.scenes.copies import (
    batch_copies,
    bound_placing_errors,
    find_distance,
    find_extents,
    list_copies,
    place_copies_of_normals,
    place_copies_of_points,
    stack_placements,
)
from service.engine.scenes.placing import (
    bound_placing_error,
    place_normals,
    place_points,
    scalings,
)
from service.surface.lowered import PlacedModel
from service.surface.placement import is_mirroring
from tests.strategies import Array, placements

POINTS: Array = np.random.default_rng(1).normal(size=(7, 3))
NORMALS: Array = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)


@given(st.lists(st.none() | placements(), min_size=1, max_size=6))
def test_copies_have_the_same_bits(matrices: list[Array | None]) -> None:
    """Points, normals, boxes, scalings, mirror images and bounds of errors."""
    copies = [PlacedModel("", k % 2, matrix=matrix) for k, matrix in enumerate(matrices)]
    stack = stack_placements(copies)
    points = place_copies_of_points(POINTS, stack.matrices)
    normals = place_copies_of_normals(NORMALS, stack.matrices)
    low, high = find_extents(POINTS, stack.matrices)
    boxes = [(POINTS.min(axis=0), POINTS.max(axis=0)), (np.zeros(3), np.ones(3))]
    errors = bound_placing_errors(copies, stack, [find_distance(*box) for box in boxes])
    for k, matrix in enumerate(matrices):
        assert stack.is_moved[k] == (matrix is not None)
        assert (stack.least[k], stack.most[k]) == scalings(matrix)
        assert stack.is_mirrored[k] == is_mirroring(matrix)
        assert errors[k] == bound_placing_error(matrix, *boxes[k % 2])
        if matrix is not None:
            assert points[k].tolist() == place_points(POINTS, matrix).tolist()
            assert normals[k].tolist() == place_normals(NORMALS, matrix).tolist()
            assert (low[k].tolist(), high[k].tolist()) == (
                points[k].min(axis=0).tolist(),
                points[k].max(axis=0).tolist(),
            )


def test_products_have_errors_of_all_their_matrices() -> None:
    """The bound contains the error of each matrix, spread by those above it."""
    copies = [PlacedModel("", 0, matrix=np.eye(4), chain=(3, 2.0, 5.0)), PlacedModel("", 0)]
    errors = bound_placing_errors(copies, stack_placements(copies), [7.0])
    assert errors.tolist() == [2.0**-36 * 3 * (2 * 7 + 5), 0]
    low = np.array([-7.0, 0, 0])
    assert bound_placing_error(np.eye(4), low, -low, (3, 2.0, 5.0)) == errors[0]
    # The product may be the identity, and its factors are not exact.
    assert bound_placing_error(None, low, -low, (3, 2.0, 5.0)) == errors[0]


def test_copies_of_each_model() -> None:
    copies = [PlacedModel("", number) for number in (2, 0, 2, 2)]
    assert [each.tolist() for each in list_copies(copies, 4)] == [[1], [], [0, 2, 3], []]


def test_batches_are_bounded() -> None:
    """Each has 2^17 points at most, or a single copy."""
    assert list(batch_copies(5, 1 << 16)) == [slice(0, 2), slice(2, 4), slice(4, 5)]
    assert list(batch_copies(2, 1 << 20)) == [slice(0, 1), slice(1, 2)]
    assert list(batch_copies(3, 0)) == [slice(0, 3)]
