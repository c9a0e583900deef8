"""Limits of one mesh, and the search for the nearest mesh that a budget allows.

The depth of division, the number of triangles, and the work are limited. The number of triangles
for a tolerance τ is known only after a mesh is built. It grows approximately like 1/τ, since the
deviation of a cell falls with the square of its size. So the search guesses by this law, and
narrows the interval between a tolerance that fits and one that does not.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, sqrt
from typing import Generic, TypeVar

from service.bases.arrays import Ints
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns


@dataclass(slots=True)
class Effort:
    """The work of one request, approximately in multiplications.

    Attributes
    ----------
    limit : float
        The limit of all work.
    spent : float
        Work done.
    reserve : float
        Work that the mesh being built must leave for the next ones.
    """

    limit: float = inf
    spent: float = 0.0
    reserve: float = 0.0

    def spend(self, work: float) -> None:
        """Add to the work spent; raise `TooLarge` beyond the limit, `Cancelled` once cancelled.

        Work beyond the limit does not count, because it is not done.
        """
        checkpoint()
        if self.spent + work > self.limit - self.reserve:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "A mesh with this tolerance takes more work than one request may take.",
                    "/tolerance",
                    f"more than {self.limit:.3g} multiplications",
                    "a greater tolerance",
                )
            )
        self.spent += work

    def reserve_rest(self, work: float) -> None:
        """Reserve the rest of the work, except for the given amount."""
        self.reserve = max(self.limit - self.spent - work, 0.0)


@dataclass(slots=True)
class MeshLimits:
    """Limits of one mesh: its number of triangles, and its work."""

    triangles: float = inf
    effort: Effort = field(default_factory=Effort)

    def spend(self, work: float) -> None:
        """Add to the work spent, as `Effort.spend` does."""
        self.effort.spend(work)

    def count(self, triangles: int) -> None:
        """Raise `TooLarge` if this number of triangles, a lower bound, is beyond the limit."""
        if triangles > self.triangles:
            raise TooLarge(
                Issue(
                    "too_many_triangles",
                    "A mesh with this tolerance has more triangles than the limit.",
                    "/tolerance",
                    f"more than {count_nouns(round(self.triangles), 'triangles')}",
                    "a greater tolerance, or a greater limit",
                )
            )


class SidePieces:
    """Counts the pieces of the sides of faces, once for each side, and limits the triangles.

    A face of k pieces has at least k − 2 triangles.
    """

    def __init__(self, faces: int, most: int) -> None:
        self.triangles, self._limits = -2 * faces, MeshLimits(most)

    def add(self, uses: Ints) -> None:
        """Count a piece for each number of sides that use it, `uses` (n,)."""
        self.triangles += int(uses.sum())
        self._limits.count(self.triangles)


def build_depth_error() -> InvalidRequest:
    """The error for a tolerance that would need cells smaller than `cells.SHORTEST`."""
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The tolerance needs more divisions than double precision can tell apart.",
            "/tolerance",
            "a smaller tolerance",
            "a greater tolerance",
        )
    )


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
