"""Coordinates around a closed axis, compared with all pairs of them."""

import numpy as np
from hypothesis import given

from service.engine.brep.preparation.circle import Circle
from tests.engine.trims.tables import seeds

LOW, PERIOD = -0.75, 2.5


@given(seeds)
def test_distances_and_counts_are_those_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.integers(-40, 40, rng.integers(0, 9)) / 8
    candidates = rng.integers(-20, 20, 5) / 8
    distance = float(rng.choice([1 / 64, 3 / 16]))
    apart = (candidates[:, np.newaxis] - values) / PERIOD
    apart = np.abs(apart - np.rint(apart))
    circle = Circle(LOW, PERIOD)
    found = circle.find_distance(candidates, values)
    np.testing.assert_allclose(found, apart.min(axis=1, initial=1.0), rtol=0, atol=1e-12)
    near = circle.count_near(candidates, values, distance)
    assert near.tolist() == (apart <= distance).sum(axis=1).tolist()


@given(seeds)
def test_steps_cross_as_many_lines_as_lie_between_their_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    begins, ends = rng.uniform(-9, 9, (2, rng.integers(0, 9)))
    candidates = LOW + PERIOD * rng.random(5)
    expected = [
        sum(
            min(begin, end) < candidate + number * PERIOD <= max(begin, end)
            for begin, end in zip(begins, ends, strict=True)
            for number in range(-9, 9)
        )
        for candidate in candidates
    ]
    assert Circle(LOW, PERIOD).count_crossings(candidates, begins, ends).tolist() == expected
