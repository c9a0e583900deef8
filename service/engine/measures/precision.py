"""Integrals within the tolerance and the budget of a query; areas and lengths as intervals.

Cells are halved until the remainders of their rules are within the tolerance, or the budget ends.
Then the interval is wider, and is still proved to contain the exact value.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.measures.cells import UPWARDS
from service.engine.measures.integrals import Integrable, Integrals, estimate, refine
from service.engine.measures.quadrature import Integrand
from service.engine.measures.values import BudgetEnded, Interval, MeasureQuery

REMAINDER_SHARE = 0.43
"""The share of the width of an interval that the remainder may take on each side; the rest is for
rounding."""


def integrate(
    groups: Sequence[Integrable],
    integrand: Integrand,
    scales: FloatArray,
    min_errors: FloatArray,
    query: MeasureQuery,
) -> Integrals:
    """Compute integrals over cells, whose remainders are within the tolerance if that is possible.

    Parameters
    ----------
    scales, min_errors : ndarray of float64, shape (1,) or (2,)
        The allowed errors are max(tolerance · scales, min_errors); `min_errors` are rounding
        errors.

    Raises
    ------
    BudgetEnded
        The query is a trial, and a larger budget would change the result.
    """
    allowed = np.maximum(query.tolerance * scales, min_errors)
    refinement = refine(groups, integrand, allowed, query.budget)
    if refinement.used_budget and query.is_trial:
        raise BudgetEnded
    return refinement.integrate()


def measure_sizes(
    groups: Sequence[Integrable],
    part: Ints,
    count: int,
    query: MeasureQuery,
    *,
    more_errors: FloatArray | None = None,
) -> list[Interval]:
    """Areas or lengths of all cells together, and then of each of `count` parts.

    Patch k belongs to part `part[k]`. The results are in the coordinates of the cells, which do not
    underflow. `more_errors` (count,) are those of parts that the cells do not have.

    Raises
    ------
    BudgetEnded
        As in `integrate`.
    """
    sizes, rounding = estimate(groups, "size")
    integrals = integrate(groups, "size", REMAINDER_SHARE * sizes, rounding, query)
    sums, errors = integrals.over_parts(part, count)
    if more_errors is not None:
        errors[0] += np.append(more_errors.sum(), more_errors) * UPWARDS
    return [
        Interval.about(value, error).without_negatives()
        for value, error in zip(sums[0].tolist(), errors[0].tolist(), strict=True)
    ]
