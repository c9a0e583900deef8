"""Placements: which are valid, and the boxes of placed bodies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.surface.placement import (
    LEAST_SCALING,
    MAX_SCALING_RATIO,
    place_box,
    place_boxes,
    validate_matrix,
)
from tests.strategies import Array, placements


def is_accepted(matrix: Array) -> bool:
    try:
        validate_matrix(matrix)
    except InvalidRequest:
        return False
    return True


@pytest.mark.parametrize("least", [LEAST_SCALING, 1e-20, 1e-6, 1.0, 1e5, 1e30])
@pytest.mark.parametrize("ratio", [1, 1e3, 1e5, 0.99e6, 1.01e6, 5e6, 1e9])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_placement_is_valid_by_its_scalings(least: float, ratio: float, share: float) -> None:
    """Also if the bound of the scalings, which is faster, has already decided."""
    turns = np.linalg.qr(np.random.default_rng(0).normal(size=(2, 3, 3)))[0]
    for factor in (0.999, 1.001):
        scalings = factor * least * np.array([1, ratio**share, ratio])
        matrix = np.eye(4)
        matrix[:3, :3] = turns[0] @ np.diag(scalings) @ turns[1]
        is_valid = factor * least > LEAST_SCALING and ratio <= MAX_SCALING_RATIO
        assert is_accepted(matrix) == is_valid


@given(st.lists(placements(), min_size=1, max_size=8))
def test_boxes_placed_together_are_those_placed_alone(matrices: list[Array]) -> None:
    """Bit by bit, so that a member has the same box in every group."""
    random = np.random.default_rng(len(matrices))
    lows = random.normal(size=(len(matrices), 3))
    highs = lows + random.random((len(matrices), 3))
    together = place_boxes(lows, highs, np.array(matrices))
    alone = [
        place_box((low, high), matrix)
        for low, high, matrix in zip(lows, highs, matrices, strict=True)
    ]
    assert [end.tolist() for end in together] == [
        [box[side].tolist() for box in alone] for side in (0, 1)
    ]
