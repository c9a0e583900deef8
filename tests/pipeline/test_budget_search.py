"""The search for the mesh of least deviation within a budget."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.pipeline.budget_search import (
    CLOSE_FACTOR,
    MAX_ATTEMPTS,
    MIN_COST,
    Attempt,
    search_tolerances,
)

MIN_TOLERANCE = 1e-300


class Staircase:
    """Meshes of ⌈a / τ^e⌉ triangles for a tolerance τ; a cost is a share of the budget.

    `tolerances` are those that the search has tried, in this order. Without `has_costs`, a mesh
    beyond the budget is None, so that its cost stays unknown.
    """

    def __init__(self, a: float, e: float, budget: int, *, has_costs: bool = True) -> None:
        self.a, self.e, self.budget, self.has_costs = a, e, budget, has_costs
        self.tolerances: list[float] = []

    def cost(self, tolerance: float) -> float:
        return max(2, math.ceil(self.a * math.pow(tolerance, -self.e))) / self.budget

    def coarsest(self) -> Attempt[float]:
        tolerance = math.pow(self.a / 2, 1 / self.e)
        return Attempt(2 / self.budget, tolerance, tolerance)

    def __call__(self, tolerance: float) -> Attempt[float] | None:
        self.tolerances.append(tolerance)
        cost = self.cost(tolerance)
        return Attempt(cost, 0.9 * tolerance, tolerance) if self.has_costs or cost <= 1 else None


@given(
    a=st.floats(1e-6, 1e6),
    e=st.floats(0.4, 1.5),
    budget=st.integers(2, 10**7),
    has_costs=st.booleans(),
)
def test_the_result_is_within_the_budget_and_much_finer_meshes_are_not(
    a: float, e: float, budget: int, has_costs: bool
) -> None:
    meshes = Staircase(a, e, budget, has_costs=has_costs)
    result = search_tolerances(meshes, meshes.coarsest(), MIN_TOLERANCE)
    assert result.cost <= 1
    assert len(meshes.tolerances) <= MAX_ATTEMPTS
    # A tolerance finer by the factor `CLOSE_FACTOR` does not fit; the power allows for rounding.
    assert result.cost >= MIN_COST or meshes.cost(result.result / CLOSE_FACTOR**1.01) > 1


def test_a_mesh_without_deviation_is_not_searched_for() -> None:
    def attempt(_: float) -> Attempt[str]:
        pytest.fail("no mesh is finer")

    first = Attempt(0.1, MIN_TOLERANCE, "exact")
    assert search_tolerances(attempt, first, MIN_TOLERANCE) is first


def test_no_tolerance_below_the_least_is_tried() -> None:
    meshes = Staircase(1.0, 1.0, 100_000)
    result = search_tolerances(meshes, meshes.coarsest(), 1e-3)
    assert min(meshes.tolerances) == 1e-3
    assert result.result == 1e-3


def test_of_two_meshes_within_the_budget_the_search_takes_the_smaller_bound() -> None:
    """The mesh for a finer tolerance may have a larger bound."""
    bounds = []

    def attempt(tolerance: float) -> Attempt[float] | None:
        if tolerance < 0.16:
            return None
        bounds.append(0.15 if tolerance > 0.19 else 0.16)
        return Attempt(0.8, bounds[-1], tolerance)

    result = search_tolerances(attempt, Attempt(0.2, 1.0, 1.0), MIN_TOLERANCE)
    assert bounds[:2] == [0.15, 0.16]
    assert result.bound == 0.15


def test_the_search_is_short_if_triangles_follow_the_power_law() -> None:
    meshes = Staircase(1.0, 1.0, 100_000)
    search_tolerances(meshes, meshes.coarsest(), MIN_TOLERANCE)
    assert len(meshes.tolerances) <= 6
