"""Groups of near points, compared with components computed pair by pair."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from service.engine.joining.near_points import FINER, LEVELS, MAX_CROWD, group_near_points
from service.engine.mesh.equal_points import has_near_points

Array = np.ndarray


def group_by_pairs(points: Array, reach: float) -> list[int]:
    """The first member of each point's component; if that is wider than `reach`, of a finer
    component."""
    apart, leader = cdist(points, points), np.arange(len(points))
    left, finest = leader, reach * FINER ** (LEVELS - 1)
    while len(left) and reach >= finest:
        within = apart[np.ix_(left, left)]
        _, component = connected_components(within <= reach, directed=False)
        members = [np.flatnonzero(component == c) for c in range(component.max() + 1)]
        whole = [rows for rows in members if within[np.ix_(rows, rows)].max() <= reach]
        for rows in whole:
            leader[left[rows]] = left[rows[0]]
        left = np.setdiff1d(left, left[np.concatenate([[], *whole]).astype(int)])
        reach *= FINER
    for k in left.tolist():
        leader[k] = np.flatnonzero(apart[k] == 0)[0]
    return leader.tolist()


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 60),
    st.sampled_from([0.2, 1.0, 3.0]),
    st.integers(1, 9),
)
def test_groups_are_the_components_that_are_not_wide(
    seed: int, count: int, spread: float, clusters: int
) -> None:
    """Points around a few centres, some of them twice, on a lattice of quarters or at random."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 2 + clusters, (clusters, 3))[rng.integers(0, clusters, count)]
    points = points + spread * rng.uniform(-0.5, 0.5, points.shape)
    points = np.round(points * 4) / 4 if seed % 2 else points
    points = np.concatenate([points, points[: count // 3]])
    result = group_near_points(points, 1.0)
    expected = group_by_pairs(points, 1.0)
    if max(np.bincount(connected_components(cdist(points, points) <= 2.0)[1])) <= MAX_CROWD:
        assert result.tolist() == expected
    # Larger crowds may stay unchanged, or have groups within their groups; the order has no effect.
    assert all(
        f == k or expected[f] == e for k, (f, e) in enumerate(zip(result, expected, strict=True))
    )
    order = rng.permutation(len(points))
    again = group_near_points(points[order], 1.0)
    for i, j in combinations(range(0, len(points), 3), 2):
        assert (result[order[i]] == result[order[j]]) == (again[i] == again[j])


@pytest.mark.parametrize("count", [3, 500, 20_000])
def test_a_chain_of_near_points_is_not_a_group(count: int) -> None:
    """Any number of points: a pole, and a line of points closer than the tolerance."""
    rng = np.random.default_rng(count)
    crowd = rng.uniform(0, 1e-3, (count, 3))
    chain = np.stack([np.arange(count) * 0.9, np.zeros(count), np.full(count, 5.0)], axis=1)
    result = group_near_points(np.concatenate([crowd, chain]), 1.0)
    assert (result[:count] == 0).all()
    assert result[count:].tolist() == list(range(count, 2 * count))


def test_both_ends_of_a_short_line_are_points_of_their_own() -> None:
    """The points form a chain wider than the reach; points that differ by rounding join their
    neighbours."""
    line = np.linspace(0, 1.5, 4)[:, None] * [1.0, 0, 0]
    again = line[::-1] + np.random.default_rng(0).uniform(-1e-4, 1e-4, line.shape)
    assert group_near_points(np.concatenate([line, again]), 1.0).tolist() == [
        0,
        1,
        2,
        3,
        3,
        2,
        1,
        0,
    ]


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e6]))
def test_near_points_are_never_missed(seed: int, far: float) -> None:
    """Equal points alone do not count as near points."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (20, 3)) + far
    equal = np.concatenate([points, points[:5]])
    assert not has_near_points(equal, 1e-12)
    near = np.concatenate([equal, np.nextafter(points[:1], np.inf)])
    assert has_near_points(near[rng.permutation(len(near))], 1e-12 + 2.0**-49 * far)
