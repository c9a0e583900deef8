"""Integrates within the budget of a query, and refuses tolerances that the budget cannot reach.

Cells are halved before anything is summed (`integrals.refine`), so that only bounds are computed
before a refusal. The refusal names the tolerance that can be reached for each quantity. If a
quantity cannot reach any allowed tolerance (for example a volume of zero), the query is not
refused, and the result has a wider interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import floor, log10

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.integrals import Integrable, Integrals, refine
from service.engine.measures.quadrature import Integrand
from service.engine.measures.values import MAX_TOLERANCE, BudgetEnded, MeasureQuery
from service.errors import Issue, TooLarge

REMAINDER_SHARE = 0.43
"""The share of the width of an interval that the remainder may take on each side; the rest is for
rounding."""

EDGES, OPEN_EDGES = "the edges", "the open edges"
"""Names of the lengths of edges of parts, which have a budget of their own."""

EDGE_BUDGET = 1 << 16
"""The most control points of the cells of edges of a part."""

NEVER_REFUSED = frozenset({"the borders", EDGES, OPEN_EDGES})
"""Quantities for which no query is refused: the length of an edge may be costly where its curve
turns back, and then has a wider interval; areas and volumes do not depend on it."""

MARGIN = 4
"""A refusal names a tolerance 4 times as large as the tolerance that was reached: with the named
tolerance other cells are halved, and the result may be a little worse."""


@dataclass(slots=True)
class Precision:
    """The integrals of one query, and the tolerances that can be reached if its tolerance cannot.

    Attributes
    ----------
    query : MeasureQuery
    share : float
        The share of the budget of the query that each integral may use: less than 1 while one of
        several bodies is measured.
    reachable_tolerances : dict of str to float
        A tolerance for each quantity for which the budget does not suffice.
    has_wider_intervals : bool
        Whether the query is not refused, although its tolerance cannot be reached: a quantity
        cannot reach any tolerance up to `MAX_TOLERANCE`, so the result has wider intervals.
    """

    query: MeasureQuery
    share: float = 1.0
    reachable_tolerances: dict[str, float] = field(default_factory=dict)
    has_wider_intervals: bool = False

    def integrate(
        self,
        name: str,
        groups: Sequence[Integrable],
        integrand: Integrand,
        scales: FloatArray,
        min_errors: FloatArray,
    ) -> Integrals | None:
        """Compute the integrals of a quantity; None if the query will be refused.

        Parameters
        ----------
        name : str
            Name of the quantity, for the refusal.
        scales, min_errors : ndarray of float64, shape (1,) or (2,)
            The allowed errors are max(tolerance · scales, min_errors); `min_errors` are rounding
            errors.

        Raises
        ------
        BudgetEnded
            The query is a trial, and a larger budget would change the result.
        """
        allowed = np.maximum(self.query.tolerance * scales, min_errors)
        has_own = name in {EDGES, OPEN_EDGES}
        budget = int((EDGE_BUDGET if has_own else self.query.budget) * self.share)
        refinement = refine(groups, integrand, allowed, budget)
        if refinement.used_budget and self.query.is_trial and not has_own:
            raise BudgetEnded
        # The width that the remainders alone give to the interval, in units of the allowed width.
        width = 2 * REMAINDER_SHARE * refinement.excess
        if width > 1 and name not in NEVER_REFUSED and not self.has_wider_intervals:
            with np.errstate(divide="ignore"):
                reached = MARGIN * width * float((allowed / scales).max())
            if reached <= MAX_TOLERANCE:
                self.reachable_tolerances[name] = round_up(reached)
            else:
                self.has_wider_intervals = not self.reachable_tolerances
        return None if self.reachable_tolerances else refinement.integrate()

    def refuse_if_too_costly(self) -> None:
        """Refuse the query if a quantity needs more cells than the budget has.

        Raises
        ------
        TooLarge
            `too_costly`.
        """
        if self.reachable_tolerances:
            listed = ", ".join(
                f"{tolerance:g} for {name}" for name, tolerance in self.reachable_tolerances.items()
            )
            raise TooLarge(
                Issue(
                    "too_costly",
                    "Such narrow intervals take more work than this service gives to one request.",
                    "/tolerance",
                    f"{self.query.tolerance:g}",
                    f"at least {max(self.reachable_tolerances.values()):g}: {listed}",
                )
            )


def round_up(value: float) -> float:
    """A positive value rounded up to two significant digits."""
    unit = 1 - floor(log10(value))
    digits = -floor(-value * 10.0**unit)
    return float(f"{digits}e{-unit}")
