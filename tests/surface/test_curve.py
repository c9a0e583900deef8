"""B-spline curves: what they refuse."""

import numpy as np
import pytest

from service.errors import InvalidRequest
from service.surface.curve import BsplineCurve


@pytest.mark.parametrize(
    ("knots", "where"),
    [
        ([0, 0, 0, 1, 1, 1, 2, 3, 4, 4, 4], "/knots/5"),
        ([0, 0, 1, 1, 1, 2, 3, 4, 4], "/knots/4"),  # the first and the last knot are omitted
    ],
)
def test_the_pointer_to_a_discontinuity_is_the_last_of_the_equal_knots(
    knots: list[float], where: str
) -> None:
    points = np.random.default_rng(1).random((8, 3))
    with pytest.raises(InvalidRequest) as refusal:
        BsplineCurve(points, 2, np.array(knots, dtype=np.float64))
    (issue,) = refusal.value.issues
    assert (issue.code, issue.pointer) == ("knot_multiplicity", where)
