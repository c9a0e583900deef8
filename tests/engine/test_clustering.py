"""Groups of rows with one key and near values, compared with their definition."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.engine.clustering import MAX_ROUNDS, find_leaders

rows = st.lists(
    st.tuples(st.integers(0, 3), st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=40
)


def find_first_rows(keys: list[int]) -> np.ndarray:
    """For each row, the number of the first row with the same key."""
    return np.array([keys.index(key) for key in keys], dtype=np.intp)


@given(rows, st.sampled_from([0.0, 1.0, 2.5, 100.0]))
def test_groups_have_the_documented_members(
    keys_and_values: list[tuple[int, int, int]], reach: float
) -> None:
    """Each row is near its leader, and no two leaders with one key are near each other."""
    group_key = find_first_rows([key for key, _, _ in keys_and_values])
    values = np.array([[x, y] for _, x, y in keys_and_values], dtype=np.float64)
    leader = find_leaders(group_key, values, reach)
    np.testing.assert_array_equal(leader[leader], leader)
    np.testing.assert_array_equal(group_key[leader], group_key)
    assert (leader <= np.arange(len(leader))).all()
    assert (np.linalg.norm(values - values[leader], axis=1) <= reach).all()
    leaders = np.unique(leader)
    for a in leaders:
        for b in leaders:
            if a < b and group_key[a] == group_key[b]:
                assert np.linalg.norm(values[a] - values[b]) > reach


def test_rows_that_remain_after_the_last_round_lead_their_own_groups() -> None:
    """All rows have one key, and none is near another: more groups than `MAX_ROUNDS`."""
    count = 3 * MAX_ROUNDS
    leader = find_leaders(np.zeros(count, dtype=np.intp), np.arange(count)[:, None] * 10.0, 1.0)
    np.testing.assert_array_equal(leader, np.arange(count))
