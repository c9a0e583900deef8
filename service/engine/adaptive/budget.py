"""The nearest mesh that a budget allows: a search over tolerances.

How many triangles a tolerance needs is known only once it has been met; it grows about as 1/τ,
since the deviation of a cell falls with the square of its size. So the search guesses by that law,
keeps what fits and what does not apart, and closes in on where they part.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from typing import Generic, TypeVar

Result = TypeVar("Result")

CLOSE = 1.0 + 2.0**-6
"""Factor between a tolerance that fits and one that does not at which the search ends."""

SPENT = 1.0 - 2.0**-6
"""Share of the budget that is worth no further attempt."""

MAX_ATTEMPTS = 24
"""Each halves the doubt, in logarithms; more than this no pair of tolerances needs."""

AIM = 1.0 - 2.0**-7
"""Share of the budget that a guess is made for, lest half of the guesses cost too much."""

FALL = 2.0**-12
"""The largest step towards finer meshes that is taken at once."""


@dataclass(frozen=True, slots=True)
class Attempt(Generic[Result]):
    """What came of one tolerance.

    Attributes
    ----------
    cost : float
        Share of the budget.
    bound : float
        Certified deviation.
    result : Result
    """

    cost: float
    bound: float
    result: Result


def search_tolerances(
    attempt: Callable[[float], Attempt[Result] | None], first: Attempt[Result], least: float
) -> Attempt[Result]:
    """The attempt of least bound that costs no more than the budget, a cost of 1.

    It either costs nearly all of the budget, or no other tolerance tried fits and is more than 2^-6
    finer; it is the finest of all if finer tolerances never cost less. What is found depends on
    nothing but the costs and bounds.

    Parameters
    ----------
    attempt : callable
        To a tolerance in model units, what comes of it; None if it is not to be had, because it
        costs more than the budget or cannot be met.
    first : Attempt
        The coarsest there is; it fits.
    least : float
        Positive; a finer tolerance is not tried.
    """
    best = first
    fits, cost, refused, cost_there = first.bound, first.cost, 0.0, inf
    for _ in range(MAX_ATTEMPTS):
        if best.cost >= SPENT or fits <= least or fits <= refused * CLOSE:
            break
        tolerance = max(_guess_tolerance(fits, cost, refused, cost_there), least)
        found = attempt(tolerance)
        if found is None or found.cost > 1:
            refused, cost_there = tolerance, inf if found is None else found.cost
            continue
        if found.bound < best.bound:
            best = found
        fits, cost = tolerance, found.cost
    return best


def _guess_tolerance(fits: float, cost: float, refused: float, cost_there: float) -> float:
    """A tolerance between one that fits and one that does not."""
    if cost_there < inf and cost < 1:
        # τ is about a + b/cost: where the line through both meets the budget.
        share = (1 / cost - 1 / AIM) / (1 / cost - 1 / cost_there)
        return fits + (refused - fits) * min(max(share, 0.125), 0.875)
    wanted = fits * min(max(cost / AIM, FALL), 1 / CLOSE)
    # What the law promised may have been refused already.
    return wanted if wanted > refused * CLOSE else sqrt(fits * refused)
