"""The edges of a loop that must be turned around."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.cad.chains import find_turned


@given(count=st.integers(3, 12), seed=st.integers(0, 2**32 - 1))
def test_the_swapped_edges_are_found_if_they_are_fewer_than_half(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.permutation(100)[:count].tolist()
    ends = list(zip(vertices, [*vertices[1:], vertices[0]], strict=True))
    swapped = sorted(rng.permutation(count)[: int(rng.integers(0, (count + 1) // 2))].tolist())
    given_ends = [(b, a) if k in swapped else (a, b) for k, (a, b) in enumerate(ends)]
    assert find_turned(given_ends, count * [True]) == swapped
    if swapped:
        fixed = [k != swapped[0] for k in range(count)]
        assert find_turned(given_ends, fixed) == []


def test_open_chains_and_lenses_stay() -> None:
    assert find_turned([(1, 2), (2, 3), (4, 3)], 3 * [True]) == []
    assert find_turned([(1, 2), (5, 3), (3, 1)], 3 * [True]) == []
    assert find_turned([(1, 2), (1, 2)], 2 * [True]) == []
    assert find_turned([(1, 1)], [True]) == []
