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

MAX_ATTEMPTS = 24
"""Each halves the doubt, in logarithms; more than this no pair of tolerances needs."""

FALL = 2.0**-12
"""The largest step towards finer meshes that is taken at once."""


@dataclass(frozen=True, slots=True)
class Attempt(Generic[Result]):
    """What came of one tolerance.

    Attributes
    ----------
    cost : int
        In the units of the budget: triangles, bytes.
    bound : float
        Certified deviation.
    result : Result
    """

    cost: int
    bound: float
    result: Result


def nearest_within(
    attempt: Callable[[float], Attempt[Result] | None], first: Attempt[Result], most: int
) -> Attempt[Result]:
    """The attempt of least bound that costs at most `most`.

    No other tolerance tried fits and is more than 2^-6 finer; it is the finest of all if finer
    tolerances never cost less. What is found depends on nothing but the costs and bounds.

    Parameters
    ----------
    attempt : callable
        To a tolerance in model units, what comes of it; None if it is not to be had, because it
        costs more than the budget or cannot be met.
    first : Attempt
        The coarsest there is; it fits.
    most : int

    Returns
    -------
    Attempt
    """
    best = first
    fits, refused = first.bound, 0.0
    cost_there = inf
    for _ in range(MAX_ATTEMPTS):
        if best.cost >= most or not fits > 0 or fits <= refused * CLOSE:
            break
        tolerance = _guess(fits, best.cost, refused, cost_there, most)
        found = attempt(tolerance)
        if found is None or found.cost > most:
            refused, cost_there = tolerance, inf if found is None else found.cost
            continue
        if found.bound < best.bound:
            best = found
        fits = tolerance
    return best


def _guess(fits: float, cost: int, refused: float, cost_there: float, most: int) -> float:
    """A tolerance between one that fits and one that does not."""
    wanted = fits * max(cost / most, FALL)
    if refused == 0.0:
        return min(wanted, fits / 2)
    if cost_there < inf:
        # Where the line through both, in the law's terms, meets the budget.
        share = (1 / cost - 1 / most) / (1 / cost - 1 / cost_there)
        wanted = fits + (refused - fits) * min(max(share, 0.125), 0.875)
        return wanted
    return sqrt(fits * refused)
