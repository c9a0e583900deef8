"""The search for the nearest mesh within a budget."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.adaptive.budget import CLOSE, MAX_ATTEMPTS, Attempt, nearest_within


class Staircase:
    """Costs c(τ) = ⌈a / τ^e⌉, refused beyond `known`; counts how often it is asked."""

    def __init__(self, a: float, e: float, known: float = math.inf) -> None:
        self.a, self.e, self.known = a, e, known
        self.asked: list[float] = []

    def cost(self, tolerance: float) -> int:
        return max(2, math.ceil(self.a * math.pow(tolerance, -self.e)))

    def __call__(self, tolerance: float) -> Attempt[float] | None:
        self.asked.append(tolerance)
        cost = self.cost(tolerance)
        return None if cost > self.known else Attempt(cost, 0.9 * tolerance, tolerance)


@given(
    a=st.floats(1e-6, 1e6),
    e=st.floats(0.4, 1.5),
    most=st.integers(2, 10**7),
    told=st.booleans(),
)
def test_the_result_fits_and_nothing_much_finer_does(
    a: float, e: float, most: int, told: bool
) -> None:
    costs = Staircase(a, e, math.inf if told else most)
    start = (a / 2) ** (1 / e)  # costs 2
    first = Attempt(2, start, start)
    found = nearest_within(costs, first, most)
    assert found.cost <= most
    assert len(costs.asked) <= MAX_ATTEMPTS
    if found.cost < most:
        assert costs.cost(found.result / CLOSE**1.01) > most


def test_the_coarsest_stays_where_nothing_finer_is_to_be_had() -> None:
    first = Attempt(2, 1.0, "coarsest")
    assert nearest_within(lambda _: None, first, 100) is first


def test_a_mesh_without_deviation_is_not_searched_for() -> None:
    def attempt(_: float) -> Attempt[str]:
        pytest.fail("there is nothing finer")

    first = Attempt(2, 0.0, "exact")
    assert nearest_within(attempt, first, 100) is first


def test_of_two_that_fit_the_one_with_the_smaller_bound_is_taken() -> None:
    """A finer tolerance may be met by a mesh that happens to be worse."""

    def attempt(tolerance: float) -> Attempt[float] | None:
        if tolerance < 0.2:
            return None
        return Attempt(10, 0.19 if tolerance > 0.3 else 0.2, tolerance)

    found = nearest_within(attempt, Attempt(2, 1.0, 1.0), 12)
    assert found.bound == 0.19


def test_the_search_is_short_where_the_law_holds() -> None:
    costs = Staircase(1.0, 1.0)
    nearest_within(costs, Attempt(2, 0.5, 0.5), 100_000)
    assert len(costs.asked) <= 8
