"""Samples at one place, their creases, and the means of their normals, compared with plain
loops."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.clustering import find_leaders
from service.engine.plans.creases import Averages, chord_length, find_creases, mean_normals


def sample_normals(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Random samples: the first sample at the place of each, and normals near four directions."""
    rng = np.random.default_rng(seed)
    places = rng.integers(0, max(count // 3, 1), count)
    _, first, inverse = np.unique(places, return_index=True, return_inverse=True)
    directions = np.array([[0.0, 0, 1], [1, 0, 0], [0, -1, 0], [0, 0.01, 1]])
    normals = directions[rng.integers(0, 4, count)] + rng.normal(0, 1e-4, (count, 3))
    return first[inverse], normals / np.linalg.norm(normals, axis=1, keepdims=True)


@given(st.integers(0, 1 << 16), st.integers(1, 40), st.sampled_from([0.0, 0.02, 1.0, np.pi]))
def test_creases_and_means_are_those_of_plain_loops(seed: int, count: int, angle: float) -> None:
    first_at_place, normals = sample_normals(seed, count)
    groups = Averages.from_leaders(first_at_place)
    expected = find_leaders(first_at_place, normals, chord_length(angle))
    creases = find_creases(normals, groups, angle)
    result = first_at_place.copy()
    if creases is not None:
        # The members of a group are its samples without the leader.
        result[groups.members] = creases.leaders
        # Opposite normals have the same creases, and so the same key in the cache of plans.
        assert getattr(find_creases(-normals, groups, angle), "key", None) == creases.key
    assert result.tolist() == expected.tolist()
    averages = Averages.from_leaders(expected)
    # Each sample is a leader or a member.
    assert sorted([*averages.members, *np.unique(expected)]) == list(range(count))
    for leader, mean in zip(averages.leaders, mean_normals(normals, averages), strict=True):
        total = np.zeros(3)
        for row in np.flatnonzero(expected == leader)[1:]:
            total += normals[row]
        total += normals[leader]
        length = np.sqrt(total @ total)
        np.testing.assert_allclose(mean, total / length if length > 1e-6 else normals[leader])
