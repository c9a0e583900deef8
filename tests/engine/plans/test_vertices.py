"""Samples at one position become one vertex, or several vertices if their normals disagree."""

from math import pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import AnyInts
from service.engine.clustering import MAX_ROUNDS, find_leaders
from service.engine.plans import vertices
from service.engine.plans.vertices import (
    Averages,
    Welding,
    chord_length,
    find_creases,
    mean_normals,
    merge_samples,
    number_vertices,
)

UP, ASIDE = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def weld_samples(
    same_position: list[int],
    normals: list[tuple[float, float, float]] | None = None,
    *,
    crease: float = radians(1),
    samples_of_faces: list[int] | None = None,
    merge: bool = True,
) -> tuple[Welding, np.ndarray | None]:
    """The welding of samples, and their normals, which welding overwrites.

    `same_position` is for each sample the first sample at its position. By default all samples
    occur in faces.
    """
    normal_rows = None if normals is None else np.array(normals)
    used = None
    if samples_of_faces is not None:
        used = np.zeros(len(same_position), dtype=bool)
        used[samples_of_faces] = True
    leader: AnyInts = np.arange(len(same_position))
    if merge:
        leader = merge_samples(np.array(same_position), normal_rows, crease)
    return number_vertices(np.array(same_position), leader, used), normal_rows


def to_lists(welding: Welding) -> tuple[list[int], list[int], list[int]]:
    """The vertex of each sample, the first sample of each vertex, and `welds`.

    `welds` is for each vertex the first vertex at its position.
    """
    return welding.vertex.tolist(), welding.samples.tolist(), welding.welds.tolist()


def test_without_normals_all_samples_at_a_position_are_one_vertex() -> None:
    """Samples 1 and 3 are at one position."""
    assert to_lists(weld_samples([0, 1, 2, 1])[0]) == ([0, 1, 2, 1], [0, 1, 2], [0, 1, 2])


def test_agreeing_normals_are_merged_into_their_mean() -> None:
    """The normals differ by less than the crease angle; their mean has unit length."""
    tilted = (np.sin(0.01), 0.0, np.cos(0.01))
    result, normals = weld_samples([0, 0], [UP, tilted])
    assert to_lists(result) == ([0, 0], [0], [0])
    assert normals is not None
    np.testing.assert_allclose(normals[0], (np.sin(0.005), 0, np.cos(0.005)), atol=1e-15)


def test_equal_normals_keep_every_bit() -> None:
    """For example, the mean of vertical normals at a pole is exactly vertical."""
    _, normals = weld_samples([0, 0, 0], [UP, UP, UP])
    assert normals is not None
    assert normals[0].tolist() == list(UP)


def test_samples_with_different_normals_stay_separate_vertices() -> None:
    """Four samples at one position become two vertices, which have one entry in `welds`."""
    result, normals = weld_samples([0, 0, 2, 0, 0], [UP, ASIDE, UP, UP, ASIDE])
    assert to_lists(result) == ([0, 1, 2, 0, 1], [0, 1, 2], [0, 0, 2])
    assert normals is not None
    assert normals[:2].tolist() == [list(UP), list(ASIDE)]


def test_a_crease_angle_of_zero_merges_equal_normals_only() -> None:
    """A crease angle of π merges all normals, also opposite normals."""
    tilted = (np.sin(1e-7), 0.0, np.cos(1e-7))
    assert len(weld_samples([0, 0, 0], [UP, UP, tilted], crease=0)[0].samples) == 2
    result, normals = weld_samples([0, 0], [UP, (0.0, 0.0, -1.0)], crease=pi)
    assert len(result.samples) == 1
    # Opposite normals have no mean direction: the vertex gets the first normal.
    assert normals is not None
    assert normals[0].tolist() == list(UP)


def test_samples_without_faces_do_not_become_vertices() -> None:
    """Sample 0 has no face, although it is the first sample at the position of sample 2."""
    result, _ = weld_samples([0, 1, 0], [UP, UP, ASIDE], samples_of_faces=[1, 2])
    assert result.samples.tolist() == [1, 2]
    assert result.vertex[[1, 2]].tolist() == [0, 1]
    assert result.welds.tolist() == [0, 1]


def test_without_merging_every_sample_is_a_vertex() -> None:
    """`welds` still says which vertices have one position."""
    result, _ = weld_samples([0, 1, 0], [UP, UP, UP], merge=False)
    assert to_lists(result) == ([0, 1, 2], [0, 1, 2], [0, 1, 0])


def test_samples_with_more_normals_than_rounds_stay_separate_vertices() -> None:
    """Each round finds one group of equal normals; after `MAX_ROUNDS` rounds no more is merged.

    All normals at the position differ, so each sample keeps its normal.
    """
    count = 3 * MAX_ROUNDS
    angle = 2 * pi * np.arange(count) / count
    directions = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    result, normals = weld_samples([0] * count, [tuple(row) for row in directions.tolist()])
    assert len(result.samples) == count
    assert result.welds.tolist() == [0] * count
    np.testing.assert_array_equal(normals, directions)


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


def test_means_are_the_same_in_runs_of_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    first_at_place, normals = sample_normals(5, 400)
    averages = Averages.from_leaders(first_at_place)
    assert 8 < averages.pair_count < len(averages.leaders)
    means = mean_normals(normals, averages)
    monkeypatch.setattr(vertices, "RUN", 3)
    assert (mean_normals(normals, averages) == means).all()
