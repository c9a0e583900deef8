"""Groups of near points, compared with components computed pair by pair."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from service.engine.connectivity.equal_points import has_near_points
from service.engine.joining.near_points import (
    MAX_CROWD,
    MAX_SEARCHES,
    REACH_FACTOR,
    group_near_points,
)

Array = np.ndarray


def group_by_pairs(points: Array, reach: float) -> list[int]:
    """For each point, the first point of its group, by comparing all pairs.

    If a component is wider than `reach`, its points are grouped again with a smaller `reach`.
    """
    distances, leader = cdist(points, points), np.arange(len(points))
    remaining, finest = leader, reach * REACH_FACTOR ** (MAX_SEARCHES - 1)
    while len(remaining) and reach >= finest:
        remaining_distances = distances[np.ix_(remaining, remaining)]
        _, component = connected_components(remaining_distances <= reach, directed=False)
        members = [np.flatnonzero(component == c) for c in range(component.max() + 1)]
        groups = [
            rows for rows in members if remaining_distances[np.ix_(rows, rows)].max() <= reach
        ]
        for rows in groups:
            leader[remaining[rows]] = remaining[rows[0]]
        remaining = np.setdiff1d(remaining, remaining[np.concatenate([[], *groups]).astype(int)])
        reach *= REACH_FACTOR
    for k in remaining.tolist():
        leader[k] = np.flatnonzero(distances[k] == 0)[0]
    return leader.tolist()


def find_largest_crowd(points: Array, reach: float) -> int:
    """The number of distinct points in the largest set that no gap along an axis divides."""
    distinct = np.unique(points, axis=0)
    for axis in range(3):
        coordinates = np.sort(distinct[:, axis])
        wide = np.flatnonzero(np.diff(coordinates) > reach)
        if len(wide):
            is_low = distinct[:, axis] <= coordinates[wide[0]]
            return max(
                find_largest_crowd(part, reach) for part in (distinct[is_low], distinct[~is_low])
            )
    return len(distinct)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 60),
    st.sampled_from([0.2, 1.0, 3.0]),
    st.integers(1, 9),
)
def test_groups_are_the_components_that_are_not_wide(
    seed: int, count: int, spread: float, clusters: int
) -> None:
    """Points around a few centres, some of them repeated, on a lattice or at random places."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 2 + clusters, (clusters, 3))[rng.integers(0, clusters, count)]
    points = points + spread * rng.uniform(-0.5, 0.5, points.shape)
    points = np.round(points * 4) / 4 if seed % 2 else points
    points = np.concatenate([points, points[: count // 3]])
    result = group_near_points(points, 1.0)
    expected = group_by_pairs(points, 1.0)
    if find_largest_crowd(points, 1.0) <= MAX_CROWD:
        assert result.tolist() == expected
    # The groups of larger crowds may be smaller than expected. The order has no effect.
    assert all(
        leader == k or expected[leader] == expected[k] for k, leader in enumerate(result.tolist())
    )
    order = rng.permutation(len(points))
    reordered = group_near_points(points[order], 1.0)
    for i, j in combinations(range(0, len(points), 3), 2):
        assert (result[order[i]] == result[order[j]]) == (reordered[i] == reordered[j])


@pytest.mark.parametrize("count", [3, 500, 20_000])
def test_a_chain_of_near_points_is_not_a_group(count: int) -> None:
    """`count` points near one place are a group; a chain of points with small gaps is not."""
    rng = np.random.default_rng(count)
    crowd = rng.uniform(0, 1e-3, (count, 3))
    chain = np.stack([np.arange(count) * 0.9, np.zeros(count), np.full(count, 5.0)], axis=1)
    result = group_near_points(np.concatenate([crowd, chain]), 1.0)
    assert (result[:count] == 0).all()
    assert result[count:].tolist() == list(range(count, 2 * count))


def test_the_points_of_a_short_line_are_not_a_group() -> None:
    """They are a chain wider than `reach` = 1; but points that differ by 1e-4 make pairs."""
    line = np.linspace(0, 1.5, 4)[:, None] * [1.0, 0, 0]
    reverse_line = line[::-1] + np.random.default_rng(0).uniform(-1e-4, 1e-4, line.shape)
    groups = group_near_points(np.concatenate([line, reverse_line]), 1.0)
    assert groups.tolist() == [0, 1, 2, 3, 3, 2, 1, 0]


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e6]))
def test_near_points_are_always_found(seed: int, offset: float) -> None:
    """Equal points alone do not count as near points."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (20, 3)) + offset
    repeated_points = np.concatenate([points, points[:5]])
    assert not has_near_points(repeated_points, 1e-12)
    # The new point differs from the first in the last bit of each coordinate: far from zero these
    # bits are larger than 1e-12.
    near_points = np.concatenate([repeated_points, np.nextafter(points[:1], np.inf)])
    order = rng.permutation(len(near_points))
    assert has_near_points(near_points[order], 1e-12 + 2.0**-49 * offset)
