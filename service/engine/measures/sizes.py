"""Areas of cells, or lengths of curves, as intervals."""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.measures.cells import UPWARDS
from service.engine.measures.integrals import Integrable, estimate
from service.engine.measures.precision import REMAINDER_SHARE, Precision
from service.engine.measures.values import Interval


def measure_sizes(
    name: str,
    groups: Sequence[Integrable],
    part: Ints,
    count: int,
    precision: Precision,
    *,
    more_errors: FloatArray | None = None,
) -> list[Interval]:
    """The areas or lengths of all cells together, and then of each of `count` parts.

    Patch k belongs to part `part[k]`. The results are in the coordinates of the cells, which do not
    underflow. The list is empty if the query will be refused. `more_errors` (count,) are those of
    parts that the cells do not have.
    """
    sizes, rounding = estimate(groups, "size")
    integrals = precision.integrate(name, groups, "size", REMAINDER_SHARE * sizes, rounding)
    if integrals is None:
        return []
    sums, errors = integrals.over_parts(part, count)
    if more_errors is not None:
        errors[0] += np.append(more_errors.sum(), more_errors) * UPWARDS
    return [
        Interval.about(value, error).without_negatives()
        for value, error in zip(sums[0].tolist(), errors[0].tolist(), strict=True)
    ]
