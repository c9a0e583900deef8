"""The search for the mesh of least deviation that a budget allows.

The number of triangles for a tolerance τ is known only after a mesh is built. It grows
approximately like 1/τ, because the deviation of a cell falls with the square of its size. So the
search guesses by this law, and narrows the interval between a coarse tolerance, which fits the
budget, and a fine tolerance, which does not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from typing import Generic, TypeVar

Result = TypeVar("Result")

CLOSE_FACTOR = 1.0 + 2.0**-6
"""The search ends when the coarse tolerance is at most this multiple of the fine tolerance."""

MIN_COST = 1.0 - 2.0**-6
"""The search ends when a mesh costs at least this share of the budget."""

MAX_ATTEMPTS = 24
"""Each attempt about halves the interval between the logarithms of the two tolerances; no interval
needs more attempts."""

TARGET_COST = 1.0 - 2.0**-7
"""Share of the budget for which tolerances are guessed; with 1, half of the guesses would cost too
much."""

MIN_FACTOR = 2.0**-12
"""A guess from the coarse tolerance alone is at least this multiple of it."""


@dataclass(frozen=True, slots=True)
class Attempt(Generic[Result]):
    """The result for one tolerance.

    Attributes
    ----------
    cost : float
        Share of the budget that the mesh takes.
    bound : float
        Certified deviation.
    result : Result
        The mesh, for the caller.
    """

    cost: float
    bound: float
    result: Result


def search_tolerances(
    attempt: Callable[[float], Attempt[Result] | None],
    coarsest: Attempt[Result],
    min_tolerance: float,
) -> Attempt[Result]:
    """The attempt of least bound among all attempts that cost at most 1, the whole budget.

    Either this attempt costs nearly all of the budget, or no tolerance that was tried and is finer
    by more than the factor `CLOSE_FACTOR` fits. If finer tolerances never cost less, none at all
    that is finer by more than this factor fits. The result depends on costs and bounds alone.

    Parameters
    ----------
    attempt : callable
        Returns the attempt at a tolerance in model units; None if it costs more than the budget, or
        if the tolerance cannot be met.
    coarsest : Attempt
        The coarsest attempt, which fits the budget.
    min_tolerance : float
        Positive; a finer tolerance is not tried.
    """
    best = coarsest
    # The coarsest mesh fits its own bound as a tolerance.
    coarse, coarse_cost, fine, fine_cost = coarsest.bound, coarsest.cost, 0.0, inf
    for _ in range(MAX_ATTEMPTS):
        if best.cost >= MIN_COST or coarse <= min_tolerance or coarse <= fine * CLOSE_FACTOR:
            break
        tolerance = max(_guess_tolerance(coarse, coarse_cost, fine, fine_cost), min_tolerance)
        current = attempt(tolerance)
        if current is None or current.cost > 1:
            fine, fine_cost = tolerance, inf if current is None else current.cost
            continue
        if current.bound < best.bound:
            best = current
        coarse, coarse_cost = tolerance, current.cost
    return best


def _guess_tolerance(coarse: float, coarse_cost: float, fine: float, fine_cost: float) -> float:
    """A tolerance between `fine`, which does not fit or is 0, and `coarse`, which fits."""
    if fine_cost < inf and coarse_cost < 1:
        # Near both tolerances τ is about a + b/cost, so this line gives τ for the cost
        # `TARGET_COST`.
        share = (1 / coarse_cost - 1 / TARGET_COST) / (1 / coarse_cost - 1 / fine_cost)
        # Each attempt reduces the interval by at least 1/8.
        return coarse + (fine - coarse) * min(max(share, 0.125), 0.875)
    guess = coarse * min(max(coarse_cost / TARGET_COST, MIN_FACTOR), 1 / CLOSE_FACTOR)
    # The guess may be finer than a tolerance that did not fit.
    return guess if guess > fine * CLOSE_FACTOR else sqrt(coarse * fine)
