"""The search for the mesh of least deviation that a budget allows.

The number of triangles for a tolerance τ is known only after a mesh is built. It grows
approximately like 1/τ, since the deviation of a cell falls with the square of its size. So the
search guesses by this law, and narrows the interval between a tolerance that fits and one that does
not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from typing import Generic, TypeVar

Result = TypeVar("Result")

CLOSE = 1.0 + 2.0**-6
"""The search ends when a tolerance fits and one smaller by this factor does not."""

SPENT = 1.0 - 2.0**-6
"""The search ends when a mesh costs at least this share of the budget."""

MAX_ATTEMPTS = 24
"""Each attempt halves the interval, in logarithms; no interval needs more attempts."""

AIM = 1.0 - 2.0**-7
"""Share of the budget that guesses aim at; at 1, half of the guesses would cost too much."""

FALL = 2.0**-12
"""Least factor between a guess and the tolerance that fits."""


@dataclass(frozen=True, slots=True)
class Attempt(Generic[Result]):
    """The result of one tolerance.

    Attributes
    ----------
    cost : float
        Share of the budget.
    bound : float
        Certified deviation.
    result : Result
        The mesh, for the caller.
    """

    cost: float
    bound: float
    result: Result


def search_tolerances(
    attempt: Callable[[float], Attempt[Result] | None], first: Attempt[Result], least: float
) -> Attempt[Result]:
    """The attempt of least bound among those that cost at most the budget, a cost of 1.

    Either it costs nearly all of the budget, or no tried tolerance fits that is finer by more than
    2^-6. If finer tolerances never cost less, no finer tolerance fits. The result depends on the
    costs and bounds alone.

    Parameters
    ----------
    attempt : callable
        From a tolerance in model units to its attempt; None if it costs more than the budget, or
        cannot be met.
    first : Attempt
        The coarsest attempt, which fits.
    least : float
        Positive; a finer tolerance is not tried.
    """
    best = first
    fits, cost, refused, cost_refused = first.bound, first.cost, 0.0, inf
    for _ in range(MAX_ATTEMPTS):
        if best.cost >= SPENT or fits <= least or fits <= refused * CLOSE:
            break
        tolerance = max(_guess_tolerance(fits, cost, refused, cost_refused), least)
        current = attempt(tolerance)
        if current is None or current.cost > 1:
            refused, cost_refused = tolerance, inf if current is None else current.cost
            continue
        if current.bound < best.bound:
            best = current
        fits, cost = tolerance, current.cost
    return best


def _guess_tolerance(fits: float, cost: float, refused: float, cost_refused: float) -> float:
    """A tolerance between one that fits and one that does not."""
    if cost_refused < inf and cost < 1:
        # τ is about a + b/cost: where the line through both meets the budget.
        share = (1 / cost - 1 / AIM) / (1 / cost - 1 / cost_refused)
        return fits + (refused - fits) * min(max(share, 0.125), 0.875)
    guess = fits * min(max(cost / AIM, FALL), 1 / CLOSE)
    # The law may lead to a tolerance that did not fit before.
    return guess if guess > refused * CLOSE else sqrt(fits * refused)
